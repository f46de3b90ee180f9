//! The error of a collocation solution, from one more residual solved with the kept factors.
//!
//! Let u be the piecewise polynomial, e = (exact) - u, and d = f(x, u, P) - u' its defect: e' = f(u + e) - f(u) + d. Split e in
//! e1 + e2, with e1 the running integral of d on each interval, started from zero at its left end:
//!
//! ```text
//! e1(x) = integral of d,      e2' = f(u + e1 + e2) - f(u) ~ J e2 + [f(u + e1) - f(u)]               (6)
//! ```
//!
//! d is sampled on finer nodes (it vanishes at the collocation nodes). Equation (6) is a linear collocation problem with the
//! kept factors, with the bracket as forcing and e1 at the end of an interval as a jump. The bracket is *projected* onto degree
//! < k, not sampled at the nodes: sampling aliases the leading part of e1, a multiple of P_{k+1} - P_{k-1}, and would estimate
//! (k + 1)/(2k + 1) of the error. What is neglected is smaller by O(h |J| / 2k), and by the nonlinearity. Since d also
//! holds the residual at the nodes, what is left of Newton's iteration is part of the estimate.

use super::assembly::stage_value;
use super::{Discretization, Layout, Linearization, Problem, Residual, State};
use crate::scalar::Scalar;

/// The part of what an interval contributes that the estimate may neglect. It stands out where contributions cancel.
const NEGLECTED: f64 = 0.08;

/// The estimated error of a solution.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    /// (Exact) - (computed) for every unknown, to leading order.
    pub delta: State,
    /// A sample of what `delta` neglects: a part of what each interval contributes, and all that it does not resolve of given data,
    /// with signs from a fixed sequence.
    pub neglected: State,
    /// (Exact) - (computed) of the quadratures by themselves, per segment, coupled ones first: what finer nodes and e1 add.
    /// The part through `delta` is not included.
    pub quadratures: Vec<Vec<f64>>,
    /// Largest |e1| relative to the scales of the problem, per segment and interval; of order h^(k+1).
    pub local: Vec<Vec<f64>>,
    /// What an interval does not resolve of given data ([`Problem::unresolved`]), per segment and interval.
    pub unresolved: Vec<Vec<f64>>,
    /// Largest error that an interval adds at its right end or to a quadrature, relative to the scales of the problem, per segment
    /// and interval; of order h^(2k+1) where no mode is stiff.
    pub injected: Vec<Vec<f64>>,
}

impl Estimate {
    /// No error at all, for a state that is known exactly.
    pub fn none(disc: &Discretization) -> Self {
        let per = |f: &dyn Fn(usize) -> usize| (0..disc.meshes.len()).map(|s| vec![0.0; f(s)]).collect::<Vec<_>>();
        let segments = &disc.layout.segments;
        Estimate {
            delta: vec![0.0; disc.unknowns()],
            neglected: vec![0.0; disc.unknowns()],
            quadratures: per(&|s| segments[s].coupled + segments[s].reported),
            local: per(&|s| disc.intervals(s)),
            unresolved: per(&|s| disc.intervals(s)),
            injected: per(&|s| disc.intervals(s)),
        }
    }

