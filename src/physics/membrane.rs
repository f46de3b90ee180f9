//! Equilibrium of a membrane along its meridian, in the conformal coordinate eta of the reference shape.
//!
//! With d eta = dS/rho0 no 1/rho0 is left, and with the logarithms of the stretches no stretch can become negative and many decades
//! of stretch are of moderate size. From d(rho0 w_l)/dS = w_m cos tau - lambda u f_t and
//! rho0 w_l dtau/dS = lambda u p - w_m sin tau:
//!
//! ```text
//! d ln(lambda)/d eta = [(w_m - lambda w_lm) cos tau - (w_l - mu w_lm) rho0' - rho0 q_t] / (lambda w_ll)   (1)
//! d ln(mu)/d eta     = (lambda/mu) cos tau - rho0'                                                    (2)
//! d tau/d eta        = (lambda mu rho0 p + rho0 q_n - w_m sin tau) / w_l                              (3)
//! dh/d eta           = rho0 lambda sin tau                                                            (4)
//! ```
//!
//! rho0' = d rho0/dS; q_t and q_n are what other tractions add, per reference area. On a rigid frictionless face tau is given by the face, and (1), (2) remain; the contact pressure carries
//! what (3) misses.

use super::material::{Law, Response};
use super::reference::Point;
use crate::scalar::Scalar;

/// The state of the membrane at a point, and everything that follows from it there.
#[derive(Clone, Copy, Debug)]
pub struct Local<S> {
    /// Reference radius.
    pub rho0: S,
    /// d rho0/dS.
    pub slope0: S,
    /// Meridional stretch.
    pub lambda: S,
    /// Hoop stretch.
    pub mu: S,
    /// Sine of the tangent angle.
    pub sin: S,
    /// Cosine of the tangent angle.
    pub cos: S,
    /// Energy, tensions, stiffnesses.
    pub response: Response<S>,
}

impl<S: Scalar> Local<S> {
    /// Evaluates the material at a point.
    #[inline(always)]
    pub fn new(law: &Law, point: Point<S>, ln_lambda: S, ln_mu: S, tau: S) -> Self {
        let (lambda, mu) = (ln_lambda.exp(), ln_mu.exp());
        let (sin, cos) = tau.sin_cos();
        let response = law.response(lambda, mu);
        Local { rho0: point.rho0, slope0: point.slope, lambda, mu, sin, cos, response }
    }

    /// Right-hand sides of (1) and (2) under the tangential traction `pull` per reference area.
    #[inline(always)]
    pub fn stretching(&self, pull: S) -> [S; 2] {
        let r = &self.response;
        let top =
            (r.w_m - self.lambda * r.w_lm) * self.cos - (r.w_l - self.mu * r.w_lm) * self.slope0 - self.rho0 * pull;
        [top / (self.lambda * r.w_ll), self.lambda / self.mu * self.cos - self.slope0]
    }

    /// Right-hand side of (3) under the net outward pressure `p` per current area and the normal traction `push` per reference
    /// area.
    #[inline(always)]
    pub fn turning(&self, p: S, push: S) -> S {
        let r = &self.response;
        (self.rho0 * (self.lambda * self.mu * p + push) - r.w_m * self.sin) / r.w_l
    }

    /// Deformed radius.
    pub fn u(&self) -> S {
        self.mu * self.rho0
    }

    /// Contact pressure on a face whose tangent turns by `bend` = d tau/ds along it, and by `hoop` = sin tau/u around the axis, under
    /// the outward traction `p_ext`: p_ext - (w_l dtau/dS + w_m sin tau/rho0)/(lambda mu).
    pub fn contact_pressure(&self, p_ext: S, bend: S, hoop: S) -> S {
        let r = &self.response;
        p_ext - (r.w_l * bend / self.mu + r.w_m * hoop / self.lambda)
    }
}

/// d ln(mu/lambda)/d eta on a cone of inclination `a` around its tip, where rho0' = 1 and the equations do not know the scale.
///
/// A solution that starts at the tip follows the state in which this vanishes while both stretches vary slowly or as a power
/// of the distance (neo-Hookean: mu = lambda exactly; Ogden: mu/lambda = c/m; a regular pole, a = 0: mu = lambda); whatever else it
/// starts with decays outwards (model: Baker-Ericksen).
pub fn tip_drift<S: Scalar>(law: &Law, cos: f64, lambda: S, mu: S) -> S {
    let r = law.response(lambda, mu);
    let top = (r.w_m - lambda * r.w_lm) * cos - (r.w_l - mu * r.w_lm);
    lambda / mu * cos - 1.0 - top / (lambda * r.w_ll)
}

/// Energy between a cone's tip and a point near it, where the reference shape is flat.
///
/// L = rho0 w(u'/cos a, u/rho0) has no scale of its own, so d/d rho0 [rho0 (L - u' L_u') + u L_u'] = 2 L on a solution (Noether), and the
/// energy is the bracket's value times pi: pi rho0^2 (w - lambda w_l + mu w_l / cos a). Whole circle, per membrane side.
pub fn tip_energy<S: Scalar>(local: &Local<S>) -> S {
    let r = &local.response;
    let cos = local.cos.value().abs();
    local.rho0 * local.rho0 * (r.w - local.lambda * r.w_l + local.mu * r.w_l / cos) * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::material::NeoHookean;
    use crate::physics::reference::Reference;
    use approx::assert_relative_eq;

    /// An inflated sphere is in equilibrium under p = 2 w_l/r0^2: stretches stay, tau = phi turns as phi does.
    #[test]
    fn the_inflated_sphere_is_an_equilibrium() {
        let law: Law = NeoHookean { shear_modulus: 1.0 }.into();
        let sphere = Reference::Sphere { radius: 1.0 };
        let r0: f64 = 1.6;
        let p = 2.0 * law.response(r0, r0).w_l / (r0 * r0);
        for eta in [-2.0, 0.1, 1.5] {
            let local = Local::new(&law, sphere.at(eta), r0.ln(), r0.ln(), sphere.phi(eta));
            let [a, b] = local.stretching(0.0);
            assert!(a.abs() < 1e-14 && b.abs() < 1e-14);
            assert_relative_eq!(local.turning(p, 0.0), local.rho0, max_relative = 1e-13);
            assert!(
                (local.turning(1.001 * p, 0.0) / local.rho0 - 1.0).abs() > 1e-3,
                "another pressure is no equilibrium"
            );
            assert!(local.contact_pressure(p, 1.0 / r0, 1.0 / r0).abs() < 1e-13);
            assert!(local.contact_pressure(p, 1.0 / r0, 1.001 / r0).abs() > 1e-4);
        }
    }

    #[test]
    fn the_tip_of_a_neo_hookean_cone_has_equal_stretches() {
        let law: Law = NeoHookean { shear_modulus: 1.0 }.into();
        assert!(tip_drift(&law, 0.5, 1e6, 1e6).abs() < 1e-14);
        assert!(tip_drift(&law, 0.5, 1e6, 1.01e6).abs() > 1e-3);
        // w = lambda^2 G, energy = pi phi^2 lambda^2 / c for lambda ~ phi^(c - 1)
        let point = Point { rho0: 1e-6, slope: 1.0 };
        let local = Local::new(&law, point, 1e4_f64.ln(), 1e4_f64.ln(), -(0.5_f64.acos()));
        assert_relative_eq!(tip_energy(&local), std::f64::consts::PI * 1e-12 * 1e8 / 0.5, max_relative = 1e-7);
    }
}
