//! Residual, Jacobian and the elimination of everything inside the segments.
//!
//! One interval, from y to y+ with stage derivatives K_j, Y_j = y + h sum_l a_jl K_l:
//!
//! ```text
//! K_j - f(x_j, Y_j, P) = 0,      y+ = y + h sum_j b_j K_j,      Q += h sum_j b_j g(x_j, Y_j, P)
//! ```
//!
//! Linearised, with M = I - h A (x) J (block (j, l) is delta_jl I - h a_jl J_j), stage residual r and J_P = df/dP:
//!
//! ```text
//! M dK = J dy + J_P dP - r                                                                          (4)
//! dy+  = T dy + U dP + c,  T = I + W^T J,  U = W^T J_P,  c = -W^T r,  M^T W = h b (x) I             (5)
//! ```
//!
//! and the same with M^T W_q = h^2 sum_j b_j a_jl G_j for the quadratures. Only n + q columns are solved for, however many
//! globals there are. The chain of relations (5) is eliminated from left to right: the running relation
//! A y_0 + B y_i + C P = d and (5) are stacked and rotated until y_i stands in n rows alone.

use super::dense::{back_substitute, householder, lu, lu_solve, lu_solve_transposed, reflect};
use super::{Discretization, Problem};
use crate::scalar::{Dual, Scalar};
use nalgebra::{DMatrix, DVector};

/// Refinements of a linear solution.
const REFINEMENTS: usize = 4;
/// Directions differentiated in one pass.
const LANES: usize = 8;
type D = Dual<LANES>;

/// The residual of the discrete problem.
#[derive(Clone, Debug, Default)]
pub struct Residual<S = f64> {
    /// K - f, per segment N x k x n.
    pub stages: Vec<Vec<S>>,
    /// y + h sum_j b_j K_j - y+, per segment N x n.
    pub jumps: Vec<Vec<S>>,
    /// Q - its quadrature, per segment.
    pub quadratures: Vec<Vec<S>>,
    /// B_i.
    pub conditions: Vec<S>,
}

impl<S: Scalar> Residual<S> {
    /// A residual of zeros.
    pub fn zero(disc: &Discretization) -> Self {
        let (layout, zero) = (&disc.layout, S::from(0.0));
        let per = |f: &dyn Fn(usize) -> usize| (0..layout.segments.len()).map(|s| vec![zero; f(s)]).collect();
        Residual {
            stages: per(&|s| disc.intervals(s) * disc.gauss.stages() * layout.segments[s].states),
            jumps: per(&|s| disc.intervals(s) * layout.segments[s].states),
            quadratures: per(&|s| layout.segments[s].coupled),
            conditions: vec![zero; layout.conditions()],
        }
    }

    /// All its numbers.
    pub fn iter(&self) -> impl Iterator<Item = &S> {
        let blocks = [&self.stages, &self.jumps, &self.quadratures];
        blocks.into_iter().flatten().flatten().chain(&self.conditions)
    }
}

impl Residual {
    /// r + J delta, from the derivatives of a carried residual.
    fn combine(&mut self, r: &Residual, carried: &Residual<Dual<1>>) {
        let blocks = |r: &mut Vec<Vec<f64>>, a: &[Vec<f64>], b: &[Vec<Dual<1>>]| {
            for ((r, a), b) in r.iter_mut().zip(a).zip(b) {
                for ((r, a), b) in r.iter_mut().zip(a).zip(b) {
                    *r = a + b.du[0];
                }
            }
        };
        blocks(&mut self.stages, &r.stages, &carried.stages);
        blocks(&mut self.jumps, &r.jumps, &carried.jumps);
        blocks(&mut self.quadratures, &r.quadratures, &carried.quadratures);
        for ((c, a), b) in self.conditions.iter_mut().zip(&r.conditions).zip(&carried.conditions) {
            *c = a + b.du[0];
        }
    }
}

