//! Values between mesh points, as accurate as at them.
//!
//! The piecewise polynomial is of order k + 1 inside an interval, while mesh values are of order 2k. One collocation step from the
//! mesh point on the left to the point wanted carries the accuracy there.

use super::assembly::stage_value;
use super::dense::{lu, lu_solve};
use super::{Discretization, Problem};
use crate::scalar::Dual;

/// y at local coordinate `theta` of an interval; nothing if the step does not converge (the polynomial is then all there is).
pub fn value_at<P: Problem>(
    problem: &P,
    disc: &Discretization,
    z: &[f64],
    segment: usize,
    interval: usize,
    theta: f64,
) -> Option<Vec<f64>> {
    const LANES: usize = 4;
    let shape = &disc.layout.segments[segment];
    let (n, k) = (shape.states, disc.gauss.stages());
    assert!(n <= LANES, "segments have up to {LANES} states");
    let gauss = &disc.gauss;
    let (x0, h) = (disc.meshes[segment][interval], theta * disc.width(segment, interval));
    let y0 = &z[disc.y(segment, interval)..disc.y(segment, interval) + n];
    let from = disc.k(segment, interval);
    let globals = disc.globals(z);
    let p: Vec<Dual<LANES>> = shape.parameters.iter().map(|&g| globals[g].into()).collect();
    // Start from the polynomial's own slopes.
    let mut slopes: Vec<f64> = (0..k * n)
        .map(|r| (0..k).map(|l| gauss.value(l, theta * gauss.nodes[r / n]) * z[from + l * n + r % n]).sum())
        .collect();
    let (kn, mut stage) = (k * n, vec![0.0; n]);
    let mut f = vec![Dual::<LANES>::from(0.0); n];
    for _ in 0..8 {
        let (mut m, mut r, mut pivots) = (vec![0.0; kn * kn], vec![0.0; kn], vec![0; kn]);
        for j in 0..k {
            stage_value(&gauss.integrate[j * k..(j + 1) * k], h, y0, &slopes, &mut stage);
            let y: Vec<Dual<LANES>> = stage.iter().enumerate().map(|(c, v)| Dual::variable(*v, c)).collect();
            problem.flow(segment, x0 + h * gauss.nodes[j], &y, &p, &mut f);
            for a in 0..n {
                r[j * n + a] = f[a].re - slopes[j * n + a];
                for l in 0..k {
                    for c in 0..n {
                        m[(j * n + a) * kn + l * n + c] = -h * gauss.integrate[j * k + l] * f[a].du[c];
                    }
                }
                m[(j * n + a) * kn + j * n + a] += 1.0;
            }
        }
        if !lu(&mut m, kn, &mut pivots) {
            return None;
        }
        lu_solve(&m, kn, &pivots, &mut r);
        let size = r.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let scale = slopes.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
        slopes.iter_mut().zip(&r).for_each(|(a, b)| *a += b);
        if size <= 1e-12 * scale {
            stage_value(&gauss.weights, h, y0, &slopes, &mut stage);
            return Some(stage);
        }
    }
    None
}
