use super::{Energy, first_invariant};
use crate::expr::Tape;
use crate::scalar::Scalar;

/// An energy that a problem file writes itself, as a formula of lambda and mu.
///
/// Counted from the reference state: its value at (1, 1) is taken off.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    tape: Tape,
    reference: f64,
    locking: Option<f64>,
}

impl Written {
    /// Equal stretches up to which the end of an energy is sought.
    const MOST: f64 = 1e3;
    /// An energy that ends above this overflows; below it, it locks.
    const OVERFLOW: f64 = 1e100;

    /// The energy of a tape with one output; its inputs are lambda (slot 0) and mu (slot 1).
    pub fn new(tape: Tape) -> Self {
        let reference = tape.value([1.0, 1.0]);
        let mut law = Written { tape, reference, locking: None };
        law.locking = law.end();
        law
    }

    /// I1 - 3 where the energy ceases to be finite at equal stretches, other than by overflow.
    fn end(&self) -> Option<f64> {
        let energy = |s: f64| self.energy(s, s);
        let (mut a, mut b) = (1.0, 1.0);
        while energy(b).is_finite() {
            (a, b) = (b, 1.1 * b);
            if b > Written::MOST {
                return None;
            }
        }
        for _ in 0..60 {
            let m = 0.5 * (a + b);
            if energy(m).is_finite() { a = m } else { b = m }
        }
        (a > 1.0 && energy(a).abs() < Written::OVERFLOW).then(|| first_invariant(a, a) - 3.0)
    }
}

impl Energy for Written {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        self.tape.value([lambda, mu]) - self.reference
    }

    fn locking(&self) -> Option<f64> {
        self.locking
    }
}
