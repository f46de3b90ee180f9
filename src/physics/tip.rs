//! Which materials can close over the tip of a cone.
//!
//! Near the tip the stretches grow without bound (or up to the locking of the law), and their ratio r = mu/lambda follows the state in
//! which it does not change at the given size of the stretches: the zero of [`tip_drift`] in r, which attracts what flows away from
//! the tip. With u ~ phi^m there, m = cos(a)/r: the tip is closed if r stays bounded. A law whose tension does not grow faster than
//! linearly has no such state. Then a start with closed tip does not converge to anything; a hole would open.

use super::material::Law;
use super::membrane::{Local, tip_drift};
use crate::scalar::Scalar;

/// The largest stretch at which a law is examined, and the factor to the next one where its energy is not finite.
const LARGEST: f64 = 1e4;
const SMALLER: f64 = 0.9;
/// The first ratio that is examined, in cos(a): there the drift is positive for every law whose larger stretch carries the larger
/// tension (Baker and Ericksen).
const FIRST: f64 = 0.95;
/// Steps of the ratio mu/lambda.
const STEP: f64 = 1.02;
/// Largest ratio: u ~ phi^m with m below a thousandth is no tip that a computation could tell from a hole.
const MOST: f64 = 1e3;

/// The ratio mu/lambda far inside the tip of a cone whose inclination has the cosine `cos`, by examination of the law: the first zero
/// of the drift at the largest stretch at which the energy is finite. Nothing where there is none or the law has lost its
/// stiffness: no tip.
pub fn ratio(law: &Law, cos: f64) -> Option<f64> {
    let mut lambda = LARGEST;
    while lambda > 1.0 {
        if let Some(found) = at(law, cos, lambda) {
            return found;
        }
        lambda *= SMALLER;
    }
    None
}

/// The ratio at one stretch: nothing where the energy ends before the search does, nothing inside where there is no zero.
fn at(law: &Law, cos: f64, lambda: f64) -> Option<Option<f64>> {
    let drift = |r: f64| tip_drift(law, cos, lambda, r * lambda);
    let first = FIRST * cos;
    let mut r = first;
    loop {
        let response = law.response(lambda, r * lambda);
        if !response.w.is_finite() {
            return None;
        }
        let falls = drift(r) < 0.0;
        if !(response.w_ll > 0.0) || r > MOST || (falls && r == first) {
            return Some(None);
        }
        if falls {
            break;
        }
        r *= STEP;
    }
    let (mut a, mut b) = (r / STEP, r);
    for _ in 0..60 {
        let m = 0.5 * (a + b);
        if drift(m) < 0.0 { b = m } else { a = m }
    }
    Some(Some(0.5 * (a + b)))
}

