use super::{Energy, first_invariant};
use crate::scalar::Scalar;

/// Yeoh's law, w = sum of C_n (I1 - 3)^n (Yeoh, 1990); G = 2 C_1.
#[derive(Clone, Debug, PartialEq)]
pub struct Yeoh {
    /// C_1, C_2, ..
    pub factors: Vec<f64>,
}

impl Energy for Yeoh {
    fn energy<S: Scalar>(&self, lambda: S, mu: S) -> S {
        let strain = first_invariant(lambda, mu) - 3.0;
        self.factors.iter().rev().fold(S::from(0.0), |sum, c| (sum + *c) * strain)
    }
}
