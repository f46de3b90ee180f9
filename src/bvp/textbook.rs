//! Textbook problems on which the numerics are proved: known answers, observed orders, and twins that must fail.

use super::*;
use std::sync::Arc;

/// Solves from a guess on uniform meshes; the errors tell why not.
fn solve<P: Problem>(
    problem: &P,
    stages: usize,
    meshes: Vec<Vec<f64>>,
    globals: &[f64],
    guess: impl Fn(usize, f64, &mut [f64]),
) -> Result<(Discretization, State, Linearization, Effort), Failure> {
    let disc = Discretization::new(problem.layout().clone(), Arc::new(Gauss::new(stages)), meshes);
    let mut z = disc.sample(globals, guess);
    let (mut kept, mut effort) = (None, Effort::default());
    Newton { tolerance: 1e-12, limit: 40 }.solve(problem, &disc, &mut z, &mut kept, &mut effort)?;
    // Fresh factors: those that Newton kept are of an earlier iterate, good to solve with but not to judge an estimate by.
    let factors = Linearization::new(problem, &disc, &z).expect("regular at the solution");
    Ok((disc, z, factors, effort))
}

/// The order at which `error(intervals)` falls, from two meshes.
fn observed_order(error: impl Fn(usize) -> f64, coarse: usize, fine: usize) -> f64 {
    (error(coarse) / error(fine)).ln() / (fine as f64 / coarse as f64).ln()
}

/// Bratu: y'' + lambda e^y = 0, y(0) = y(1) = 0. Closed form y = -2 ln(cosh((x - 1/2) t/2) / cosh(t/4)), t = sqrt(2 lambda) cosh(t/4);
/// fold at lambda = 3.513830719125162 where 4 = t tanh(t/4).
struct Bratu {
    layout: Layout,
    slots: Vec<Vec<usize>>,
    /// The closing condition: the value of lambda, or of y'(0).
    lambda: Option<f64>,
    slope: f64,
}

impl Bratu {
    fn new(lambda: Option<f64>, slope: f64) -> Self {
        let layout =
            Layout { segments: vec![Segment { states: 2, coupled: 0, reported: 1, parameters: vec![0] }], globals: 1 };
        Bratu { slots: vec![vec![0], vec![2], vec![1, 4]], layout, lambda, slope }
    }

    fn theta(lambda: f64) -> f64 {
        let mut t: f64 = 1.0;
        for _ in 0..200 {
            t = (2.0 * lambda).sqrt() * (t / 4.0).cosh();
        }
        t
    }
}

impl Problem for Bratu {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, _: f64, y: &[S], p: &[S], out: &mut [S]) {
        out[0] = y[1];
        out[1] = -(p[0] * y[0].exp());
        if out.len() > 2 {
            out[2] = y[0];
        }
    }
    fn condition_slots(&self, i: usize) -> &[usize] {
        &self.slots[i]
    }
    fn condition<S: Scalar>(&self, i: usize, s: &[S]) -> S {
        match (i, self.lambda) {
            (2, Some(value)) => s[1] - value,
            (2, None) => s[0] - self.slope,
            _ => s[0],
        }
    }
}

#[test]
fn bratu_converges_with_order_2k_and_the_estimate_tells_the_error() {
    let lambda = 2.0;
    let exact = |t: f64| t * (t / 4.0).tanh(); // y'(0)
    let slope = exact(Bratu::theta(lambda));
    for k in 2..=4 {
        let run = |n: usize| {
            let b = Bratu::new(Some(lambda), 0.0);
            let (disc, z, factors, _) = solve(&b, k, vec![uniform(n)], &[lambda], |_, _, y| y.fill(0.0)).unwrap();
            let error = slope - z[disc.y(0, 0) + 1];
            let estimate = Estimate::new(&b, &disc, &z, &factors).delta[disc.y(0, 0) + 1];
            (error, estimate)
        };
        let order = observed_order(|n| run(n).0.abs(), 3, 6);
        assert!((order - 2.0 * k as f64).abs() < 0.5, "k = {k}: order {order}");
        let (error, estimate) = run(3);
        assert!((estimate / error - 1.0).abs() < 0.02, "k = {k}: estimate {estimate:e}, error {error:e}");
    }
}

