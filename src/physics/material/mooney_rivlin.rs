use super::{Energy, first_invariant};
use crate::scalar::Scalar;

/// Mooney-Rivlin sheet, w = C1 (I1 - 3) + C2 (I2 - 3), I2 = lambda^-2 + mu^-2 + (lambda mu)^2; G = 2 (C1 + C2).
#[derive(Clone, Debug, PartialEq)]
pub struct MooneyRivlin {
    /// Constant of the first invariant.
    pub c1: f64,
    /// Constant of the second invariant.
    pub c2: f64,
}

impl Energy for MooneyRivlin {
    #[inline(always)]
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let second_invariant = first_invariant(lambda.recip(), mu.recip());
        (first_invariant(lambda, mu) - 3.0) * self.c1 + (second_invariant - 3.0) * self.c2
    }
}
