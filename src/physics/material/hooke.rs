use super::Energy;
use crate::scalar::Scalar;

/// Hooke's law in the stretches, w = E/(2 (1 - nu^2)) (e1^2 + 2 nu e1 e2 + e2^2), e1 = lambda - 1, e2 = mu - 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Hooke {
    /// Surface Young modulus E.
    pub young_modulus: f64,
    /// Surface Poisson ratio nu, between -1 and 1.
    pub poisson_ratio: f64,
}

impl Energy for Hooke {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let (e1, e2, nu) = (lambda - 1.0, mu - 1.0, self.poisson_ratio);
        (e1 * e1 + e1 * e2 * (2.0 * nu) + e2 * e2) * (0.5 * self.young_modulus / (1.0 - nu * nu))
    }
}