/// Evaluates the residual at `z`, which may carry derivatives.
pub fn residual<P: Problem, S: Scalar>(problem: &P, disc: &Discretization, z: &[S], out: &mut Residual<S>) {
    let layout = &disc.layout;
    let gauss = &disc.gauss;
    let k = gauss.stages();
    out.stages.resize(layout.segments.len(), vec![]);
    out.quadratures.resize(layout.segments.len(), vec![]);
    out.jumps.resize(layout.segments.len(), vec![]);
    let globals = &z[disc.p()..];
    let (mut stage, mut flow, mut p) = (vec![], vec![], vec![]);
    for (s, segment) in layout.segments.iter().enumerate() {
        let (n, q) = (segment.states, segment.coupled);
        p.clear();
        p.extend(segment.parameters.iter().map(|&i| globals[i]));
        stage.clear();
        stage.resize(n, S::from(0.0));
        flow.clear();
        flow.resize(n + q, S::from(0.0));
        let r = &mut out.stages[s];
        r.clear();
        let jumps = &mut out.jumps[s];
        jumps.clear();
        let mut sums = z[disc.q(s)..disc.q(s) + q].to_vec();
        for i in 0..disc.intervals(s) {
            let (h, x0) = (disc.width(s, i), disc.meshes[s][i]);
            let (y, slopes) = (&z[disc.y(s, i)..], &z[disc.k(s, i)..disc.k(s, i) + k * n]);
            for j in 0..k {
                stage_value(&gauss.integrate[j * k..(j + 1) * k], h, y, slopes, &mut stage);
                problem.flow(s, x0 + h * gauss.nodes[j], &stage, &p, &mut flow);
                r.extend((0..n).map(|c| slopes[j * n + c] - flow[c]));
                for c in 0..q {
                    sums[c] = sums[c] - flow[n + c] * (h * gauss.weights[j]);
                }
            }
            stage_value(&gauss.weights, h, y, slopes, &mut stage);
            let next = &z[disc.y(s, i + 1)..];
            jumps.extend((0..n).map(|c| stage[c] - next[c]));
        }
        out.quadratures[s] = sums;
    }
    out.conditions.clear();
    let index = disc.slot_index();
    let mut slots = vec![];
    for i in 0..layout.conditions() {
        slots.clear();
        slots.extend(problem.condition_slots(i).iter().map(|&slot| z[index[slot]]));
        out.conditions.push(problem.condition(i, &slots));
    }
}

/// y + h sum_l w_l K_l.
#[inline(always)]
pub(super) fn stage_value<S: Scalar>(w: &[f64], h: f64, y: &[S], slopes: &[S], out: &mut [S]) {
    let n = out.len();
    out.copy_from_slice(&y[..n]);
    for (l, w) in w.iter().enumerate() {
        let a = h * w;
        for c in 0..n {
            out[c] = out[c] + slopes[l * n + c] * a;
        }
    }
}

/// The factors of one segment.
#[derive(Clone, Debug, Default)]
struct Chain {
    /// LU of M, N x (kn)^2, and its pivots.
    lu: Vec<f64>,
    pivots: Vec<usize>,
    /// J_j and J_P of (4), N x k x n x (n + m).
    jacobian: Vec<f64>,
    /// W of (5), N x (kn) x (n + q).
    adjoint: Vec<f64>,
    /// Reflections of the step that eliminates y_i, i = 1 .. N - 1.
    vectors: Vec<f64>,
    /// Rows R | E (y_0) | F (y_{i+1}) | G (P) of that step, n x (3n + m).
    rows: Vec<f64>,
    /// Factor of each row of (5), which makes the coefficients of its two ends a row of length 1, N x n.
    scale: Vec<f64>,
    /// Row combinations w R^{-1} by which y_i leaves the quadratures, q x n.
    leave: Vec<f64>,
}

