use super::Energy;
use crate::scalar::Scalar;

/// The law of Evans and Skalak for lipid membranes with a skeleton, w = K/2 (J - 1)^2 + G ((lambda^2 + mu^2)/(2 J) - 1),
/// J = lambda mu (Evans and Skalak, 1980): area and shape are resisted apart, shape by no more than G times a ratio of stretches.
#[derive(Clone, Debug, PartialEq)]
pub struct EvansSkalak {
    /// Surface shear modulus G.
    pub shear_modulus: f64,
    /// Area dilatation modulus K.
    pub area_modulus: f64,
}

impl Energy for EvansSkalak {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let (dilatation, ratio) = (lambda * mu - 1.0, lambda / mu);
        dilatation * dilatation * (0.5 * self.area_modulus) + ((ratio + ratio.recip()) * 0.5 - 1.0) * self.shear_modulus
    }
}
