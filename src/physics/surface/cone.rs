use super::{Frame, Generator};
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A cone with its tip on the axis, d = u tan(inclination), t = u.
#[derive(Clone, Debug, PartialEq)]
pub struct Cone {
    /// Angle of the generator from the horizontal, radians; 0 is flat.
    pub inclination: f64,
}

impl Generator for Cone {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        [t, t * self.inclination.tan()]
    }
    fn at_radius(&self, u: f64) -> Option<f64> {
        Some(u)
    }
    #[inline(always)]
    fn ratio<S: Scalar>(&self, _: S) -> S {
        S::from(1.0)
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, _: S, depth: f64) -> Frame<S> {
        let angle = (self.inclination.tan() * depth).atan();
        Frame { angle: S::from(angle), speed: S::from(1.0 / angle.cos()), bend: S::from(0.0) }
    }
    fn volume<S: Scalar>(&self, t: S) -> S {
        t * t * t * (PI / 3.0 * self.inclination.tan())
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t / self.inclination.cos()
    }
}
