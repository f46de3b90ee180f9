//! Reference shapes. A reference shape answers one question: what is your meridian?

use crate::scalar::Scalar;

/// A point of the reference meridian.
#[derive(Clone, Copy, Debug)]
pub struct Point<S> {
    /// Radius rho0.
    pub rho0: S,
    /// Slope d rho0 / dS, the cosine of the reference tangent angle.
    pub slope: S,
}

/// The stress-free shape: a sphere of radius `radius`, material points named by phi from the top pole, S = radius * phi.
#[derive(Clone, Debug, PartialEq)]
pub struct Sphere {
    /// Radius R.
    pub radius: f64,
}

impl Sphere {
    /// The meridian at eta = ln tan(phi/2): rho0 = R sin phi = R / cosh eta, cos phi = -tanh eta. Exact at both poles, where
    /// eta is infinite.
    #[inline(always)]
    pub fn at<S: Scalar>(&self, eta: S) -> Point<S> {
        // Through exp(-|eta|): no overflow, no cancellation.
        let sign = if eta.value() < 0.0 { -1.0 } else { 1.0 };
        let e = (eta * -sign).exp();
        let e2 = e * e;
        let d = (e2 + 1.0).recip();
        Point { rho0: e * d * (2.0 * self.radius), slope: (e2 - 1.0) * d * sign }
    }

    /// The material angle phi at eta.
    pub fn phi<S: Scalar>(&self, eta: S) -> S {
        if eta.value() < 0.0 { eta.exp().atan() * 2.0 } else { -((-eta).exp().atan() * 2.0) + std::f64::consts::PI }
    }

    /// Area 4 pi R^2.
    pub fn area(&self) -> f64 {
        4.0 * std::f64::consts::PI * self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Dual;
    use approx::assert_relative_eq;

    #[test]
    fn the_sphere_is_parametrised_by_its_conformal_coordinate() {
        let sphere = Sphere { radius: 1.7 };
        for eta in [-3.0, -0.4, 0.3, 2.0] {
            let eta = Dual::<1>::variable(eta, 0);
            let (phi, point) = (sphere.phi(eta), sphere.at(eta));
            assert_relative_eq!(point.rho0.re, 1.7 * phi.re.sin(), max_relative = 1e-14);
            assert_relative_eq!(point.slope.re, phi.re.cos(), max_relative = 1e-13);
            // d S = R d phi = rho0 d eta, d rho0 = slope dS
            assert_relative_eq!(1.7 * phi.du[0], point.rho0.re, max_relative = 1e-13);
            assert_relative_eq!(point.rho0.du[0], point.slope.re * point.rho0.re, max_relative = 1e-12);
        }
        assert_eq!(sphere.at(-800.0).rho0, 0.0);
        assert_eq!(sphere.at(800.0).slope, -1.0);
    }
}