/// The factorised Jacobian of the discrete problem.
#[derive(Clone, Debug)]
pub struct Linearization {
    chains: Vec<Chain>,
    /// R of the matching system, slots x slots, after [`householder`], and its reflections.
    matching: Vec<f64>,
    vectors: Vec<f64>,
    /// The matching system before factorisation, row-major; rows in the order chains (n, then q, per segment), conditions.
    pub matrix: Vec<f64>,
    slot_index: Vec<usize>,
}

/// Why a Jacobian could not be factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Singular {
    /// A stage system: the flow is not finite there, or the mesh is far too coarse.
    Stage {
        /// Segment.
        segment: usize,
        /// Interval.
        interval: usize,
    },
    /// The matching system.
    Matching,
}

/// The matching system at `z`, slots x slots, row-major: all that is left when the segments are eliminated. Rows in the order chains
/// (n, then q, per segment), conditions.
///
/// # Errors
/// [`Singular`] where a block inside a segment has no inverse, or something is not finite.
pub fn matching<P: Problem>(problem: &P, disc: &Discretization, z: &[f64]) -> Result<Vec<f64>, Singular> {
    condense(problem, disc, z, false).map(|c| c.1)
}

/// Eliminates the segments: their factors, and the matching system. With `even`, the rows between intervals are brought to one
/// length.
fn condense<P: Problem>(
    problem: &P,
    disc: &Discretization,
    z: &[f64],
    even: bool,
) -> Result<(Vec<Chain>, Vec<f64>), Singular> {
    let layout = &disc.layout;
    let size = layout.slots();
    let mut matrix = vec![0.0; size * size];
    let mut chains = Vec::with_capacity(layout.segments.len());
    let mut row = 0;
    for s in 0..layout.segments.len() {
        chains.push(Chain::eliminate(problem, disc, z, s, even, &mut matrix, &mut row)?);
    }
    let slot_index = disc.slot_index();
    let mut values = vec![];
    for i in 0..layout.conditions() {
        let slots = problem.condition_slots(i);
        for (part, chunk) in slots.chunks(LANES).enumerate() {
            values.clear();
            values.extend(slots.iter().enumerate().map(|(a, &slot)| {
                let v = z[slot_index[slot]];
                if a / LANES == part { D::variable(v, a % LANES) } else { D::from(v) }
            }));
            let b = problem.condition(i, &values);
            for (a, &slot) in chunk.iter().enumerate() {
                matrix[row * size + slot] += b.du[a];
            }
        }
        row += 1;
    }
    debug_assert_eq!(row, size);
    if matrix.iter().all(|v| v.is_finite()) { Ok((chains, matrix)) } else { Err(Singular::Matching) }
}

impl Linearization {
    /// Evaluates and factorises the Jacobian at `z`.
    ///
    /// # Errors
    /// [`Singular`] names the block that has no inverse in floating point or is not finite.
    pub fn new<P: Problem>(problem: &P, disc: &Discretization, z: &[f64]) -> Result<Self, Singular> {
        Linearization::with_rows(problem, disc, z, false)
    }

    /// The same with the rows between intervals brought to one length: on strongly graded meshes, where a mode that grows across
    /// an interval drowns the others, iterative refinement converges with these factors and not with those.
    ///
    /// # Errors
    /// As [`Linearization::new`].
    pub fn even<P: Problem>(problem: &P, disc: &Discretization, z: &[f64]) -> Result<Self, Singular> {
        Linearization::with_rows(problem, disc, z, true)
    }

    fn with_rows<P: Problem>(problem: &P, disc: &Discretization, z: &[f64], even: bool) -> Result<Self, Singular> {
        let size = disc.layout.slots();
        let (chains, matrix) = condense(problem, disc, z, even)?;
        let (mut matching, mut vectors) = (matrix.clone(), vec![0.0; size * size]);
        householder(&mut matching, size, size, size, &mut vectors);
        if (0..size).any(|i| matching[i * size + i] == 0.0) {
            return Err(Singular::Matching);
        }
        Ok(Linearization { chains, matching, vectors, matrix, slot_index: disc.slot_index() })
    }

