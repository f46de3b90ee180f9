//! The tip coefficient of a neo-Hookean membrane on a cone: C in lambda ~ C phi^(c - 1), c = cos(a).
//!
//! Around the tip the reference shape is flat and the equations do not know the scale, so they depend on v = lambda^-6 and
//! r = mu/lambda alone (G = 1):
//!
//! ```text
//! X = d ln(lambda)/d eta = [r c - 1 + 3 v (1 - c/r)/r^2] / (1 + 3 v/r^2)
//! d r/d eta = r (c/r - 1 - X),      d v/d eta = -6 v X                                              (1)
//! ```
//!
//! The solution that reaches the tip is r(v) with r(0) = 1; along it ln(lambda) + (1 - c) eta goes to ln C with
//!
//! ```text
//! ln C = ln(lambda) + (1 - c) eta + integral from 0 to v of (X + 1 - c)/(6 v X) dv                  (2)
//! ```
//!
//! (1) as r(v) has a regular singular point at v = 0 and is solved by collocation.

use crate::bvp::{Discretization, Estimate, Gauss, Layout, Linearization, Newton, Problem, Segment, uniform};
use crate::scalar::{Scalar, lift};
use std::sync::Arc;

struct Manifold {
    layout: Layout,
    cos: f64,
    v: f64,
}

impl Manifold {
    fn stretching<S: Scalar>(&self, r: S, v: f64) -> S {
        let q = (r * r).recip() * (3.0 * v);
        (r * self.cos - 1.0 + q * (-(r.recip() * self.cos) + 1.0)) / (q + 1.0)
    }
}

impl Problem for Manifold {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, x: f64, y: &[S], _: &[S], out: &mut [S]) {
        let v = self.v * x;
        let stretching = self.stretching(y[0], v);
        out[0] = (-(y[0] * (stretching + 1.0)) + self.cos) / (stretching * (-6.0 * v)) * self.v;
        out[1] = (stretching + (1.0 - self.cos)) / (stretching * (6.0 * v)) * self.v;
    }
    fn condition_slots(&self, _: usize) -> &[usize] {
        &[0]
    }
    fn condition<S: Scalar>(&self, _: usize, slots: &[S]) -> S {
        slots[0] - 1.0
    }
}

/// ln C from the logarithm of the stretch at `eta`, near the tip of a cone with cosine `cos`, and what solving (1) leaves of
/// error in it; nothing where (1) cannot be solved.
pub fn coefficient<S: Scalar>(cos: f64, eta: S, ln_lambda: S) -> Option<(S, f64)> {
    let v = (-6.0 * ln_lambda.value()).exp();
    let start = ln_lambda + eta * (1.0 - cos);
    if v < 1e-18 {
        return Some((start, 0.0));
    }
    let layout =
        Layout { segments: vec![Segment { states: 1, coupled: 1, reported: 0, parameters: vec![] }], globals: 0 };
    let problem = Manifold { layout, cos, v };
    let disc = Discretization::new(problem.layout.clone(), Arc::new(Gauss::new(7)), vec![uniform(12)]);
    // Where both stretches vary slowly; exact for small angles. (From r = 1, X would vanish at v = 1/3.)
    let mut z = disc.sample(&[], |_, x, y| y[0] = 1.0 - 3.0 * v * x * (1.0 - cos) / (1.0 + 3.0 * v * x));
    let mut kept: Option<Linearization> = None;
    Newton { tolerance: 1e-14, limit: 30 }.solve(&problem, &disc, &mut z, &mut kept, &mut Default::default()).ok()?;
    let estimate = Estimate::new(&problem, &disc, &z, kept.as_ref()?);
    let (r, integral) = (z[disc.y(0, disc.intervals(0))], z[disc.q(0)]);
    // d (integral)/d ln(lambda) = -6 v (integrand)
    let stretching = problem.stretching(r, v);
    let slope = -(stretching + 1.0 - cos) / stretching;
    Some((start + lift(integral, slope, 0.0, ln_lambda, eta), estimate.delta[disc.q(0)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::material::{Law, NeoHookean};
    use crate::physics::membrane::tip_drift;

    /// C does not depend on where it is read off. Two points of one solution, found by following (1) outwards with small Runge-Kutta
    /// steps from the slow start, give the same C; without the integral (2) they do not.
    #[test]
    fn the_coefficient_is_the_same_from_every_point_of_a_solution() {
        for angle in [5.0_f64, 20.0, 40.0] {
            let c = angle.to_radians().cos();
            let law: Law = NeoHookean { shear_modulus: 1.0 }.into();
            let m = Manifold { layout: Layout { segments: vec![], globals: 0 }, cos: c, v: 0.0 };
            // High enough to arrive with a stretch above 1, where v < 1.
            let (mut x, mut r, mut eta): (f64, f64, f64) = (0.4 + 30.0 * (1.0 - c), 1.0, -40.0);
            let slope = |x: f64, r: f64| {
                let s = m.stretching(r, (-6.0 * x).exp());
                (s, r * (c / r - 1.0 - s))
            };
            let step = |x: &mut f64, r: &mut f64, h: f64| {
                let (a1, b1) = slope(*x, *r);
                let (a2, b2) = slope(*x + 0.5 * h * a1, *r + 0.5 * h * b1);
                let (a3, b3) = slope(*x + 0.5 * h * a2, *r + 0.5 * h * b2);
                let (a4, b4) = slope(*x + h * a3, *r + h * b3);
                *x += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
                *r += h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4);
            };
            let mut read = vec![];
            for n in 0..30_000 {
                step(&mut x, &mut r, 1e-3);
                eta += 1e-3;
                if n == 24_000 || n == 29_999 {
                    read.push((coefficient(c, eta, x).unwrap().0, x + (1.0 - c) * eta));
                }
            }
            let drift = tip_drift(&law, c, x.exp(), r * x.exp());
            assert!((drift - (c / r - 1.0 - m.stretching(r, (-6.0 * x).exp()))).abs() < 1e-12);
            assert!((read[0].0 - read[1].0).abs() < 1e-10, "{angle}: {read:?}");
            assert!((read[0].1 - read[1].1).abs() > 1e-6, "{angle}: the integral matters, {read:?}");
        }
    }
}
