//! The tree of a formula, every part with its place in the text.

use super::error::ExprError;
use super::parse::parse;
use crate::scalar::Scalar;
use std::f64::consts::PI;
use std::ops::Range;
use std::str::FromStr;

/// A formula as it was written.
///
/// The tree is kept as a list in which every part stands behind its own operands and the whole comes last: work on it is
/// a loop over [`Expr::parts`], never a recursion, however long the formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    parts: Vec<Part>,
}

/// A part of a formula.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// What it is.
    pub term: Term,
    /// Its place in the text, in bytes; without the parentheses around it.
    pub span: Range<usize>,
}

/// What a part of a formula is. Operands are indices into [`Expr::parts`], smaller than that of the part itself.
#[derive(Clone, Debug, PartialEq)]
pub enum Term {
    /// A number as written: of `40[deg]` the value is 40.
    Number {
        /// The number in front of the unit.
        value: f64,
        /// The unit behind it.
        unit: Option<Box<Unit>>,
    },
    /// The constant `pi`.
    Pi,
    /// A name, with its dots.
    Name(String),
    /// The operand with the opposite sign.
    Negative(usize),
    /// Two operands, left and right.
    Binary(Operator, usize, usize),
    /// A function of one operand.
    Function(Function, usize),
    /// A call of a dotted name. The name stands at the start of the span of the part.
    Call {
        /// The name, with its dots.
        name: String,
        /// What stands between the parentheses.
        arguments: Vec<Argument>,
    },
}

/// An argument of a call of a dotted name.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// The name in `name = value`.
    pub name: Option<String>,
    /// The value, a formula of its own; its places count in the text of the whole.
    pub value: Expr,
    /// The place of the argument, including its name.
    pub span: Range<usize>,
}

/// The unit of a number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Which unit it is, as far as this module knows.
    pub kind: UnitKind,
    /// The text between the brackets.
    pub text: String,
    /// The place of that text.
    pub span: Range<usize>,
}

/// The units that the language itself knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnitKind {
    /// `deg`.
    Degree,
    /// `rad`.
    Radian,
    /// Any other; its meaning is up to the [`Scope`](super::Scope).
    Other,
}

impl Unit {
    pub(super) fn new(text: &str, span: Range<usize>) -> Self {
        let kind = match text {
            "deg" => UnitKind::Degree,
            "rad" => UnitKind::Radian,
            _ => UnitKind::Other,
        };
        Unit { kind, text: text.to_owned(), span }
    }

    /// `value` of this unit in radians, if it is a unit of angle.
    ///
    /// 45, 90 and 180 degrees yield exactly the doubles pi/4, pi/2 and pi.
    pub fn to_radians(&self, value: f64) -> Option<f64> {
        match self.kind {
            UnitKind::Degree => Some(value / 180.0 * PI),
            UnitKind::Radian => Some(value),
            UnitKind::Other => None,
        }
    }

    /// An angle in radians in this unit, if it is a unit of angle.
    pub fn from_radians(&self, angle: f64) -> Option<f64> {
        match self.kind {
            UnitKind::Degree => Some(angle / PI * 180.0),
            UnitKind::Radian => Some(angle),
            UnitKind::Other => None,
        }
    }
}

/// An operator between two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `^`
    Power,
}

/// A function of one variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)] // the names say it
pub enum Function {
    Sqrt,
    Exp,
    Ln,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
}

impl Function {
    /// All functions of the language.
    pub const ALL: [Function; 12] = [
        Function::Sqrt,
        Function::Exp,
        Function::Ln,
        Function::Sin,
        Function::Cos,
        Function::Tan,
        Function::Asin,
        Function::Acos,
        Function::Atan,
        Function::Sinh,
        Function::Cosh,
        Function::Tanh,
    ];

    /// The function that is written `name`.
    pub fn named(name: &str) -> Option<Self> {
        Function::ALL.into_iter().find(|f| f.name() == name)
    }

