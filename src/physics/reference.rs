//! Reference shapes. A reference shape answers one question: what is your meridian?
//!
//! Its points are named by the conformal coordinate eta, d eta = dS/rho0, in which poles lie at infinity.

use crate::scalar::Scalar;
use std::f64::consts::PI;

/// A point of the reference meridian.
#[derive(Clone, Copy, Debug)]
pub struct Point<S> {
    /// Radius rho0.
    pub rho0: S,
    /// Slope d rho0 / dS, the cosine of the reference tangent angle.
    pub slope: S,
}

/// The stress-free shape.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// A sphere, material points named by phi from the top pole, S = radius * phi, eta = ln tan(phi/2).
    Sphere {
        /// Radius R.
        radius: f64,
    },
    /// A flat disc from its centre to its rim, S = rho0 = radius * phi, eta = ln phi; the rim is at eta = 0.
    Disc {
        /// Radius of the rim.
        radius: f64,
    },
}

impl Reference {
    /// The size of the shape: radius of the sphere, or of the rim.
    #[inline(always)]
    pub fn radius(&self) -> f64 {
        match *self {
            Reference::Sphere { radius } | Reference::Disc { radius } => radius,
        }
    }

    /// The meridian at eta; exact at poles, where eta is infinite.
    #[inline(always)]
    pub fn at<S: Scalar>(&self, eta: S) -> Point<S> {
        match *self {
            Reference::Sphere { radius } => {
                // rho0 = R sin phi = R / cosh eta, cos phi = -tanh eta, through exp(-|eta|): no overflow, no cancellation.
                let sign = if eta.value() < 0.0 { -1.0 } else { 1.0 };
                let e = (eta * -sign).exp();
                let e2 = e * e;
                let d = (e2 + 1.0).recip();
                Point { rho0: e * d * (2.0 * radius), slope: (e2 - 1.0) * d * sign }
            }
            Reference::Disc { radius } => Point { rho0: eta.exp() * radius, slope: S::from(1.0) },
        }
    }

    /// The material coordinate phi at eta: the angle on a sphere, the radius over that of the rim on a disc.
    pub fn phi<S: Scalar>(&self, eta: S) -> S {
        match self {
            Reference::Sphere { .. } if eta.value() < 0.0 => eta.exp().atan() * 2.0,
            Reference::Sphere { .. } => -((-eta).exp().atan() * 2.0) + PI,
            Reference::Disc { .. } => eta.exp(),
        }
    }

    /// eta at phi, the inverse of [`Reference::phi`].
    pub fn eta(&self, phi: f64) -> f64 {
        match self {
            Reference::Sphere { .. } => (0.5 * phi).tan().ln(),
            Reference::Disc { .. } => phi.ln(),
        }
    }

    /// Area.
    pub fn area(&self) -> f64 {
        match *self {
            Reference::Sphere { radius } => 4.0 * PI * radius * radius,
            Reference::Disc { radius } => PI * radius * radius,
        }
    }

    /// Volume inside.
    pub fn volume(&self) -> f64 {
        match *self {
            Reference::Sphere { radius } => 4.0 / 3.0 * PI * radius.powi(3),
            Reference::Disc { .. } => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    #[test]
    fn shapes_are_parametrised_by_their_conformal_coordinate() {
        for shape in [Reference::Sphere { radius: 1.7 }, Reference::Disc { radius: 1.7 }] {
            for eta in [-3.0, -0.4, 0.3, 2.0] {
                let eta = Dual::<1>::variable(eta, 0);
                let (phi, point) = (shape.phi(eta), shape.at(eta));
                // d S = R d phi = rho0 d eta, d rho0 = slope dS
                assert_relative_eq!(1.7 * phi.du[0], point.rho0.re, max_relative = 1e-13);
                assert_relative_eq!(point.rho0.du[0], point.slope.re * point.rho0.re, max_relative = 1e-12);
                assert_relative_eq!(shape.eta(phi.re), eta.re, max_relative = 1e-13);
            }
        }
        let sphere = Reference::Sphere { radius: 1.7 };
        assert_relative_eq!(sphere.at(0.3_f64).rho0, 1.7 * sphere.phi(0.3_f64).sin(), max_relative = 1e-14);
        assert_eq!(sphere.at(-800.0).rho0, 0.0);
        assert_eq!(sphere.at(800.0).slope, -1.0);
        assert_eq!(Reference::Disc { radius: 1.7 }.at(-800.0).rho0, 0.0);
    }
}
