use super::Profile;
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A cone with its tip on the axis, d = u tan(inclination).
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    /// Angle of the generator from the horizontal, radians; 0 is flat.
    pub inclination: f64,
}

impl Profile for Cone {
    #[inline(always)]
    fn depth<S: Scalar>(&self, u: S) -> S {
        u * self.inclination.tan()
    }
    #[inline(always)]
    fn slope<S: Scalar>(&self, _: S) -> S {
        S::from(self.inclination.tan())
    }
    fn volume<S: Scalar>(&self, u: S) -> S {
        u * u * u * (PI / 3.0 * self.inclination.tan())
    }
}
