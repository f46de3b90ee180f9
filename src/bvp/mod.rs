//! Boundary-value problems on several segments, by Gauss collocation.
//!
//! The unknowns are, for each segment s, functions y_s(x) on [0, 1] and, for all together, the globals P (free ends, pressures,
//! continuation parameters):
//!
//! ```text
//! dy_s/dx = f_s(x, y_s, P)                      on each segment, n_s states                          (1)
//! Q_s     = integral of g_s(x, y_s, P) dx       quadratures of a segment, q_s coupled ones           (2)
//! B_i(y_1(0), y_1(1), Q_1, y_2(0), ..., P) = 0  i = 1 .. sum of n_s + number of globals              (3)
//! ```
//!
//! The arguments of (3) form the vector of *slots* ([`Layout`]): few numbers, through which all segments and all conditions talk
//! to each other. Everything inside a segment is eliminated first: the stages of an interval against its left end and P (LU), the
//! chain of intervals against the two ends and P (orthogonally), and a dense system in the slots remains, the *matching system*.
//! Its rank is the rank of the problem.
//!
//! This module knows no membrane. It is tested on textbook problems of its own (`textbook.rs`).

mod assembly;
mod dense;
mod discretization;
mod estimate;
mod gauss;
mod local;
mod newton;
mod refine;
#[cfg(test)]
mod textbook;

pub use assembly::{Linearization, Residual, Singular, matching, residual};
pub use discretization::{Discretization, State};
pub use estimate::quadratures_along;
pub use estimate::{Estimate, rounding};
pub use gauss::Gauss;
pub use local::value_at;
pub use newton::{Effort, Failure, Newton};
pub use refine::{equidistribute, uniform};

use crate::scalar::Scalar;

/// What a segment consists of.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Number of states n_s of (1).
    pub states: usize,
    /// Number of quadratures that conditions may use, q_s of (2).
    pub coupled: usize,
    /// Number of further quadratures, which are only reported.
    pub reported: usize,
    /// The globals that f_s and g_s depend on, as indices into P.
    pub parameters: Vec<usize>,
}

/// The slots: where each argument of the conditions stands in their vector.
///
/// Order: for each segment y(0), y(1), Q (coupled ones); then the globals.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// The segments in order.
    pub segments: Vec<Segment>,
    /// Number of globals.
    pub globals: usize,
}

impl Layout {
    fn before(&self, segment: usize) -> usize {
        self.segments[..segment].iter().map(|s| 2 * s.states + s.coupled).sum()
    }

    /// First slot of y(0) of a segment.
    pub fn start(&self, segment: usize) -> usize {
        self.before(segment)
    }

    /// First slot of y(1) of a segment.
    pub fn end(&self, segment: usize) -> usize {
        self.before(segment) + self.segments[segment].states
    }

    /// First slot of the coupled quadratures of a segment.
    pub fn quadratures(&self, segment: usize) -> usize {
        self.before(segment) + 2 * self.segments[segment].states
    }

    /// Slot of global `i`.
    pub fn global(&self, i: usize) -> usize {
        self.before(self.segments.len()) + i
    }

    /// Number of slots.
    pub fn slots(&self) -> usize {
        self.global(self.globals)
    }

    /// Number of conditions that a closed problem has: one for each state and each global.
    pub fn conditions(&self) -> usize {
        self.segments.iter().map(|s| s.states).sum::<usize>() + self.globals
    }
}

/// A boundary-value problem (1) to (3). Derivatives come from evaluating the same functions on numbers that carry them.
pub trait Problem {
    /// Segments and globals.
    fn layout(&self) -> &Layout;

    /// f and g of segment `segment` at `x`: `out` receives f (n values) and then as many quadratures, in order, as it has room for.
    ///
    /// `y` has the n states, `p` the globals named by [`Segment::parameters`], in that order. Never called at x = 0 or x = 1.
    fn flow<S: Scalar>(&self, segment: usize, x: f64, y: &[S], p: &[S], out: &mut [S]);

    /// The slots that condition `i` depends on.
    fn condition_slots(&self, i: usize) -> &[usize];

    /// B_i, given the values of its slots in the order of [`Problem::condition_slots`].
    fn condition<S: Scalar>(&self, i: usize, slots: &[S]) -> S;

    /// The magnitude against which a change of state `i` of a segment is measured (Newton, mesh); 1 for logarithms and angles.
    fn state_scale(&self, _segment: usize, _state: usize) -> f64 {
        1.0
    }

    /// The rounding error that one evaluation of f makes at `x`: the size of the terms that cancel in it, times the machine epsilon.
    fn noise(&self, _segment: usize, _x: f64) -> f64 {
        f64::EPSILON
    }

    /// What given data that the scheme does not resolve in an interval may change of a state across it: an estimate from above of the
    /// error that the interval adds, of first order in its width.
    fn unresolved(&self, _segment: usize, _interval: usize) -> f64 {
        0.0
    }

    /// The magnitude against which a change of global `i` is measured, given its value.
    fn global_scale(&self, _global: usize, value: f64) -> f64 {
        value.abs().max(1.0)
    }
}
