use super::Energy;
use crate::scalar::Scalar;

/// Skalak's law for cell membranes, w = G/4 (I1^2 + 2 I1 - 2 I2 + C I2^2), with I1 = lambda^2 + mu^2 - 2 and
/// I2 = lambda^2 mu^2 - 1 (Skalak, Tozeren, Zarda and Chien, 1973); surface Poisson ratio C/(1 + C).
#[derive(Clone, Debug, PartialEq)]
pub struct Skalak {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
    /// Area dilatation constant C.
    pub area_ratio: f64,
}

impl Energy for Skalak {
    #[inline(always)]
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let (l2, m2) = (lambda * lambda, mu * mu);
        let (i1, i2) = (l2 + m2 - 2.0, l2 * m2 - 1.0);
        (i1 * i1 + (i1 - i2) * 2.0 + i2 * i2 * self.area_ratio) * (0.25 * self.shear_modulus)
    }
}