    /// Estimates the error of `z`, a solution on `disc`, with factors that were taken near it.
    pub fn new<P: Problem>(problem: &P, disc: &Discretization, z: &[f64], factors: &Linearization) -> Self {
        let layout = &disc.layout;
        let gauss = &disc.gauss;
        let (k, m) = (gauss.stages(), gauss.fine_stages());
        let globals = disc.globals(z);
        let mut rhs = Residual::default();
        super::assembly::residual(problem, disc, z, &mut rhs);
        let (mut defects, mut local) = (vec![], vec![]);
        // What each interval adds to the error of each quadrature, and the quadratures themselves.
        let (mut missed, mut totals) = (vec![], vec![]);
        for (s, segment) in layout.segments.iter().enumerate() {
            let (n, q) = (segment.states, segment.coupled + segment.reported);
            let p: Vec<f64> = segment.parameters.iter().map(|&i| globals[i]).collect();
            let mut u = vec![0.0; m * n];
            let (mut flow, mut flow_e1) = (vec![0.0; m * (n + q)], vec![0.0; m * (n + q)]);
            let mut defect = vec![0.0; m * n];
            let mut e1 = vec![0.0; n];
            let mut shifted = vec![0.0; n];
            let mut quadrature = vec![0.0; q];
            let (mut sizes, mut shares, mut total) = (vec![], vec![], vec![0.0; q]);
            for i in 0..disc.intervals(s) {
                let (h, x0) = (disc.width(s, i), disc.meshes[s][i]);
                let (y, slopes) = (&z[disc.y(s, i)..], &z[disc.k(s, i)..disc.k(s, i) + k * n]);
                for j in 0..m {
                    let u = &mut u[j * n..(j + 1) * n];
                    stage_value(&gauss.integrate_to_fine[j * k..(j + 1) * k], h, y, slopes, u);
                    let flow = &mut flow[j * (n + q)..(j + 1) * (n + q)];
                    problem.flow(s, x0 + h * gauss.fine_nodes[j], u, &p, flow);
                    for c in 0..n {
                        let slope: f64 = (0..k).map(|l| gauss.to_fine[j * k + l] * slopes[l * n + c]).sum();
                        defect[j * n + c] = flow[c] - slope;
                    }
                }
                let mut size: f64 = 0.0;
                for j in 0..m {
                    for c in 0..n {
                        e1[c] = h * (0..m).map(|l| gauss.fine_integrate[j * m + l] * defect[l * n + c]).sum::<f64>();
                        shifted[c] = u[j * n + c] + e1[c];
                        let relative = e1[c].abs() / problem.state_scale(s, c);
                        if !(relative <= size) {
                            size = relative;
                        }
                    }
                    let flow_e1 = &mut flow_e1[j * (n + q)..(j + 1) * (n + q)];
                    problem.flow(s, x0 + h * gauss.fine_nodes[j], &shifted, &p, flow_e1);
                }
                sizes.push(size);
                for c in 0..n {
                    rhs.jumps[s][i * n + c] +=
                        h * (0..m).map(|j| gauss.fine_weights[j] * defect[j * n + c]).sum::<f64>();
                }
                for j in 0..k {
                    for c in 0..n {
                        let forcing: f64 = (0..m)
                            .map(|l| gauss.project[j * m + l] * (flow_e1[l * (n + q) + c] - flow[l * (n + q) + c]))
                            .sum();
                        rhs.stages[s][(i * k + j) * n + c] = -forcing;
                    }
                }
                let mut share: Vec<f64> = (0..q)
                    .map(|c| h * (0..m).map(|j| gauss.fine_weights[j] * flow_e1[j * (n + q) + n + c]).sum::<f64>())
                    .collect();
                total.iter_mut().zip(&share).for_each(|(t, v)| *t += v);
                for j in 0..k {
                    stage_value(&gauss.integrate[j * k..(j + 1) * k], h, y, slopes, &mut shifted);
                    problem.flow(s, x0 + h * gauss.nodes[j], &shifted, &p, &mut flow[..n + q]);
                    for c in 0..q {
                        share[c] -= h * gauss.weights[j] * flow[n + c];
                    }
                }
                quadrature.iter_mut().zip(&share).for_each(|(sum, v)| *sum += v);
                shares.extend(share);
            }
            for c in 0..segment.coupled {
                rhs.quadratures[s][c] -= quadrature[c];
            }
            defects.push(quadrature);
            local.push(sizes);
            missed.push(shares);
            totals.push(total);
        }
        let injected = layout
            .segments
            .iter()
            .enumerate()
            .map(|(s, segment)| {
                let mut end = vec![0.0; segment.states];
                let q = segment.coupled + segment.reported;
                let scales: Vec<f64> = (0..q).map(|c| quadrature_scale(layout, &totals, s, c)).collect();
                let mut size = |i| {
                    factors.injected(disc, s, i, &rhs, &mut end);
                    let states = end.iter().enumerate().map(|(c, v)| v.abs() / problem.state_scale(s, c));
                    let quadratures = (0..q).map(|c| missed[s][i * q + c].abs() / scales[c]);
                    states.chain(quadratures).fold(0.0_f64, f64::max)
                };
                (0..disc.intervals(s)).map(&mut size).collect()
            })
            .collect();
        let mut delta = vec![0.0; disc.unknowns()];
        factors.solve_refined(problem, disc, z, &rhs, 1e-3, &mut delta);
        let unresolved: Vec<Vec<f64>> = (0..layout.segments.len())
            .map(|s| (0..disc.intervals(s)).map(|i| problem.unresolved(s, i)).collect())
            .collect();
        let mut sign = signs();
        for (s, segment) in layout.segments.iter().enumerate() {
            let n = segment.states;
            let intervals = rhs.stages[s].chunks_exact_mut(k * n).zip(rhs.jumps[s].chunks_exact_mut(n));
            for ((stages, jump), given) in intervals.zip(&unresolved[s]) {
                let sign = sign();
                stages.iter_mut().chain(&mut *jump).for_each(|v| *v *= sign * NEGLECTED);
                jump.iter_mut().for_each(|v| *v += sign * given);
            }
        }
        let mut neglected = vec![0.0; disc.unknowns()];
        factors.solve(disc, &rhs, &mut neglected);
        Estimate { delta, neglected, quadratures: defects, local, unresolved, injected }
    }

