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
/// The part of the accuracy asked for that the mesh is made for: a state next to it needs no new mesh.
const AIM: f64 = 0.02;

/// Newton's parameters for an accuracy.
pub(super) fn newton(accuracy: f64) -> Newton {
    Newton { tolerance: (1e-3 * accuracy).clamp(1e-13, 1e-9), limit: 30 }
}

/// Solves for the state that `system` closes, from `z` on `disc`, and refines the mesh until every quantity is accurate.
///
/// # Errors
/// [`Halt`]; `z` and `disc` then are those of the last attempt.
pub(super) fn solve(
    model: &Model,
    system: &System,
    disc: &mut Arc<Discretization>,
    z: &mut Vec<f64>,
    work: &mut Work,
) -> Result<Solution, Halt> {
    let newton = newton(model.accuracy);
    let power = 0.5 / disc.gauss.stages() as f64;
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
        let (worst, which) = solution.worst_error(model);
        let rounded =
            solution.quantities[which].is_some_and(|q| q.error < 1e-9 * q.value.abs() && before < 3.0 * worst);
        if worst <= AIM * 5.0 || (worst <= 1.0 && rounded) {
            if worst < AIM * 1e-4 && disc.total_intervals() > 12 {
                // Far better than asked: a coarser mesh for the states to come.
                let factor = (worst.max(1e-9) / (0.1 * AIM)).powf(power).max(0.7);
                let meshes = equidistribute(disc, &estimate, factor, 2);
                let next = Discretization::new(disc.layout.clone(), disc.gauss.clone(), meshes);
                *z = disc.transfer(z, &next);
                *disc = Arc::new(next);
            }
            return Ok(solution);
        }
        let local = estimate.largest_local();
        let factor = ((worst / AIM).powf(power) * 1.1).clamp(1.0, if local > 1e-2 { 2.0 } else { 4.0 });
        let intervals = (factor * disc.total_intervals() as f64) as usize;
        if round + 1 == ROUNDS || intervals > MOST_INTERVALS || !worst.is_finite() {
            if worst <= 1.0 {
                return Ok(solution);
            }
            let q = &model.quantities[which];
            let error = solution.quantities[which].map_or(f64::NAN, |m| m.error);
            return Err(Halt::Accuracy { quantity: q.name.clone(), error, intervals: disc.total_intervals() });
        }
        before = worst;
        let meshes = equidistribute(disc, &estimate, factor, 2);
        let next = Discretization::new(disc.layout.clone(), disc.gauss.clone(), meshes);
        *z = disc.transfer(z, &next);
        *disc = Arc::new(next);
    }
    unreachable!("the last round returns")
}

/// Derivative of all unknowns with respect to the value of the closing condition.
fn tangent(system: &System, disc: &Discretization, z: &[f64], factors: &Linearization) -> Vec<f64> {
    let mut rhs = Residual::zero(disc);
    *rhs.conditions.last_mut().expect("a closing condition") = -1.0;
    let mut delta = vec![0.0; disc.unknowns()];
    factors.solve_refined(system, disc, z, &rhs, &mut delta);
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
    all.into_iter().take(3).map(|(v, name)| format!("`{name}` misses by {v:.1e}")).collect()
}