#[test]
fn bratu_passes_its_fold_when_closed_by_the_slope_and_is_refused_beyond_it() {
    // At the fold t tanh(t/4) = 4, so y'(0) = 4 and lambda is largest.
    let b = Bratu::new(None, 4.0);
    let guess = |_: usize, x: f64, y: &mut [f64]| {
        y[0] = 4.0 * x * (1.0 - x);
        y[1] = 4.0 - 8.0 * x;
    };
    let (disc, z, _, _) = solve(&b, 5, vec![uniform(6)], &[3.0], guess).unwrap();
    assert!((z[disc.p()] - 3.513830719125162).abs() < 1e-10, "{}", z[disc.p()]);
    let beyond = Bratu::new(Some(3.6), 0.0);
    assert!(solve(&beyond, 5, vec![uniform(6)], &[3.6], guess).is_err(), "no solution exists beyond the fold");
}

/// S. J. Wright: y' = [[-1/6, 1], [1, -1/6]] y + r, y1(0) + y1(b) = .., y2(0) + y2(b) = .. (coupled ends), on [0, b].
struct Wright {
    layout: Layout,
    slots: Vec<Vec<usize>>,
    length: f64,
}

impl Wright {
    fn exact(t: f64) -> [f64; 2] {
        [t.sin(), t.cos()]
    }
}

impl Problem for Wright {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, x: f64, y: &[S], _: &[S], out: &mut [S]) {
        let [s, c] = Wright::exact(x * self.length);
        let r = [c + s / 6.0 - c, -s - s + c / 6.0];
        out[0] = (y[0] * (-1.0 / 6.0) + y[1] + r[0]) * self.length;
        out[1] = (y[0] + y[1] * (-1.0 / 6.0) + r[1]) * self.length;
    }
    fn condition_slots(&self, i: usize) -> &[usize] {
        &self.slots[i]
    }
    fn condition<S: Scalar>(&self, i: usize, s: &[S]) -> S {
        s[0] + s[1] - (Wright::exact(0.0)[i] + Wright::exact(self.length)[i])
    }
}

#[test]
fn wrights_problem_stays_accurate_where_row_pivoted_lu_fails() {
    let layout =
        Layout { segments: vec![Segment { states: 2, coupled: 0, reported: 0, parameters: vec![] }], globals: 0 };
    let w = Wright { layout, slots: vec![vec![0, 2], vec![1, 3]], length: 60.0 };
    let (disc, z, factors, _) = solve(&w, 4, vec![uniform(200)], &[], |_, _, y| y.fill(0.0)).unwrap();
    let worst = (0..=200).fold(0.0_f64, |a, i| {
        let exact = Wright::exact(60.0 * disc.meshes[0][i]);
        a.max((z[disc.y(0, i)] - exact[0]).abs()).max((z[disc.y(0, i) + 1] - exact[1]).abs())
    });
    assert!(worst < 1e-9, "{worst:e}");
    // One linear solve leaves a residual at rounding level.
    let mut r = Residual::default();
    let zero = vec![0.0; disc.unknowns()];
    residual(&w, &disc, &zero, &mut r);
    let mut delta = zero.clone();
    factors.solve(&disc, &r, &mut delta);
    residual(&w, &disc, &delta, &mut r);
    let left = r.stages[0].iter().chain(&r.conditions).fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(left < 1e-11, "{left:e}");
}

/// A shock layer (Ascher, Mattheij and Russell, example 1.17): eps y'' + x y' = -eps pi^2 cos(pi x) - pi x sin(pi x), y(-1) = -2, y(1) = 0;
/// y = cos(pi x) + erf(x / sqrt(2 eps)) / erf(1 / sqrt(2 eps)).
struct Shock {
    layout: Layout,
    slots: Vec<Vec<usize>>,
    eps: f64,
}

