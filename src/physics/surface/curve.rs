use super::{Generator, search};
use crate::expr::Tape;
use crate::scalar::Scalar;
use std::sync::Arc;

/// A generator by formulas.
#[derive(Clone, Debug)]
pub struct Curve {
    /// One output d over the input u, or two outputs u and d over the input t.
    tape: Arc<Tape>,
    /// The formulas' parameter at t = 0.
    from: f64,
    /// 1 where it grows with t, else -1.
    sense: f64,
    length: f64,
    axial: bool,
}

impl PartialEq for Curve {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.tape, &other.tape) && self.from == other.from && self.length == other.length
    }
}

impl Curve {
    /// The surface d(u): a tape of one output over the input u. The depth on the axis is left out.
    pub fn profile(tape: Tape) -> Self {
        Curve { tape: Arc::new(tape), from: 0.0, sense: 1.0, length: f64::INFINITY, axial: true }
    }

    /// The face u(t), d(t) for t between two values: a tape of two outputs over the input t.
    pub fn new(tape: Tape, from: f64, to: f64) -> Self {
        let mut curve =
            Curve { tape: Arc::new(tape), from, sense: (to - from).signum(), length: (to - from).abs(), axial: false };
        curve.axial = curve.point(0.0_f64)[0].abs() < 1e-14;
        curve
    }
}

impl Generator for Curve {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        let mut work = vec![];
        let t = t * self.sense + self.from;
        if self.tape.outputs() == 1 {
            let mut out = [S::from(0.0)];
            self.tape.eval(&[t], &mut work, &mut out);
            return [t, out[0]];
        }
        let mut out = [S::from(0.0); 2];
        self.tape.eval(&[t], &mut work, &mut out);
        out
    }
    fn axial(&self) -> bool {
        self.axial
    }
    fn at_radius(&self, u: f64) -> Option<f64> {
        if self.tape.outputs() == 1 { Some(u) } else { search(self, u) }
    }
    fn end(&self) -> f64 {
        self.length
    }
    fn straight(&self) -> f64 {
        // Where the slope has changed by half of a right angle's tangent.
        let slope = |t: f64| self.frame(t, 1.0).angle;
        let first = slope(0.0);
        let mut t = 1e-6;
        while t < 1e3 && t < self.length && (slope(t) - first).abs() < 0.5 {
            t *= 1.1;
        }
        t
    }
}
