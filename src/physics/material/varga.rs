use super::Energy;
use crate::scalar::Scalar;

/// Varga's law, w = 2 G (lambda + mu + 1/(lambda mu) - 3) (Varga, 1966). It grows linearly: no tension exceeds 2 G.
#[derive(Clone, Debug, PartialEq)]
pub struct Varga {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
}

impl Energy for Varga {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        (lambda + mu + (lambda * mu).recip() - 3.0) * (2.0 * self.shear_modulus)
    }
}
