use super::{Frame, Generator};
use crate::scalar::Scalar;

/// A horizontal plane, t = u.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane;

impl Generator for Plane {
    fn point<S: Scalar>(&self, t: S) -> [S; 2] {
        [t, S::from(0.0)]
    }
    fn at_radius(&self, u: f64) -> Option<f64> {
        Some(u)
    }
    #[inline(always)]
    fn ratio<S: Scalar>(&self, _: S) -> S {
        S::from(1.0)
    }
    #[inline(always)]
    fn frame<S: Scalar>(&self, _: S, _: f64) -> Frame<S> {
        Frame { angle: S::from(0.0), speed: S::from(1.0), bend: S::from(0.0) }
    }
    fn volume<S: Scalar>(&self, _: S) -> S {
        S::from(0.0)
    }
    fn length<S: Scalar>(&self, t: S) -> S {
        t
    }
}