    /// What the residual of one interval adds to the relation (5) of its ends, each row of (T, -I) scaled to length 1: where a mode
    /// grows without bound towards the right end, as towards a pole, it counts at the left one.
    pub(super) fn injected(&self, disc: &Discretization, s: usize, i: usize, residual: &Residual, out: &mut [f64]) {
        let segment = &disc.layout.segments[s];
        let (n, kn) = (segment.states, disc.gauss.stages() * segment.states);
        let width = n + segment.coupled;
        out.copy_from_slice(&residual.jumps[s][i * n..(i + 1) * n]);
        for r in 0..kn {
            let v = residual.stages[s][i * kn + r];
            for c in 0..n {
                out[c] -= self.chains[s].adjoint[(i * kn + r) * width + c] * v;
            }
        }
        let columns = n + segment.parameters.len();
        for c in 0..n {
            let mut size2 = 1.0;
            for a in 0..n {
                let identity = if a == c { 1.0 } else { 0.0 };
                let t: f64 = (0..kn)
                    .map(|r| {
                        self.chains[s].adjoint[(i * kn + r) * width + c]
                            * self.chains[s].jacobian[(i * kn + r) * columns + a]
                    })
                    .sum();
                size2 += (identity + t).powi(2);
            }
            out[c] /= size2.sqrt();
        }
    }

    /// The solution of (Jacobian at `z`) delta = -residual by iterative refinement: the factors may be those of a neighbouring
    /// state, the Jacobian is applied exactly, as the derivative of the residual along delta. It
    /// ends when a refinement changes less than `tolerance` of delta; returns that change.
    pub fn solve_refined<P: Problem>(
        &self,
        problem: &P,
        disc: &Discretization,
        z: &[f64],
        residual: &Residual,
        tolerance: f64,
        delta: &mut [f64],
    ) -> f64 {
        self.solve(disc, residual, delta);
        let largest = |v: &[f64]| v.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let mut carried = Residual::zero(disc);
        let (mut left, mut correction) = (residual.clone(), vec![0.0; delta.len()]);
        let mut change = f64::INFINITY;
        for _ in 0..REFINEMENTS {
            let along: Vec<Dual<1>> = z.iter().zip(&*delta).map(|(&re, &du)| Dual { re, du: [du] }).collect();
            super::assembly::residual(problem, disc, &along, &mut carried);
            left.combine(residual, &carried);
            self.solve(disc, &left, &mut correction);
            let next = largest(&correction) / largest(delta).max(f64::MIN_POSITIVE);
            if !(next < 0.5 * change) {
                break; // the rounding floor, or factors of too different a state
            }
            delta.iter_mut().zip(&correction).for_each(|(a, b)| *a += b);
            change = next;
            if change < tolerance {
                break;
            }
        }
        change
    }

    /// The solution of (Jacobian) delta = -residual, with the Jacobian that was factorised.
    pub fn solve(&self, disc: &Discretization, residual: &Residual, delta: &mut [f64]) {
        let size = disc.layout.slots();
        self.solve_by(disc, residual, delta, |rhs| {
            reflect(&self.vectors, size, size, rhs);
            back_substitute(&self.matching, size, size, rhs);
        });
    }

    /// The least solution, measured by the `scales` of the slots, where the matching system is singular: directions whose singular
    /// value is below `none`, relative to the largest, are left alone.
    pub fn solve_least(
        &self,
        disc: &Discretization,
        residual: &Residual,
        scales: &[f64],
        none: f64,
        delta: &mut [f64],
    ) {
        let size = disc.layout.slots();
        self.solve_by(disc, residual, delta, |rhs| {
            let mut matrix = DMatrix::from_row_slice(size, size, &self.matrix);
            matrix.column_iter_mut().zip(scales).for_each(|(mut column, scale)| column *= *scale);
            let svd = matrix.svd(true, true);
            let least = none * svd.singular_values.max();
            let solution = svd.solve(&DVector::from_column_slice(rhs), least).expect("both bases were asked for");
            rhs.iter_mut().zip(&solution).zip(scales).for_each(|((r, v), scale)| *r = v * scale);
        });
    }

