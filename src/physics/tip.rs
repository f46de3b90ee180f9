//! Which materials can close over the tip of a cone.
//!
//! Near the tip the stretches grow without bound (or up to the locking of the law), and their ratio r = mu/lambda follows the state in
//! which it does not change at the given size of the stretches: the zero of [`tip_drift`] in r, which attracts what flows away from
//! the tip. With u ~ phi^m there, m = cos(a)/r: the tip is closed if r stays bounded. A law whose tension does not grow faster than
//! linearly has no such state. Then a start with closed tip does not converge to anything; a hole would open.

use super::material::Law;
use super::membrane::tip_drift;

/// Stretches at which a law is examined, the largest first: the first of them at which its energy is finite counts.
const STRETCHES: [f64; 12] = [1e4, 3e3, 1e3, 300.0, 100.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.5, 1.2];
/// Steps of the ratio mu/lambda.
const STEP: f64 = 1.02;
/// Largest ratio: u ~ phi^m with m below a thousandth is no tip that a computation could tell from a hole.
const MOST: f64 = 1e3;

/// The ratio mu/lambda far inside the tip of a cone whose inclination has the cosine `cos`, by examination of the law: the first zero
/// of the drift at the largest stretch at which the energy is finite. Nothing where there is none or the law has lost its
/// stiffness: no tip.
pub fn ratio(law: &Law, cos: f64) -> Option<f64> {
    STRETCHES.iter().find_map(|&lambda| at(law, cos, lambda)).flatten()
}

/// The ratio at one stretch: nothing where the energy ends before the search does, nothing inside where there is no zero.
fn at(law: &Law, cos: f64, lambda: f64) -> Option<Option<f64>> {
    let drift = |r: f64| tip_drift(law, cos, lambda, r * lambda);
    // Below cos(a) the drift is positive for every law whose larger stretch carries the larger tension (Baker and Ericksen).
    let mut r = 0.5 * cos;
    loop {
        let response = law.response(lambda, r * lambda);
        if !response.w.is_finite() {
            return None;
        }
        if !(response.w_ll > 0.0) || r > MOST {
            return Some(None);
        }
        if drift(r) < 0.0 {
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
                assert!(r > 0.99 * c && r <= 1.01, "{law:?} at {angle}: {r}");
            }
        }
    }
}
