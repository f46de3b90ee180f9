//! Rigid surfaces. A surface answers one question: how deep are you at radius u?
//!
//! `depth(u)` is the distance behind the point on the axis (the apex), along the axis, into the body; a plane has depth 0. Tangents
//! and volumes follow from it.

mod cone;
mod plane;

pub use cone::Cone;
pub use plane::Plane;

use crate::scalar::Scalar;
use std::f64::consts::PI;

/// The one question, and its derivative and integral in closed form.
pub trait Profile {
    /// Depth d(u).
    fn depth<S: Scalar>(&self, u: S) -> S;

    /// Slope d'(u).
    fn slope<S: Scalar>(&self, u: S) -> S;

    /// Volume between the surface and the plane through the apex, integral of pi u^2 d'(u) du from 0 to u.
    fn volume<S: Scalar>(&self, u: S) -> S;
}

macro_rules! surfaces {
    ($($name:ident),+ $(,)?) => {
        /// The surfaces, a closed set.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Surface {
            $(
                #[doc = concat!("See [`", stringify!($name), "`].")]
                $name($name),
            )+
        }

        impl Profile for Surface {
            #[inline(always)]
            fn depth<S: Scalar>(&self, u: S) -> S {
                match self { $(Surface::$name(s) => s.depth(u),)+ }
            }
            #[inline(always)]
            fn slope<S: Scalar>(&self, u: S) -> S {
                match self { $(Surface::$name(s) => s.slope(u),)+ }
            }
            fn volume<S: Scalar>(&self, u: S) -> S {
                match self { $(Surface::$name(s) => s.volume(u),)+ }
            }
        }

        $(
            impl From<$name> for Surface {
                fn from(s: $name) -> Surface { Surface::$name(s) }
            }
        )+
    };
}

surfaces!(Plane, Cone);

/// The side of a rigid body on which the membrane lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Solid above, membrane below.
    Down,
    /// Solid below, membrane above.
    Up,
}

/// Where a membrane lies on a surface: the surface, its side, and the direction in which the meridian is walked along it.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// The surface.
    pub surface: Surface,
    /// The side.
    pub facing: Facing,
    /// Factor on all depths: 1 is the surface itself, 0 a plane. A first contact is found on the plane and raised from there.
    pub rise: f64,
}

impl Face {
    /// Tangent angle tau of the meridian at radius u.
    ///
    /// On a face looking down the meridian runs outwards, h = apex - d(u), tau = -atan d'. On a face looking up it runs
    /// inwards, h = apex + d(u), tau = pi + atan d'.
    #[inline(always)]
    pub fn tangent<S: Scalar>(&self, u: S) -> S {
        let angle = (self.surface.slope(u) * self.rise).atan();
        match self.facing {
            Facing::Down => -angle,
            Facing::Up => angle + PI,
        }
    }

    /// Position below the apex at radius u: h - h(apex).
    pub fn drop<S: Scalar>(&self, u: S) -> S {
        match self.facing {
            Facing::Down => -(self.surface.depth(u) * self.rise),
            Facing::Up => self.surface.depth(u) * self.rise,
        }
    }

    /// Integral of pi u^2 dh along the walk from radius `from` to radius `to`.
    pub fn swept_volume<S: Scalar>(&self, from: S, to: S) -> S {
        let v = (self.surface.volume(to) - self.surface.volume(from)) * self.rise;
        match self.facing {
            Facing::Down => -v,
            Facing::Up => v,
        }
    }

    /// The inclination at the axis, in radians; not zero on a tip.
    pub fn tip_inclination(&self) -> f64 {
        (self.surface.slope(0.0_f64) * self.rise).atan()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    #[test]
    fn slopes_and_volumes_are_the_derivative_and_the_integral_of_the_depth() {
        let all: Vec<Surface> = vec![Plane.into(), Cone { inclination: 0.7 }.into()];
        for s in all {
            let u = Dual::<1>::variable(0.8, 0);
            assert_relative_eq!(s.depth(u).du[0], s.slope(0.8), max_relative = 1e-14);
            assert_relative_eq!(s.volume(u).du[0], PI * 0.64 * s.slope(0.8), max_relative = 1e-14);
            assert_eq!(s.depth(0.0), 0.0);
            assert_eq!(s.volume(0.0), 0.0);
        }
    }
}