/// True if the contact pressure grows without bound towards the tip, judged by the membrane far inside.
///
/// What the face carries beside the pressure of the fluid goes as w_m/(lambda mu rho0). Where the stretches grow so fast that this
/// vanishes (soft laws on steep cones), the contact pressure at the tip is the net pressure.
pub fn presses_without_bound<S: Scalar>(tip: &Local<S>) -> bool {
    let r = &tip.response;
    let value = |s: S| s.value();
    let (lambda, mu) = (value(tip.lambda), value(tip.mu));
    // Logarithmic slopes in eta, outwards: of the stretches, and of the tensions per such slope.
    let stretches = lambda / mu * value(tip.cos).abs() - 1.0;
    let tensions = (lambda * value(r.w_ll) + mu * value(r.w_lm)) / value(r.w_l);
    stretches * (tensions - 2.0) < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::material::*;
    use approx::assert_relative_eq;

    /// Ratios c/m of the exponents m in u ~ phi^m: closed forms of the leading terms of each energy.
    #[test]
    fn the_ratio_far_inside_a_tip_is_that_of_the_leading_terms() {
        for angle in [5.0_f64, 20.0, 40.0, 60.0, 85.0] {
            let c = angle.to_radians().cos();
            let check = |law: Law, m: f64, to: f64| {
                let found = ratio(&law, c).unwrap_or_else(|| panic!("{law:?} at {angle}"));
                assert_relative_eq!(found, c / m, max_relative = to);
            };
            check(NeoHookean { shear_modulus: 1.0 }.into(), c, 1e-9);
            check(Hooke { young_modulus: 1.0, poisson_ratio: 0.3 }.into(), c, 1e-3);
            check(MooneyRivlin { c1: 0.5, c2: 0.05 }.into(), 1.0, 1e-5);
            check(Skalak { shear_modulus: 1.0, area_ratio: 1.0 }.into(), 1.0, 1e-5);
            check(EvansSkalak { shear_modulus: 1.0, area_modulus: 3.0 }.into(), 1.0, 1e-5);
            // (2 n - 1) m^2 - (2 n - 2) m - c^2 = 0 for the degree n.
            let yeoh = |n: f64| {
                let (a, b) = (2.0 * n - 1.0, 2.0 * n - 2.0);
                (b + (b * b + 4.0 * a * c * c).sqrt()) / (2.0 * a)
            };
            check(Yeoh { factors: vec![0.5, 0.1] }.into(), yeoh(2.0), 1e-5);
            check(Yeoh { factors: vec![0.5, 0.1, 0.02] }.into(), yeoh(3.0), 1e-5);
            // (1 + (m - 1)(q - 1)) m^(q - 1) = c^q for the leading exponent q.
            for q in [1.7_f64, 2.0, 3.0, 5.0] {
                let law: Law = Ogden { terms: vec![(1.0, q), (0.1, -0.3)] }.into();
                let m = c / ratio(&law, c).unwrap();
                assert_relative_eq!((1.0 + (m - 1.0) * (q - 1.0)) * m.powf(q - 1.0), c.powf(q), max_relative = 2e-3);
            }
        }
    }

    #[test]
    fn laws_that_do_not_grow_faster_than_linearly_have_no_tip() {
        for angle in [1.0_f64, 20.0, 60.0, 89.0] {
            let c = angle.to_radians().cos();
            for law in [
                Law::from(Varga { shear_modulus: 1.0 }),
                Ogden { terms: vec![(1.0, 1.0)] }.into(),
                Ogden { terms: vec![(1.0, 0.5)] }.into(),
            ] {
                assert_eq!(ratio(&law, c), None, "{law:?} at {angle}");
            }
            for law in [
                Law::from(Gent { shear_modulus: 1.0, locking: 30.0 }),
                Fung { shear_modulus: 1.0, exponent: 0.1 }.into(),
                Ogden { terms: vec![(1.0, 1.0), (0.1, 2.0)] }.into(),
            ] {
                let r = ratio(&law, c).unwrap_or_else(|| panic!("{law:?} at {angle}"));
                assert!(r > 0.97 * c && r < 1.1, "{law:?} at {angle}: {r}");
            }
        }
    }

    #[test]
    fn only_soft_laws_on_steep_cones_press_a_tip_with_a_bound() {
        let presses = |law: Law, angle: f64, lambda: f64| {
            let c = angle.to_radians().cos();
            let mu = ratio(&law, c).unwrap() * lambda;
            let point = crate::physics::reference::Point { rho0: 1e-10, slope: 1.0 };
            presses_without_bound(&Local::new(&law, point, lambda.ln(), mu.ln(), -angle.to_radians()))
        };
        // u ~ phi^m with (1 + 0.3 (m - 1)) m^0.3 = cos(a)^1.3, and (1 - m) (3 - 1.3) - 1 is the exponent.
        let soft = || Law::from(Ogden { terms: vec![(1.0, 1.3)] });
        assert!(presses(soft(), 40.0, 1e4) && !presses(soft(), 60.0, 1e4));
        for angle in [20.0, 60.0, 85.0] {
            assert!(presses(NeoHookean { shear_modulus: 1.0 }.into(), angle, 1e4));
            assert!(presses(EvansSkalak { shear_modulus: 1.0, area_modulus: 3.0 }.into(), angle, 1e4));
            assert!(presses(Fung { shear_modulus: 1.0, exponent: 0.1 }.into(), angle, 30.0));
        }
    }
}