impl Problem for Shock {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, x: f64, y: &[S], _: &[S], out: &mut [S]) {
        let t = 2.0 * x - 1.0;
        let pi = std::f64::consts::PI;
        let r = -self.eps * pi * pi * (pi * t).cos() - pi * t * (pi * t).sin();
        out[0] = y[1] * 2.0;
        out[1] = (y[1] * (-t) + r) * (2.0 / self.eps);
    }
    fn condition_slots(&self, i: usize) -> &[usize] {
        &self.slots[i]
    }
    fn condition<S: Scalar>(&self, i: usize, s: &[S]) -> S {
        s[0] + [2.0, 0.0][i]
    }
    fn state_scale(&self, _: usize, state: usize) -> f64 {
        [1.0, self.eps.powf(-0.5)][state]
    }
}

#[test]
fn a_shock_layer_is_found_by_the_mesh() {
    let layout =
        Layout { segments: vec![Segment { states: 2, coupled: 0, reported: 0, parameters: vec![] }], globals: 0 };
    let shock = Shock { layout, slots: vec![vec![0], vec![2]], eps: 1e-4 };
    // The layer has width sqrt(eps) around the middle: y(1/2) = 1 + 0 in t = 0, and y'(t = 0) = sqrt(2/(pi eps)).
    let mut meshes = vec![uniform(40)];
    let mut slope = 0.0;
    for _ in 0..6 {
        let (disc, z, factors, _) = solve(&shock, 4, meshes, &[], |_, _, y| y.fill(0.0)).unwrap();
        let estimate = Estimate::new(&shock, &disc, &z, &factors);
        let (i, theta) = disc.locate(0, 0.5);
        let mut y = [0.0; 2];
        disc.interpolate(&z, 0, i, theta, &mut y);
        slope = y[1];
        meshes = equidistribute(&disc, &estimate, 1.0, 4);
    }
    let exact = (2.0 / (std::f64::consts::PI * 1e-4)).sqrt();
    assert!((slope / exact - 1.0).abs() < 1e-6, "{slope} against {exact}");
    // Twin: the uniform mesh of the same size is far off.
    let (disc, z, _, _) = solve(&shock, 4, vec![uniform(40)], &[], |_, _, y| y.fill(0.0)).unwrap();
    let (i, theta) = disc.locate(0, 0.5);
    let mut y = [0.0; 2];
    disc.interpolate(&z, 0, i, theta, &mut y);
    assert!((y[1] / exact - 1.0).abs() > 1e-4);
}

/// A free boundary with a jump and two segments of different size: y' = y from y(0) = 1 up to the unknown place c where y = 2; there
/// the solution jumps by -1/2 and turns into an oscillator v'' = -v, v(c) = 3/2, v'(c) = 0 on [c, c + d], with d such that v = 0, and the
/// quadrature of v over the second piece, exactly 3/2, as an unknown of its own. c = ln 2, d = pi/2.
struct Handover {
    layout: Layout,
    slots: Vec<Vec<usize>>,
    jump: f64,
}

impl Handover {
    fn new(jump: f64) -> Self {
        let layout = Layout {
            segments: vec![
                Segment { states: 1, coupled: 0, reported: 0, parameters: vec![0] },
                Segment { states: 2, coupled: 1, reported: 1, parameters: vec![1] },
            ],
            globals: 3,
        };
        let slots = vec![vec![0], vec![1], vec![2, 1], vec![3], vec![4], vec![6, 9]];
        Handover { layout, slots, jump }
    }
}

impl Problem for Handover {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, segment: usize, _: f64, y: &[S], p: &[S], out: &mut [S]) {
        if segment == 0 {
            out[0] = y[0] * p[0];
            return;
        }
        out[0] = y[1] * p[0];
        out[1] = -(y[0] * p[0]);
        if out.len() > 2 {
            out[2] = y[0] * p[0];
        }
        if out.len() > 3 {
            out[3] = y[0] * y[0] * p[0];
        }
    }
    fn condition_slots(&self, i: usize) -> &[usize] {
        &self.slots[i]
    }
    fn condition<S: Scalar>(&self, i: usize, s: &[S]) -> S {
        match i {
            0 => s[0] - 1.0,
            1 => s[0] - 2.0,
            2 => s[0] - s[1] - self.jump,
            3 | 4 => s[0],
            _ => s[0] - s[1],
        }
    }
}

