use super::{Energy, first_invariant};
use crate::scalar::Scalar;

/// An isotropic exponential law of Fung's kind, w = G/(2 b) (exp(b (I1 - 3)) - 1) (Demiray, 1972).
#[derive(Clone, Debug, PartialEq)]
pub struct Fung {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
    /// Factor b in the exponent.
    pub exponent: f64,
}

impl Energy for Fung {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let x = (first_invariant(lambda, mu) - 3.0) * self.exponent;
        let e = x.value().exp();
        // exp(x) - 1 without the cancellation at small x.
        x.compose([x.value().exp_m1(), e, e, e]) * (0.5 * self.shear_modulus / self.exponent)
    }
}