    fn solve_by(
        &self,
        disc: &Discretization,
        residual: &Residual,
        delta: &mut [f64],
        match_up: impl FnOnce(&mut Vec<f64>),
    ) {
        let layout = &disc.layout;
        let size = layout.slots();
        let k = disc.gauss.stages();
        let mut rhs = vec![0.0; size];
        let mut row = 0;
        let mut kept: Vec<Vec<f64>> = Vec::with_capacity(self.chains.len());
        for (s, chain) in self.chains.iter().enumerate() {
            let (n, q) = (layout.segments[s].states, layout.segments[s].coupled);
            let (last, sums, e) = chain.reduce(disc, s, residual);
            rhs[row..row + n].copy_from_slice(&last);
            rhs[row + n..row + n + q].copy_from_slice(&sums);
            row += n + q;
            kept.push(e);
        }
        for (r, b) in rhs[row..].iter_mut().zip(&residual.conditions) {
            *r = -b;
        }
        match_up(&mut rhs);
        for (slot, v) in rhs.iter().enumerate() {
            delta[self.slot_index[slot]] = *v;
        }
        for (s, chain) in self.chains.iter().enumerate() {
            let segment = &layout.segments[s];
            let (n, m) = (segment.states, segment.parameters.len());
            let dp: Vec<f64> = segment.parameters.iter().map(|&g| delta[disc.p() + g]).collect();
            // y_{N-1} .. y_1 from the kept rows
            let cols = 3 * n + m;
            let steps = disc.intervals(s);
            let start = delta[disc.y(s, 0)..disc.y(s, 0) + n].to_vec();
            for i in (1..steps).rev() {
                let rows = &chain.rows[i * n * cols..(i + 1) * n * cols];
                let next = disc.y(s, i + 1);
                let mut v: Vec<f64> = kept[s][i * n..(i + 1) * n].to_vec();
                for r in 0..n {
                    let row = &rows[r * cols..(r + 1) * cols];
                    for c in 0..n {
                        v[r] -= row[n + c] * start[c] + row[2 * n + c] * delta[next + c];
                    }
                    for c in 0..m {
                        v[r] -= row[3 * n + c] * dp[c];
                    }
                }
                back_substitute(rows, cols, n, &mut v);
                let at = disc.y(s, i);
                delta[at..at + n].copy_from_slice(&v);
            }
            // stages by (4)
            let (kn, width) = (k * n, n + m);
            let mut b = vec![0.0; kn];
            for i in 0..steps {
                let jacobian = &chain.jacobian[i * kn * width..(i + 1) * kn * width];
                let y = disc.y(s, i);
                for r in 0..kn {
                    let row = &jacobian[r * width..(r + 1) * width];
                    let mut v = -residual.stages[s][i * kn + r];
                    for c in 0..n {
                        v += row[c] * delta[y + c];
                    }
                    for c in 0..m {
                        v += row[n + c] * dp[c];
                    }
                    b[r] = v;
                }
                lu_solve(&chain.lu[i * kn * kn..(i + 1) * kn * kn], kn, &chain.pivots[i * kn..(i + 1) * kn], &mut b);
                let at = disc.k(s, i);
                delta[at..at + kn].copy_from_slice(&b);
            }
        }
    }
}