    /// How it is written.
    pub fn name(self) -> &'static str {
        match self {
            Function::Sqrt => "sqrt",
            Function::Exp => "exp",
            Function::Ln => "ln",
            Function::Sin => "sin",
            Function::Cos => "cos",
            Function::Tan => "tan",
            Function::Asin => "asin",
            Function::Acos => "acos",
            Function::Atan => "atan",
            Function::Sinh => "sinh",
            Function::Cosh => "cosh",
            Function::Tanh => "tanh",
        }
    }

    /// Its value at `x`, with the derivatives that `x` carries.
    #[inline(always)]
    pub fn apply<S: Scalar>(self, x: S) -> S {
        match self {
            Function::Sqrt => x.sqrt(),
            Function::Exp => x.exp(),
            Function::Ln => x.ln(),
            Function::Sin => x.sin(),
            Function::Cos => x.cos(),
            Function::Tan => x.tan(),
            Function::Asin => x.asin(),
            Function::Acos => x.acos(),
            Function::Atan => x.atan(),
            Function::Sinh => x.sinh(),
            Function::Cosh => x.cosh(),
            Function::Tanh => x.tanh(),
        }
    }
}

impl Expr {
    /// The formula made of `parts`, which the parser has put in order.
    pub(super) fn new(parts: Vec<Part>) -> Self {
        debug_assert!(!parts.is_empty());
        Expr { parts }
    }

    /// All parts, every one behind its operands; the last is the whole. There is at least one.
    ///
    /// The arguments of calls are formulas of their own and not among these.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The place of the formula in the text.
    pub fn span(&self) -> Range<usize> {
        self.parts.last().map_or(0..0, |p| p.span.clone())
    }

    /// The number and unit as written, if the formula is nothing but a number, a sign in front allowed.
    ///
    /// `-40[deg]` is -40 with the unit `deg`.
    pub fn literal(&self) -> Option<(f64, Option<&Unit>)> {
        let mut sign = 1.0;
        for (i, part) in self.parts.iter().enumerate().rev() {
            match &part.term {
                Term::Negative(operand) if *operand + 1 == i => sign = -sign,
                Term::Number { value, unit } => return Some((sign * value, unit.as_deref())),
                _ => return None,
            }
        }
        None
    }

    /// The name, if the formula is nothing but a name.
    pub fn as_name(&self) -> Option<&str> {
        match self.parts.as_slice() {
            [Part { term: Term::Name(name), .. }] => Some(name),
            _ => None,
        }
    }

    /// Every use of a name in the order of the text, with its place: names, called names, and those in arguments.
    ///
    /// The names of named arguments are not uses.
    pub fn names(&self) -> Vec<(&str, Range<usize>)> {
        let mut found = Vec::new();
        self.collect_names(&mut found);
        found
    }

    // The recursion is as deep as calls are nested, which the parser limits.
    fn collect_names<'a>(&'a self, found: &mut Vec<(&'a str, Range<usize>)>) {
        for Part { term, span } in &self.parts {
            match term {
                Term::Name(name) => found.push((name, span.clone())),
                Term::Call { name, arguments } => {
                    found.push((name, span.start..span.start + name.len()));
                    arguments.iter().for_each(|a| a.value.collect_names(found));
                }
                _ => {}
            }
        }
    }

    /// Every unit in the order of the text, those in arguments included.
    pub fn units(&self) -> Vec<&Unit> {
        let mut found = Vec::new();
        self.collect_units(&mut found);
        found
    }

    fn collect_units<'a>(&'a self, found: &mut Vec<&'a Unit>) {
        for part in &self.parts {
            match &part.term {
                Term::Number { unit, .. } => found.extend(unit.as_deref()),
                Term::Call { arguments, .. } => arguments.iter().for_each(|a| a.value.collect_units(found)),
                _ => {}
            }
        }
    }
}

impl FromStr for Expr {
    type Err = ExprError;

    fn from_str(text: &str) -> Result<Self, ExprError> {
        parse(text)
    }
}

/// Whether `text` can be a name without dots in a formula; reserved words can.
pub fn is_identifier(text: &str) -> bool {
    let mut bytes = text.bytes();
    bytes.next().is_some_and(|b| b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

/// Whether the language itself gives `name` a meaning (`pi`, a function) or refuses it (`if`), so that nobody may declare it.
pub fn is_reserved(name: &str) -> bool {
    has_meaning(name) || super::parse::refused(name).is_some()
}

/// Whether the language itself gives `name` a meaning. What it only refuses when called, such as `floor`, may still name a body, whose
/// name is never called.
pub fn has_meaning(name: &str) -> bool {
    name == "pi" || Function::named(name).is_some()
}
