use super::{Energy, first_invariant};
use crate::scalar::Scalar;

/// Neo-Hookean sheet, w = G/2 (I1 - 3).
#[derive(Clone, Debug, PartialEq)]
pub struct NeoHookean {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
}

impl Energy for NeoHookean {
    #[inline(always)]
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        (first_invariant(lambda, mu) - 3.0) * (0.5 * self.shear_modulus)
    }
}
