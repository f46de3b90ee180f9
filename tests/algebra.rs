//! The elimination that solves every Newton step against an independent witness: the whole Jacobian, assembled from exact
//! derivatives of the residual and solved by faer's sparse QR.

mod common;

use common::{read, resolve, run, with};
use faer::prelude::*;
use faer::sparse::{SparseColMat, Triplet};
use membrane::bvp::{Discretization, Gauss, Layout, Linearization, Problem, Residual, Segment, residual, uniform};
use membrane::scalar::{Dual, Scalar};
use std::sync::Arc;

/// Directions differentiated in one pass.
const LANES: usize = 8;

/// The solution of (Jacobian at z) delta = -residual by faer.
fn witness<P: Problem>(problem: &P, disc: &Discretization, z: &[f64], r: &Residual) -> Vec<f64> {
    let size = disc.unknowns();
    let mut triplets = vec![];
    let mut carried: Residual<Dual<LANES>> = Residual::zero(disc);
    for first in (0..size).step_by(LANES) {
        let along: Vec<Dual<LANES>> = (0..size)
            .map(|i| Dual { re: z[i], du: std::array::from_fn(|lane| f64::from(u8::from(i == first + lane))) })
            .collect();
        residual(problem, disc, &along, &mut carried);
        for (row, v) in carried.iter().enumerate() {
            for lane in 0..LANES.min(size - first) {
                if v.du[lane] != 0.0 {
                    triplets.push(Triplet::new(row, first + lane, v.du[lane]));
                }
            }
        }
    }
    let jacobian = SparseColMat::<usize, f64>::try_new_from_triplets(size, size, &triplets).unwrap();
    let right: Vec<f64> = r.iter().map(|v| -v).collect();
    assert_eq!(right.len(), size);
    let solution = jacobian.sp_qr().unwrap().solve(faer::Col::from_fn(size, |i| right[i]));
    (0..size).map(|i| solution[i]).collect()
}

/// Largest difference of our solution from the witness's, relative to its largest number: as eliminated, with iterative
/// refinement, and with that on rows of one length.
fn disagreement<P: Problem>(problem: &P, disc: &Discretization, z: &[f64]) -> [f64; 3] {
    let mut r = Residual::default();
    residual(problem, disc, z, &mut r);
    let factors = Linearization::new(problem, disc, z).unwrap();
    let [mut eliminated, mut refined, mut even] = std::array::from_fn(|_| vec![0.0; disc.unknowns()]);
    factors.solve(disc, &r, &mut eliminated);
    factors.solve_refined(problem, disc, z, &r, 1e-14, &mut refined);
    let rows = Linearization::even(problem, disc, z).unwrap();
    rows.solve_refined(problem, disc, z, &r, 1e-14, &mut even);
    let theirs = witness(problem, disc, z, &r);
    let largest = theirs.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(largest > 1e-6, "a step to compare");
    [eliminated, refined, even]
        .map(|ours| ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest)
}

/// Wright's problem (SIAM J. Sci. Comput. 14, 1993): elimination with row interchanges grows like exp of the length here.
struct Wright {
    layout: Layout,
    slots: Vec<usize>,
}

const LENGTH: f64 = 60.0;

impl Problem for Wright {
    fn layout(&self) -> &Layout {
        &self.layout
    }
    fn flow<S: Scalar>(&self, _: usize, _: f64, y: &[S], _: &[S], out: &mut [S]) {
        out[0] = (y[0] * (-1.0 / 6.0) + y[1]) * LENGTH;
        out[1] = (y[0] - y[1] * (1.0 / 6.0)) * LENGTH;
    }
    fn condition_slots(&self, _: usize) -> &[usize] {
        &self.slots
    }
    fn condition<S: Scalar>(&self, i: usize, v: &[S]) -> S {
        v[i] + v[2 + i] - S::from(1.0)
    }
}

#[test]
fn a_problem_that_defeats_row_interchanges() {
    let segment = Segment { states: 2, coupled: 0, reported: 0, parameters: vec![] };
    let layout = Layout { segments: vec![segment], globals: 0 };
    let problem = Wright { layout: layout.clone(), slots: vec![0, 1, 2, 3] };
    let disc = Discretization::new(layout, Arc::new(Gauss::new(4)), vec![uniform(200)]);
    // Both are stable: what is left is the rounding of some thousand operations.
    let left = disagreement(&problem, &disc, &vec![0.0; disc.unknowns()]);
    assert!(left.iter().all(|v| *v < 1e-12), "{left:?}");
}

#[test]
fn the_membrane_between_plates_and_under_a_cone() {
    for (file, settings, at) in [
        ("problems/flat_plates.ron", vec![], ("hbar", 0.5)),
        ("problems/cone_on_flat.ron", vec![("accuracy", "1e-6")], ("dbar", 0.5)),
    ] {
        let model = resolve(&with(&read(file), &settings));
        let outcome = run(&model, Some(at));
        let solution = &outcome.points[0].solution;
        // Away from the solution, by a different amount for every unknown.
        let z: Vec<f64> = solution.state.iter().enumerate().map(|(i, v)| v * (1.0 + 1e-4 * (i as f64).sin())).collect();
        let left = disagreement(&model.system, &solution.disc, &z);
        println!("{file}: {} unknowns, {left:?}", z.len());
        // Near a tip the few long intervals span many orders of magnitude: eliminating them costs digits, which one
        // refinement with the same factors brings back.
        assert!(left[0] < 1e-8 && left[1] < 1e-12 && left[2] < 1e-12, "{file}: {left:?}");
    }
}
