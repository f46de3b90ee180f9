//! Where the unknowns of the discrete problem stand, and the piecewise polynomials that they mean.

use super::{Gauss, Layout};
use std::sync::Arc;

/// All unknowns of the discrete problem in one flat vector; [`Discretization`] says where each stands.
///
/// Per segment: y at the N + 1 mesh points (row-major, n each), the stage derivatives dy/dx (N x k x n), the coupled quadratures;
/// then the globals.
pub type State = Vec<f64>;

/// Meshes and scheme: everything that turns a [`Layout`] into a finite number of unknowns.
#[derive(Clone, Debug)]
pub struct Discretization {
    /// The scheme.
    pub gauss: Arc<Gauss>,
    /// Segments and globals.
    pub layout: Layout,
    /// Mesh points of each segment, from 0 to 1, strictly increasing.
    pub meshes: Vec<Vec<f64>>,
    points: Vec<usize>,
    stages: Vec<usize>,
    quadratures: Vec<usize>,
    globals: usize,
    len: usize,
}

impl Discretization {
    /// Places the unknowns.
    pub fn new(layout: Layout, gauss: Arc<Gauss>, meshes: Vec<Vec<f64>>) -> Self {
        assert_eq!(layout.segments.len(), meshes.len());
        let (mut points, mut stages, mut quadratures) = (vec![], vec![], vec![]);
        let mut at = 0;
        for (segment, mesh) in layout.segments.iter().zip(&meshes) {
            let intervals = mesh.len() - 1;
            points.push(at);
            at += (intervals + 1) * segment.states;
            stages.push(at);
            at += intervals * gauss.stages() * segment.states;
            quadratures.push(at);
            at += segment.coupled;
        }
        let len = at + layout.globals;
        Discretization { gauss, layout, meshes, points, stages, quadratures, globals: at, len }
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.len
    }

    /// Number of intervals of a segment.
    pub fn intervals(&self, segment: usize) -> usize {
        self.meshes[segment].len() - 1
    }

    /// Number of intervals of all segments.
    pub fn total_intervals(&self) -> usize {
        (0..self.meshes.len()).map(|s| self.intervals(s)).sum()
    }

    /// Width of an interval.
    pub fn width(&self, segment: usize, interval: usize) -> f64 {
        self.meshes[segment][interval + 1] - self.meshes[segment][interval]
    }

    /// Index of y at mesh point `point` of a segment.
    pub fn y(&self, segment: usize, point: usize) -> usize {
        self.points[segment] + point * self.layout.segments[segment].states
    }

    /// Index of the stage derivatives (k x n) of an interval.
    pub fn k(&self, segment: usize, interval: usize) -> usize {
        self.stages[segment] + interval * self.gauss.stages() * self.layout.segments[segment].states
    }

    /// Index of the coupled quadratures of a segment.
    pub fn q(&self, segment: usize) -> usize {
        self.quadratures[segment]
    }

    /// Index of the first global.
    pub fn p(&self) -> usize {
        self.globals
    }

    /// The globals of a state.
    pub fn globals<'a>(&self, z: &'a [f64]) -> &'a [f64] {
        &z[self.globals..self.len]
    }

    /// Index into the state of each slot, in the order of [`Layout`].
    pub fn slot_index(&self) -> Vec<usize> {
        let mut index = Vec::with_capacity(self.layout.slots());
        for (s, segment) in self.layout.segments.iter().enumerate() {
            index.extend((0..segment.states).map(|c| self.y(s, 0) + c));
            index.extend((0..segment.states).map(|c| self.y(s, self.intervals(s)) + c));
            index.extend((0..segment.coupled).map(|c| self.q(s) + c));
        }
        index.extend((0..self.layout.globals).map(|c| self.globals + c));
        index
    }

    /// The interval of a segment that holds `x`, and the local coordinate there.
    pub fn locate(&self, segment: usize, x: f64) -> (usize, f64) {
        let mesh = &self.meshes[segment];
        let i = mesh.partition_point(|&m| m <= x).clamp(1, mesh.len() - 1) - 1;
        (i, (x - mesh[i]) / (mesh[i + 1] - mesh[i]))
    }

    /// The piecewise polynomial y at local coordinate `theta` of an interval; `out` has n values.
    pub fn interpolate(&self, z: &[f64], segment: usize, interval: usize, theta: f64, out: &mut [f64]) {
        let n = self.layout.segments[segment].states;
        let (y, k) = (self.y(segment, interval), self.k(segment, interval));
        let h = self.width(segment, interval);
        out.copy_from_slice(&z[y..y + n]);
        for l in 0..self.gauss.stages() {
            let a = h * self.gauss.integral(l, theta);
            for c in 0..n {
                out[c] += a * z[k + l * n + c];
            }
        }
    }

    /// A state from functions: `y(segment, x, out)` and the globals. Stage derivatives are those of the interpolant of y
    /// through the mesh points and stages of each interval; quadratures start at 0.
    pub fn sample(&self, globals: &[f64], y: impl Fn(usize, f64, &mut [f64])) -> State {
        let mut z = vec![0.0; self.len];
        let k = self.gauss.stages();
        for (s, segment) in self.layout.segments.iter().enumerate() {
            let n = segment.states;
            let (mut left, mut right) = (vec![0.0; n], vec![0.0; n]);
            for i in 0..=self.intervals(s) {
                let at = self.y(s, i);
                y(s, self.meshes[s][i], &mut z[at..at + n]);
            }
            for i in 0..self.intervals(s) {
                let (x, h, at) = (self.meshes[s][i], self.width(s, i), self.k(s, i));
                for j in 0..k {
                    let d = 1e-3 * h;
                    let theta = x + h * self.gauss.nodes[j];
                    y(s, theta - d, &mut left);
                    y(s, theta + d, &mut right);
                    for c in 0..n {
                        z[at + j * n + c] = (right[c] - left[c]) / (2.0 * d);
                    }
                }
            }
        }
        z[self.globals..].copy_from_slice(globals);
        z
    }

    /// The same functions on the mesh of another discretization of the same layout.
    pub fn transfer(&self, z: &[f64], to: &Discretization) -> State {
        let mut out = vec![0.0; to.len];
        let k = self.gauss.stages();
        for (s, segment) in self.layout.segments.iter().enumerate() {
            let n = segment.states;
            for (i, &x) in to.meshes[s].iter().enumerate() {
                let (interval, theta) = self.locate(s, x);
                let at = to.y(s, i);
                self.interpolate(z, s, interval, theta, &mut out[at..at + n]);
            }
            for i in 0..to.intervals(s) {
                for j in 0..to.gauss.stages() {
                    let x = to.meshes[s][i] + to.width(s, i) * to.gauss.nodes[j];
                    let (interval, theta) = self.locate(s, x);
                    let (from, at) = (self.k(s, interval), to.k(s, i) + j * n);
                    for l in 0..k {
                        let v = self.gauss.value(l, theta);
                        for c in 0..n {
                            out[at + c] += v * z[from + l * n + c];
                        }
                    }
                }
            }
            let (from, at) = (self.q(s), to.q(s));
            out[at..at + segment.coupled].copy_from_slice(&z[from..from + segment.coupled]);
        }
        out[to.globals..].copy_from_slice(&z[self.globals..]);
        out
    }
}
