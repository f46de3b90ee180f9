//! One state: Newton, estimate, mesh, until every quantity is as accurate as asked.

use crate::bvp::{
    Discretization, Effort, Estimate, Failure, Linearization, Newton, Residual, equidistribute, residual, rounding,
};
use crate::model::Model;
use crate::solution::Solution;
use crate::system::System;
use std::sync::Arc;

/// Work spent on a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Newton corrections and factorisations.
    pub effort: Effort,
    /// Intervals of the final mesh.
    pub intervals: usize,
    /// Processor time of this thread, seconds.
    pub cpu_seconds: f64,
}

/// Why a state was not reached.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Halt {
    /// Newton's method failed; the largest residuals by name.
    #[error("{failure}{}", worst.iter().map(|w| format!("; {w}")).collect::<String>())]
    Newton {
        /// What happened.
        failure: Failure,
        /// The largest residuals of conditions, by name.
        worst: Vec<String>,
    },
    /// The mesh grew to its limit before the error was small enough.
    #[error(
        "the accuracy asked for was not reached: `{quantity}` is known to {error:.1e} only, on {intervals} intervals"
    )]
    Accuracy {
        /// The quantity with the largest relative error.
        quantity: String,
        /// Its estimated error.
        error: f64,
        /// Intervals used.
        intervals: usize,
    },
}

/// Most intervals of all segments together.
const MOST_INTERVALS: usize = 3000;
/// Rounds of refinement.
const ROUNDS: usize = 9;
/// Meshes are made for this accuracy even where less is asked for: it costs little.
const LOOSEST: f64 = 1e-8;
/// The part of the accuracy asked for that a mesh is made for ..
const AIM: f64 = 0.03;
/// .. that it is still good for, so that most states of a branch need no new one ..
const GOOD: f64 = 0.15;
/// .. and below which it is finer than needed.
const WASTE: f64 = 0.003;

/// Newton's parameters for an accuracy.
pub(super) fn newton(accuracy: f64) -> Newton {
    Newton { tolerance: (1e-3 * accuracy).clamp(1e-13, 1e-9), limit: 30 }
}

/// Solves for the state that `system` closes, from `z` on `disc` (`typical`: magnitudes of the quantities, for those that vanish), and refines the mesh until every quantity is accurate, as far as
/// the mesh can make it: what rounding adds is in the errors of the solution, and may exceed what was asked.
///
/// # Errors
/// [`Halt`]; `z` and `disc` then are those of the last attempt.
pub(super) fn solve(
    model: &Model,
    system: &System,
    disc: &mut Arc<Discretization>,
    z: &mut Vec<f64>,
    typical: &[f64],
    work: &mut Work,
) -> Result<Solution, Halt> {
    let newton = newton(model.accuracy);
    let mut before = f64::INFINITY;
    for round in 0..ROUNDS {
        let mut effort = Effort::default();
        let mut kept = None;
        let result = newton.solve(system, disc, z, &mut kept, &mut effort);
        work.effort += effort;
        result.map_err(|failure| Halt::Newton { failure, worst: largest_residuals(model, system, disc, z) })?;
        // The estimate is as good as the factors it is solved with: renew those of an early iterate.
        let factors = match kept.filter(|_| effort.factorisations == 1 && effort.iterations <= 5) {
            Some(factors) => factors,
            None => {
                work.effort.factorisations += 1;
                Linearization::new(system, disc, z)
                    .map_err(|_| Halt::Newton { failure: Failure::Singular, worst: vec![] })?
            }
        };
        let estimate = Estimate::new(system, disc, z, &factors);
        let noise = rounding(system, disc, z, &factors);
        let tangent = tangent(system, disc, z, &factors);
        let solution = Solution::read(model, disc, z, &tangent, &estimate, &noise);
        work.intervals = disc.total_intervals();
        let error = solution.worst_discretisation(model.accuracy.min(LOOSEST), typical);
        let (total, which) = solution.worst_error(model.accuracy, typical);
        if error <= GOOD {
            if error < WASTE && disc.total_intervals() > 3 * disc.meshes.len() {
                remesh(disc, z, &estimate, (error / AIM).max(1e-6));
            }
            return Ok(solution);
        }
        let intervals = disc.total_intervals();
        if round + 1 == ROUNDS || intervals > MOST_INTERVALS || !(error < before * 100.0 || error.is_infinite()) {
            if total <= 1.0 {
                return Ok(solution);
            }
            return Err(too_coarse(model, &solution, which, disc));
        }
        before = error;
        remesh(disc, z, &estimate, (error / AIM).min(1e12));
    }
    unreachable!("the last round returns")
}

fn remesh(disc: &mut Arc<Discretization>, z: &mut Vec<f64>, estimate: &Estimate, factor: f64) {
    let meshes = equidistribute(disc, estimate, factor, 2);
    let next = Discretization::new(disc.layout.clone(), disc.gauss.clone(), meshes);
    *z = disc.transfer(z, &next);
    *disc = Arc::new(next);
}

fn too_coarse(model: &Model, solution: &Solution, which: usize, disc: &Discretization) -> Halt {
    let error = solution.quantities[which].map_or(f64::NAN, |m| m.error);
    Halt::Accuracy { quantity: model.quantities[which].name.clone(), error, intervals: disc.total_intervals() }
}

/// Derivative of all unknowns with respect to the value of the closing condition.
fn tangent(system: &System, disc: &Discretization, z: &[f64], factors: &Linearization) -> Vec<f64> {
    let mut rhs = Residual::zero(disc);
    *rhs.conditions.last_mut().expect("a closing condition") = -1.0;
    let mut delta = vec![0.0; disc.unknowns()];
    factors.solve_refined(system, disc, z, &rhs, 1e-9, &mut delta);
    delta
}

/// The largest residuals of the conditions, by the names of the ledger.
fn largest_residuals(model: &Model, system: &System, disc: &Discretization, z: &[f64]) -> Vec<String> {
    let mut r = Residual::default();
    residual(system, disc, z, &mut r);
    let mut all: Vec<(f64, String)> = r
        .conditions
        .iter()
        .zip(&model.ledger.conditions)
        .map(|(v, e)| (v.abs(), e.name.clone()))
        .chain(r.stages.iter().zip(&model.system.pieces).map(|(v, p)| {
            (
                v.iter().fold(0.0, |a: f64, b| if b.abs() > a || b.is_nan() { b.abs() } else { a }),
                format!("equilibrium of {}", p.name),
            )
        }))
        .filter(|(v, _)| !(*v < 1e-9))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let said = |(v, name): (f64, String)| {
        if v.is_finite() { format!("`{name}` misses by {v:.1e}") } else { format!("`{name}` is not finite") }
    };
    all.into_iter().take(3).map(said).collect()
}