    /// Largest local error of any interval: the estimate is to be trusted where this is small.
    pub fn largest_local(&self) -> f64 {
        self.local.iter().flatten().fold(0.0, |a, &b| if b > a || b.is_nan() { b } else { a })
    }
}

/// The magnitude that an error of quadrature `c` of segment `s` is measured against: the largest of those that stand at the same
/// place among the coupled or reported ones of their segments, and so add up to one number.
fn quadrature_scale(layout: &Layout, totals: &[Vec<f64>], s: usize, c: usize) -> f64 {
    let coupled = layout.segments[s].coupled;
    let same = |t: usize| {
        let other = &layout.segments[t];
        match c.checked_sub(coupled) {
            None => (c < other.coupled).then(|| totals[t][c]),
            Some(r) => (r < other.reported).then(|| totals[t][other.coupled + r]),
        }
    };
    (0..totals.len()).filter_map(same).fold(f64::MIN_POSITIVE, |a, v| a.max(v.abs()))
}

/// The quadratures of a segment, coupled ones first, on numbers that may carry derivatives along directions of the state.
///
/// `z(i)` gives unknown i with its derivatives.
pub fn quadratures_along<P: Problem, S: Scalar>(
    problem: &P,
    disc: &Discretization,
    z: &impl Fn(usize) -> S,
    segment: usize,
    out: &mut [S],
) {
    let shape = &disc.layout.segments[segment];
    let gauss = &disc.gauss;
    let (n, k) = (shape.states, gauss.stages());
    let p: Vec<S> = shape.parameters.iter().map(|&i| z(disc.p() + i)).collect();
    let mut y = vec![S::from(0.0); n];
    let mut flow = vec![S::from(0.0); n + out.len()];
    out.fill(S::from(0.0));
    for i in 0..disc.intervals(segment) {
        let (h, x0) = (disc.width(segment, i), disc.meshes[segment][i]);
        let (at, slopes) = (disc.y(segment, i), disc.k(segment, i));
        for j in 0..k {
            for c in 0..n {
                let mut v = z(at + c);
                for l in 0..k {
                    v = v + z(slopes + l * n + c) * (h * gauss.integrate[j * k + l]);
                }
                y[c] = v;
            }
            problem.flow(segment, x0 + h * gauss.nodes[j], &y, &p, &mut flow);
            for (c, o) in out.iter_mut().enumerate() {
                *o = *o + flow[n + c] * (h * gauss.weights[j]);
            }
        }
    }
}

/// A fixed sequence of signs without a pattern.
fn signs() -> impl FnMut() -> f64 {
    let mut seed = 0x9e37_79b9_7f4a_7c15_u64;
    move || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        if seed >> 63 == 0 { 1.0 } else { -1.0 }
    }
}

/// What rounding does to a solution: the response of every unknown to errors of the size of one rounding in each equation, with
/// signs from a fixed sequence.
pub fn rounding<P: Problem>(problem: &P, disc: &Discretization, z: &[f64], factors: &Linearization) -> State {
    let layout = &disc.layout;
    let k = disc.gauss.stages();
    let mut sign = signs();
    let mut rhs = Residual::default();
    for (s, segment) in layout.segments.iter().enumerate() {
        let n = segment.states;
        let (mut stages, mut jumps) = (vec![], vec![]);
        for i in 0..disc.intervals(s) {
            let (h, x0) = (disc.width(s, i), disc.meshes[s][i]);
            for j in 0..k {
                let noise = problem.noise(s, x0 + h * disc.gauss.nodes[j]);
                let slopes = &z[disc.k(s, i) + j * n..disc.k(s, i) + (j + 1) * n];
                stages.extend(slopes.iter().map(|v| sign() * (noise + 2.0 * f64::EPSILON * v.abs())));
            }
            let y = &z[disc.y(s, i + 1)..disc.y(s, i + 1) + n];
            jumps.extend(y.iter().map(|v| sign() * f64::EPSILON * v.abs()));
        }
        rhs.stages.push(stages);
        rhs.jumps.push(jumps);
        let q = &z[disc.q(s)..disc.q(s) + segment.coupled];
        rhs.quadratures.push(q.iter().map(|v| sign() * f64::EPSILON * v.abs()).collect());
    }
    // A condition rounds each of its terms.
    let size = layout.slots();
    let rows = factors.matrix.chunks_exact(size).skip(size - layout.conditions());
    let index = disc.slot_index();
    rhs.conditions = rows
        .map(|row| {
            let terms: f64 = row.iter().zip(&index).map(|(a, &i)| (a * z[i]).abs()).sum();
            sign() * f64::EPSILON * terms
        })
        .collect();
    let mut delta = vec![0.0; disc.unknowns()];
    factors.solve(disc, &rhs, &mut delta);
    delta
}