#[test]
fn a_free_boundary_with_a_jump_joins_segments_of_different_size() {
    let problem = Handover::new(-0.5);
    let guess = |s: usize, x: f64, y: &mut [f64]| {
        y[0] = if s == 0 { 1.0 + x } else { 1.5 * (1.0 - x) };
        if s == 1 {
            y[1] = -1.0;
        }
    };
    let (disc, z, factors, _) = solve(&problem, 4, vec![uniform(3), uniform(4)], &[0.5, 1.0, 1.0], guess).unwrap();
    let p = disc.globals(&z);
    assert!((p[0] - 2.0_f64.ln()).abs() < 1e-10);
    assert!((p[1] - std::f64::consts::FRAC_PI_2).abs() < 1e-10);
    assert!((p[2] - 1.5).abs() < 1e-9, "{}", p[2]);
    let estimate = Estimate::new(&problem, &disc, &z, &factors);
    let true_error = std::f64::consts::FRAC_PI_2 - p[1];
    assert!((estimate.delta[disc.p() + 1] / true_error - 1.0).abs() < 0.1);
    // The reported quadrature: integral of 9/4 cos^2 over a quarter period.
    let mut q = [0.0; 2];
    quadratures_along(&problem, &disc, &|i| z[i], 1, &mut q);
    assert!((q[1] - 2.25 * std::f64::consts::PI / 4.0).abs() < 1e-9);
    // Twin: another jump, another answer.
    let (disc, z, _, _) =
        solve(&Handover::new(-0.501), 4, vec![uniform(3), uniform(4)], &[0.5, 1.0, 1.0], guess).unwrap();
    assert!((disc.globals(&z)[2] - 1.5).abs() > 5e-4);
}

/// Emden: y'' + 2 y'/x + y^5 = 0, y'(0) = 0, y(1) = sqrt(3)/2; y = 1/sqrt(1 + x^2/3). The pole stays in the mesh.
struct Emden {
    layout: Layout,
    slots: Vec<Vec<usize>>,
}

impl Problem for Emden {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, x: f64, y: &[S], _: &[S], out: &mut [S]) {
        out[0] = y[1];
        out[1] = -(y[1] * (2.0 / x)) - y[0].powi(5);
    }
    fn condition_slots(&self, i: usize) -> &[usize] {
        &self.slots[i]
    }
    fn condition<S: Scalar>(&self, i: usize, s: &[S]) -> S {
        s[0] - [0.0, 0.75_f64.sqrt()][i]
    }
}

#[test]
fn a_regular_singular_point_keeps_the_full_order() {
    let run = |n: usize, k: usize| {
        let layout =
            Layout { segments: vec![Segment { states: 2, coupled: 0, reported: 0, parameters: vec![] }], globals: 0 };
        let emden = Emden { layout, slots: vec![vec![1], vec![2]] };
        let (disc, z, factors, _) = solve(&emden, k, vec![uniform(n)], &[], |_, _, y| {
            y[0] = 0.9;
            y[1] = 0.0;
        })
        .unwrap();
        let slope = z[disc.y(0, n) + 1];
        let exact = -1.0 / 3.0 * (4.0_f64 / 3.0).powf(-1.5);
        let estimate = Estimate::new(&emden, &disc, &z, &factors).delta[disc.y(0, n) + 1];
        (exact - slope, estimate)
    };
    for k in [3, 4] {
        let order = observed_order(|n| run(n, k).0.abs(), 2, 4);
        assert!(order > 2.0 * k as f64 - 0.7, "k = {k}: order {order}");
        let (error, estimate) = run(3, k);
        assert!((estimate / error - 1.0).abs() < 0.4, "k = {k}: estimate {estimate:e}, error {error:e}");
    }
}