impl Chain {
    /// Factorises segment `s` and writes its n + q rows into the matching system.
    fn eliminate<P: Problem>(
        problem: &P,
        disc: &Discretization,
        z: &[f64],
        s: usize,
        even: bool,
        matrix: &mut [f64],
        row: &mut usize,
    ) -> Result<Chain, Singular> {
        let layout = &disc.layout;
        let size = layout.slots();
        let segment = &layout.segments[s];
        let gauss = &disc.gauss;
        let (n, q, m, k) = (segment.states, segment.coupled, segment.parameters.len(), gauss.stages());
        let (kn, width, out) = (k * n, n + m, n + q);
        let steps = disc.intervals(s);
        let cols = 3 * n + m;
        let globals = disc.globals(z);
        let mut chain = Chain {
            lu: vec![0.0; steps * kn * kn],
            pivots: vec![0; steps * kn],
            jacobian: vec![0.0; steps * kn * width],
            adjoint: vec![0.0; steps * kn * out],
            vectors: vec![0.0; steps * n * 2 * n],
            rows: vec![0.0; steps * n * cols],
            scale: vec![0.0; steps * n],
            leave: vec![0.0; steps * q * n],
        };
        let mut stage = vec![0.0; n];
        let (mut y, mut p, mut f) = (vec![D::from(0.0); n], vec![D::from(0.0); m], vec![D::from(0.0); out]);
        let mut gradients = vec![0.0; k * q * width];
        // Running relation A y_0 + B y_i + C P and running quadrature rows over (y_0 | y_i | P).
        let mut relation = vec![0.0; n * (2 * n + m)];
        let mut sums = vec![0.0; q * (2 * n + m)];
        let mut transfer = vec![0.0; out * width];
        let mut stacked = vec![0.0; 2 * n * cols];
        for i in 0..steps {
            let (h, x0) = (disc.width(s, i), disc.meshes[s][i]);
            let slopes = &z[disc.k(s, i)..disc.k(s, i) + kn];
            let jacobian = &mut chain.jacobian[i * kn * width..(i + 1) * kn * width];
            for j in 0..k {
                stage_value(&gauss.integrate[j * k..(j + 1) * k], h, &z[disc.y(s, i)..], slopes, &mut stage);
                for part in 0..width.div_ceil(LANES) {
                    let seed = |a: usize, v: f64| {
                        if a / LANES == part { D::variable(v, a % LANES) } else { D::from(v) }
                    };
                    for c in 0..n {
                        y[c] = seed(c, stage[c]);
                    }
                    for c in 0..m {
                        p[c] = seed(n + c, globals[segment.parameters[c]]);
                    }
                    problem.flow(s, x0 + h * gauss.nodes[j], &y, &p, &mut f);
                    for a in part * LANES..width.min((part + 1) * LANES) {
                        for c in 0..n {
                            jacobian[(j * n + c) * width + a] = f[c].du[a % LANES];
                        }
                        for c in 0..q {
                            gradients[(j * q + c) * width + a] = f[n + c].du[a % LANES];
                        }
                    }
                }
            }
            // M of (4), then W of (5)
            let stages = &mut chain.lu[i * kn * kn..(i + 1) * kn * kn];
            let pivots = &mut chain.pivots[i * kn..(i + 1) * kn];
            for j in 0..k {
                for l in 0..k {
                    let a = h * gauss.integrate[j * k + l];
                    for r in 0..n {
                        for c in 0..n {
                            let identity = if j == l && r == c { 1.0 } else { 0.0 };
                            stages[(j * n + r) * kn + l * n + c] = identity - a * jacobian[(j * n + r) * width + c];
                        }
                    }
                }
            }
            if !lu(stages, kn, pivots) {
                return Err(Singular::Stage { segment: s, interval: i });
            }
            let adjoint = &mut chain.adjoint[i * kn * out..(i + 1) * kn * out];
            for l in 0..k {
                for c in 0..n {
                    let at = (l * n + c) * out;
                    adjoint[at + c] = h * gauss.weights[l];
                    for b in 0..q {
                        adjoint[at + n + b] = h
                            * h
                            * (0..k)
                                .map(|j| {
                                    gauss.weights[j] * gauss.integrate[j * k + l] * gradients[(j * q + b) * width + c]
                                })
                                .sum::<f64>();
                    }
                }
            }
            lu_solve_transposed(stages, kn, pivots, adjoint, out);
            // transfer = [T | U] for the states, the same for the quadratures
            transfer.fill(0.0);
            for r in 0..kn {
                for b in 0..out {
                    let w = adjoint[r * out + b];
                    for a in 0..width {
                        transfer[b * width + a] += w * jacobian[r * width + a];
                    }
                }
            }
            for c in 0..n {
                transfer[c * width + c] += 1.0;
            }
            for b in 0..q {
                for j in 0..k {
                    for a in 0..width {
                        transfer[(n + b) * width + a] += h * gauss.weights[j] * gradients[(j * q + b) * width + a];
                    }
                }
            }
            // Rows of one length: reflections mix them, and a mode that grows across an interval must not drown the others.
            for r in 0..n {
                let grown: f64 = transfer[r * width..r * width + n].iter().map(|v| v * v).sum();
                chain.scale[i * n + r] = if even { (1.0 + grown).sqrt().recip() } else { 1.0 };
            }
            let scale = &chain.scale[i * n..(i + 1) * n];
            let span = 2 * n + m;
            if i == 0 {
                // -T y_0 + y_1 - U P = c, and the quadratures on y_0
                for r in 0..n {
                    for c in 0..n {
                        relation[r * span + c] = -transfer[r * width + c] * scale[r];
                        relation[r * span + n + c] = if r == c { scale[r] } else { 0.0 };
                    }
                    for c in 0..m {
                        relation[r * span + 2 * n + c] = -transfer[r * width + n + c] * scale[r];
                    }
                }
                for b in 0..q {
                    for c in 0..n {
                        sums[b * span + c] = transfer[(n + b) * width + c];
                        sums[b * span + n + c] = 0.0;
                    }
                    for c in 0..m {
                        sums[b * span + 2 * n + c] = transfer[(n + b) * width + n + c];
                    }
                }
                continue;
            }
            for b in 0..q {
                for c in 0..n {
                    sums[b * span + n + c] += transfer[(n + b) * width + c];
                }
                for c in 0..m {
                    sums[b * span + 2 * n + c] += transfer[(n + b) * width + n + c];
                }
            }
            // columns y_i | y_0 | y_{i+1} | P
            stacked.fill(0.0);
            for r in 0..n {
                let top = &mut stacked[r * cols..(r + 1) * cols];
                top[..n].copy_from_slice(&relation[r * span + n..r * span + 2 * n]);
                top[n..2 * n].copy_from_slice(&relation[r * span..r * span + n]);
                top[3 * n..].copy_from_slice(&relation[r * span + 2 * n..(r + 1) * span]);
                let low = &mut stacked[(n + r) * cols..(n + r + 1) * cols];
                for c in 0..n {
                    low[c] = -transfer[r * width + c] * scale[r];
                }
                low[2 * n + r] = scale[r];
                for c in 0..m {
                    low[3 * n + c] = -transfer[r * width + n + c] * scale[r];
                }
            }
            let vectors = &mut chain.vectors[i * n * 2 * n..(i + 1) * n * 2 * n];
            householder(&mut stacked, 2 * n, cols, n, vectors);
            if (0..n).any(|r| stacked[r * cols + r] == 0.0) {
                return Err(Singular::Stage { segment: s, interval: i });
            }
            chain.rows[i * n * cols..(i + 1) * n * cols].copy_from_slice(&stacked[..n * cols]);
            for r in 0..n {
                let low = &stacked[(n + r) * cols..(n + r + 1) * cols];
                relation[r * span..r * span + n].copy_from_slice(&low[n..2 * n]);
                relation[r * span + n..r * span + 2 * n].copy_from_slice(&low[2 * n..3 * n]);
                relation[r * span + 2 * n..(r + 1) * span].copy_from_slice(&low[3 * n..]);
            }
            // y_i leaves the quadratures: leave R = w, row by row of R from the left
            for b in 0..q {
                let leave = &mut chain.leave[(i * q + b) * n..(i * q + b + 1) * n];
                for c in 0..n {
                    let known: f64 = (0..c).map(|r| leave[r] * stacked[r * cols + c]).sum();
                    leave[c] = (sums[b * span + n + c] - known) / stacked[c * cols + c];
                }
                for c in 0..n {
                    sums[b * span + c] -= (0..n).map(|r| leave[r] * stacked[r * cols + n + c]).sum::<f64>();
                    sums[b * span + n + c] = -(0..n).map(|r| leave[r] * stacked[r * cols + 2 * n + c]).sum::<f64>();
                }
                for c in 0..m {
                    sums[b * span + 2 * n + c] -= (0..n).map(|r| leave[r] * stacked[r * cols + 3 * n + c]).sum::<f64>();
                }
            }
        }
        let span = 2 * n + m;
        let (start, end, quadratures) = (layout.start(s), layout.end(s), layout.quadratures(s));
        for r in 0..n {
            let line = &mut matrix[*row * size..(*row + 1) * size];
            for c in 0..n {
                line[start + c] = relation[r * span + c];
                line[end + c] = relation[r * span + n + c];
            }
            for c in 0..m {
                line[layout.global(segment.parameters[c])] += relation[r * span + 2 * n + c];
            }
            *row += 1;
        }
        for b in 0..q {
            let line = &mut matrix[*row * size..(*row + 1) * size];
            line[quadratures + b] = 1.0;
            for c in 0..n {
                line[start + c] = -sums[b * span + c];
                line[end + c] = -sums[b * span + n + c];
            }
            for c in 0..m {
                line[layout.global(segment.parameters[c])] -= sums[b * span + 2 * n + c];
            }
            *row += 1;
        }
        Ok(chain)
    }

