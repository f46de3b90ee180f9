use super::{Frame, Generator};
use crate::scalar::Scalar;
use std::f64::consts::{FRAC_PI_2, PI};

/// The side of a bar or tube about the axis, t = d.
#[derive(Clone, Debug, PartialEq)]
pub struct Cylinder {
    /// Its radius.
    pub radius: f64,
}

impl Generator for Cylinder {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        [S::from(self.radius), t]
    }
    fn axial(&self) -> bool {
        false
    }
    fn at_radius(&self, _: f64) -> Option<f64> {
        None
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, _: S, depth: f64) -> Frame<S> {
        Frame { angle: S::from(FRAC_PI_2 * depth.signum()), speed: S::from(depth.abs()), bend: S::from(0.0) }
    }
    fn volume<S: Scalar>(&self, t: S) -> S {
        t * (PI * self.radius * self.radius)
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t
    }
}
