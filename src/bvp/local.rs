//! Values between mesh points, as accurate as at them.
//!
//! The piecewise polynomial is of order k + 1 inside an interval, while mesh values are of order 2k. One collocation step from the
//! nearer mesh point to the point wanted carries the accuracy there, and with it whatever directions the unknowns carry.

use super::assembly::stage_value;
use super::dense::{lu, lu_solve};
use super::{Discretization, Problem};
use crate::scalar::{Dual, Scalar};

/// y at local coordinate `theta` of an interval; nothing if the step does not converge (the polynomial is then all there is).
///
/// `z(i)` gives unknown i, with derivatives along directions of the state if its type carries any.
pub fn value_at<P: Problem, S: Scalar>(
    problem: &P,
    disc: &Discretization,
    z: &impl Fn(usize) -> S,
    segment: usize,
    interval: usize,
    theta: f64,
) -> Option<Vec<S>> {
    const LANES: usize = 4;
    let shape = &disc.layout.segments[segment];
    let (n, k) = (shape.states, disc.gauss.stages());
    assert!(n <= LANES, "segments have up to {LANES} states");
    let gauss = &disc.gauss;
    let (near, width) = if theta <= 0.5 { (interval, theta) } else { (interval + 1, theta - 1.0) };
    let (x0, h) = (disc.meshes[segment][near], width * disc.width(segment, interval));
    let from = disc.k(segment, interval);
    let y0: Vec<S> = (0..n).map(|c| z(disc.y(segment, near) + c)).collect();
    let p: Vec<S> = shape.parameters.iter().map(|&g| z(disc.p() + g)).collect();
    // Start from the polynomial's own slopes; a node of the step lies here in the interval.
    let place = |j: usize| (near - interval) as f64 + width * gauss.nodes[j];
    let slope =
        |j: usize, c: usize| (0..k).map(|l| gauss.value(l, place(j)) * z(from + l * n + c).value()).sum::<f64>();
    let mut slopes: Vec<S> = (0..k * n).map(|r| S::from(slope(r / n, r % n))).collect();
    let (kn, mut stage) = (k * n, vec![S::from(0.0); n]);
    let (mut r, mut f) = (vec![S::from(0.0); kn], vec![S::from(0.0); n]);
    let (mut m, mut pivots) = (vec![0.0; kn * kn], vec![0; kn]);
    // One step more than values need: the directions follow from the Jacobian of the last one.
    let (mut converged, mut before) = (false, f64::INFINITY);
    for _ in 0..8 {
        for j in 0..k {
            stage_value(&gauss.integrate[j * k..(j + 1) * k], h, &y0, &slopes, &mut stage);
            problem.flow(segment, x0 + h * gauss.nodes[j], &stage, &p, &mut f);
            let y: Vec<Dual<LANES>> = stage.iter().enumerate().map(|(c, v)| Dual::variable(v.value(), c)).collect();
            let constants: Vec<Dual<LANES>> = p.iter().map(|v| v.value().into()).collect();
            let mut jacobian = vec![Dual::<LANES>::from(0.0); n];
            problem.flow(segment, x0 + h * gauss.nodes[j], &y, &constants, &mut jacobian);
            for a in 0..n {
                r[j * n + a] = f[a] - slopes[j * n + a];
                for l in 0..k {
                    for c in 0..n {
                        m[(j * n + a) * kn + l * n + c] = -h * gauss.integrate[j * k + l] * jacobian[a].du[c];
                    }
                }
                m[(j * n + a) * kn + j * n + a] += 1.0;
            }
        }
        if !lu(&mut m, kn, &mut pivots) {
            return None;
        }
        lu_solve(&m, kn, &pivots, &mut r);
        let size = r.iter().fold(0.0_f64, |a, b| a.max(b.value().abs()));
        let scale = slopes.iter().fold(1.0_f64, |a, b| a.max(b.value().abs()));
        slopes.iter_mut().zip(&r).for_each(|(a, b)| *a = *a + *b);
        if converged {
            stage_value(&gauss.weights, h, &y0, &slopes, &mut stage);
            return Some(stage);
        }
        // Down to rounding, which may be larger where the stages are stiff.
        converged = size <= 1e-12 * scale || (size > 0.5 * before && size <= 1e-9 * scale);
        before = size;
    }
    None
}