    /// Carries right-hand sides through the elimination: the last relation, the quadratures, and the kept rows of each step.
    fn reduce(&self, disc: &Discretization, s: usize, residual: &Residual) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (stages, jumps, quadratures) = (&residual.stages[s], &residual.jumps[s], &residual.quadratures[s]);
        let segment = &disc.layout.segments[s];
        let (n, q, k) = (segment.states, segment.coupled, disc.gauss.stages());
        let (kn, out) = (k * n, n + q);
        let steps = disc.intervals(s);
        let mut kept = vec![0.0; steps * n];
        let mut sums: Vec<f64> = quadratures.iter().map(|r| -r).collect();
        let mut stacked = vec![0.0; 2 * n];
        let mut last = vec![0.0; n];
        let mut c = vec![0.0; out];
        for i in 0..steps {
            c.fill(0.0);
            let adjoint = &self.adjoint[i * kn * out..(i + 1) * kn * out];
            for r in 0..kn {
                let v = stages[i * kn + r];
                for b in 0..out {
                    c[b] -= adjoint[r * out + b] * v;
                }
            }
            for b in 0..n {
                c[b] += jumps[i * n + b];
            }
            for b in 0..q {
                sums[b] += c[n + b];
            }
            c.iter_mut().zip(&self.scale[i * n..(i + 1) * n]).for_each(|(v, scale)| *v *= scale);
            if i == 0 {
                last.copy_from_slice(&c[..n]);
                continue;
            }
            stacked[..n].copy_from_slice(&last);
            stacked[n..].copy_from_slice(&c[..n]);
            reflect(&self.vectors[i * n * 2 * n..(i + 1) * n * 2 * n], 2 * n, n, &mut stacked);
            kept[i * n..(i + 1) * n].copy_from_slice(&stacked[..n]);
            last.copy_from_slice(&stacked[n..]);
            for b in 0..q {
                sums[b] += (0..n).map(|r| self.leave[(i * q + b) * n + r] * stacked[r]).sum::<f64>();
            }
        }
        (last, sums, kept)
    }
}
