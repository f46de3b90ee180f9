//! How the unit interval of a piece lies on the reference meridian.
//!
//! ```text
//! Between      eta = a + (b - a) x            a piece between two places
//! FromPole     eta = b + ln(x) / order        a piece that starts at a pole: order 2 where all states are even functions of
//!                                             the distance from it (contact), so that tan^2(phi/2) is the variable; 1 else
//! FromTip      eta = b - L (1 - x)            a piece that starts at the tip of a cone, cut where nothing is left to see
//! PoleToPole   eta = ln tan(pi x / 2)         the whole meridian, phi the variable
//! ```
//!
//! and the mirror images `ToPole`, `ToTip`. The pole itself is a mesh point (x = 0 or 1), with no cut-off: Gauss nodes never lie
//! there, and the solution is a regular function of x.

use super::Side;
use crate::physics::material::{Energy, Law};
use crate::scalar::Scalar;
use std::f64::consts::PI;

/// Length in eta of the piece of a cone's surface that is resolved around its tip.
///
/// What a solution starts with wrongly at its inner end decays outwards as exp(-2 cos(a) eta) or faster, and from the middle of
/// the piece inwards the reference shape is flat to exp(-L). A law that locks comes ever nearer to locking towards the tip, by
/// phi^(sin^2 a) for Gent's; the piece ends before rounding hides what is left.
pub fn tip_length(law: &Law, inclination: f64) -> f64 {
    const LENGTH: f64 = 40.0;
    const LEAST_GAP: f64 = 11.5; // exp(-11.5), a hundred-thousandth
    match law.locking() {
        Some(_) => LENGTH.min(LEAST_GAP / inclination.sin().powi(2)),
        None => LENGTH,
    }
}

/// A place on the meridian, by its eta.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A pole (or a tip).
    Pole,
    /// A known place.
    Fixed(f64),
    /// An unknown place: the index of its global.
    Unknown(usize),
}

/// The map from x to eta.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coordinate {
    /// Between two places.
    Between,
    /// From a pole, with the order of evenness.
    FromPole(f64),
    /// To a pole.
    ToPole(f64),
    /// From the tip of a cone, over a length in eta.
    FromTip(f64),
    /// To the tip of a cone.
    ToTip(f64),
    /// From pole to pole.
    PoleToPole,
}

impl Coordinate {
    /// True where that end is a pole, not a tip and not a place.
    pub fn is_pole(&self, side: Side) -> bool {
        matches!(
            (self, side),
            (Coordinate::FromPole(_) | Coordinate::PoleToPole, Side::Start)
                | (Coordinate::ToPole(_) | Coordinate::PoleToPole, Side::End)
        )
    }

    /// eta and d eta/dx at `x`, with `a` and `b` the eta of the two ends (unused where that end is a pole).
    #[inline(always)]
    pub fn at<S: Scalar>(&self, x: f64, a: S, b: S) -> (S, S) {
        match *self {
            Coordinate::Between => (a + (b - a) * x, b - a),
            Coordinate::FromPole(order) => (b + x.ln() / order, S::from(1.0 / (order * x))),
            Coordinate::ToPole(order) => (a - (1.0 - x).ln() / order, S::from(1.0 / (order * (1.0 - x)))),
            Coordinate::FromTip(length) => (b - length * (1.0 - x), S::from(length)),
            Coordinate::ToTip(length) => (a + length * x, S::from(length)),
            Coordinate::PoleToPole => (S::from((0.5 * PI * x).tan().ln()), S::from(PI / (PI * x).sin())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    #[test]
    fn slopes_are_derivatives_and_ends_are_met() {
        use Coordinate::*;
        for c in
            [Between, FromPole(1.0), FromPole(2.0), ToPole(1.0), ToPole(2.0), FromTip(20.0), ToTip(20.0), PoleToPole]
        {
            let at = |x: f64| c.at(x, -0.4, 0.9).0;
            assert_relative_eq!((at(0.3 + 1e-5) - at(0.3 - 1e-5)) / 2e-5, c.at(0.3, -0.4, 0.9).1, max_relative = 1e-8);
            match c {
                Between | FromPole(_) | FromTip(_) => assert_relative_eq!(at(1.0), 0.9),
                ToPole(_) | ToTip(_) => assert_relative_eq!(at(0.0), -0.4),
                PoleToPole => assert!(at(0.5).abs() < 1e-15),
            }
        }
        let d = Between.at(0.25, Dual::<1>::variable(1.0, 0), Dual::from(2.0));
        assert_eq!((d.0.du[0], d.1.du[0]), (0.75, -1.0));
    }
}
