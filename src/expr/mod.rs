//! The expression language: formulas in text, with exact derivatives.
//!
//! ```text
//! text --parse--> Expr (tree, every part with its place) --Builder + Scope--> Tape --eval::<S>--> numbers
//! ```
//!
//! * [`parse`] and [`parse_equation`] read text. They know the grammar and the functions, but no name.
//! * A [`Scope`] says what a name means: a constant, an input slot, or another formula built before.
//! * A [`Tape`] is a flat list of operations with common parts shared. Evaluated with a scalar that carries derivatives
//!   ([`crate::scalar`]) it yields them exactly; there is no symbolic differentiation.
//!
//! | text | means |
//! |---|---|
//! | `1`, `.5`, `2.`, `1e-3` | a number |
//! | `40[deg]`, `8[um]` | a number with its unit; angles become radians, other units are for the [`Scope`] |
//! | `a + b`, `a - b`, `a*b`, `a/b` | from left to right: `1/2/2 = 0.25` |
//! | `a^b` | from right to left, before a sign: `2^3^2 = 512`, `-2^2 = -4` |
//! | `pi`, `sqrt(x)` `exp` `ln` `sin` `cos` `tan` `asin` `acos` `atan` `sinh` `cosh` `tanh` | |
//! | `cone.end.phi` | a name |
//! | `cap.value(mu, phi = 1.2)` | a call of a dotted name; only the last argument may have a name |
//! | `lhs = rhs` | an equation, where one is asked for |
//!
//! There are no comparisons and no `if`, `min`, `max`, `abs`: they have no derivative at their kinks.
//!
//! This module knows no membrane. Nothing in it panics on any text; length and nesting are limited ([`MAX_LENGTH`],
//! [`MAX_DEPTH`]), and a chain of operators of any length needs neither stack nor more than linear time.

mod error;
mod lex;
mod parse;
mod tape;
mod tree;

#[cfg(test)]
mod tests;

pub use error::{CODES, ExprError, nearest};
pub use parse::{MAX_DEPTH, MAX_LENGTH, parse, parse_equation};
pub use tape::{Builder, Node, Scope, Tape, constant};
pub use tree::{
    Argument, Expr, Function, Operator, Part, Term, Unit, UnitKind, has_meaning, is_identifier, is_reserved,
};
