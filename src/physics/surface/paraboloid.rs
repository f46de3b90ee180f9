use super::{Frame, Generator};
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A paraboloid d = u^2/(2 radius), t = u.
#[derive(Clone, Debug, PartialEq)]
pub struct Paraboloid {
    /// Radius of curvature at the apex.
    pub radius: f64,
}

impl Generator for Paraboloid {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        [t, t * t / (2.0 * self.radius)]
    }
    fn straight(&self) -> f64 {
        self.radius
    }
    fn at_radius(&self, u: f64) -> Option<f64> {
        Some(u)
    }
    #[inline(always)]
    fn ratio<S: Scalar>(&self, _: S) -> S {
        S::from(1.0)
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, t: S, depth: f64) -> Frame<S> {
        let slope = t * (depth / self.radius);
        let square = slope * slope + 1.0;
        Frame { angle: slope.atan(), speed: square.sqrt(), bend: square.recip() * (depth / self.radius) }
    }
    fn volume<S: Scalar>(&self, t: S) -> S {
        let q = t * t;
        q * q * (PI / (4.0 * self.radius))
    }
}
