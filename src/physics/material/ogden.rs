use super::Energy;
use crate::scalar::Scalar;

/// Ogden's law, w = sum of 2 G_i/a_i^2 (lambda^a_i + mu^a_i + (lambda mu)^-a_i - 3) (Ogden, 1972); G = sum of G_i.
///
/// The factor is that of Ogden's constants mu_i with G_i = mu_i a_i/2, so that each term adds its G_i to the shear modulus.
#[derive(Clone, Debug, PartialEq)]
pub struct Ogden {
    /// The terms: part G_i of the shear modulus, and exponent a_i, not zero.
    pub terms: Vec<(f64, f64)>,
}

impl Energy for Ogden {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        self.terms.iter().fold(S::from(0.0), |sum, &(g, a)| {
            let (l, m) = (lambda.powf(a), mu.powf(a));
            sum + (l + m + (l * m).recip() - 3.0) * (2.0 * g / (a * a))
        })
    }
}
