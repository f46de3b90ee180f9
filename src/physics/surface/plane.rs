use super::Profile;
use crate::scalar::Scalar;

/// A horizontal plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane;

impl Profile for Plane {
    #[inline(always)]
    fn depth<S: Scalar>(&self, _: S) -> S {
        S::from(0.0)
    }
    #[inline(always)]
    fn slope<S: Scalar>(&self, _: S) -> S {
        S::from(0.0)
    }
    fn volume<S: Scalar>(&self, _: S) -> S {
        S::from(0.0)
    }
}
