use super::{Energy, first_invariant};
use crate::expr::Tape;
use crate::scalar::{Jet, Scalar};

/// An energy that a problem file writes itself, as a formula of lambda and mu.
///
/// Counted from the reference state: its value at (1, 1) is taken off.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    tape: Tape,
    reference: f64,
    locking: Option<f64>,
    /// Below this an energy that locks lies behind its pole.
    least: f64,
}

impl Written {
    /// Equal stretches up to which the end of an energy is sought.
    const MOST: f64 = 1e3;
    /// An energy that ends above this overflows; below it, it locks.
    const OVERFLOW: f64 = 1e100;

    /// The energy of a tape with one output; its inputs are lambda (slot 0) and mu (slot 1).
    pub fn new(tape: Tape) -> Self {
        let reference = tape.value([1.0, 1.0]);
        let mut law = Written { tape, reference, locking: None, least: f64::NEG_INFINITY };
        law.locking = law.end();
        if law.locking.is_some() {
            law.least = -law.energy(1.01, 1.01).abs();
        }
        law
    }

    /// I1 - 3 where the energy ends at equal stretches, other than by overflow: it is finite no more, or falls through a pole.
    fn end(&self) -> Option<f64> {
        let energy = |s: f64| self.energy(s, s);
        let rises = |s: f64| {
            let [_, l, m, ..] = self.energy(Jet::<6>::x(s), Jet::y(s)).derivatives();
            l + m > 0.0
        };
        let beyond = |a: f64, b: f64| !energy(b).is_finite() || (energy(b) < energy(a) && rises(a) && rises(b));
        let (mut a, mut b) = (1.0, 1.01);
        while !beyond(a, b) {
            (a, b) = (b, 1.01 * b);
            if b > Written::MOST {
                return None;
            }
        }
        for _ in 0..60 {
            let m = 0.5 * (a + b);
            if beyond(a, m) { b = m } else { a = m }
        }
        (a > 1.0 && energy(a).abs() < Written::OVERFLOW).then(|| first_invariant(a, a) - 3.0)
    }
}

impl Energy for Written {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let w = self.tape.value([lambda, mu]) - self.reference;
        if w.value() < self.least { S::from(f64::NAN) } else { w }
    }

    fn locking(&self) -> Option<f64> {
        self.locking
    }
}
