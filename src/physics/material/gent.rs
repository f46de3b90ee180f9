use super::{Energy, first_invariant};
use crate::scalar::Scalar;

/// Gent's law of limited extensibility, w = -(G Jm/2) ln(1 - (I1 - 3)/Jm) (Gent, 1996). Infinite at I1 - 3 = Jm.
#[derive(Clone, Debug, PartialEq)]
pub struct Gent {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
    /// Locking value Jm of I1 - 3.
    pub locking: f64,
}

impl Energy for Gent {
    #[inline(always)]
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let gap = (first_invariant(lambda, mu) - 3.0) * (-1.0 / self.locking) + 1.0;
        gap.ln() * (-0.5 * self.shear_modulus * self.locking)
    }

    fn locking(&self) -> Option<f64> {
        Some(self.locking)
    }
}
