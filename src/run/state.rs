//! One state: Newton, estimate, mesh, until every quantity is as accurate as asked.

use crate::bvp::{
    Discretization, Effort, Estimate, Failure, Linearization, Newton, Residual, equidistribute, residual, rounding,
};
use crate::model::Model;
use crate::solution::Solution;
use crate::system::{Renewed, System, renew, rests};
use std::sync::Arc;

/// Work spent on a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Work {
    /// Newton corrections and factorisations.
    pub effort: Effort,
    /// Intervals of the final mesh.
    pub intervals: usize,
    /// Processor time of all threads, seconds.
    pub cpu_seconds: f64,
    /// The part of it that other threads than the one that solves have spent.
    pub elsewhere: f64,
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
    /// The field of a charged membrane and its shape do not settle.
    #[error(
        "the field of the charged membrane and its shape do not settle: the repulsion is too strong for the tension"
    )]
    Field,
}

/// Most intervals of all segments together.
const MOST_INTERVALS: usize = 1000;
/// Rounds of refinement.
const ROUNDS: usize = 9;
/// A mesh is not made coarser by more than this at once.
const LEAST_WASTE: f64 = 1e-4;
/// A change by the last refinement of a tangent above this tells that its factors are not good enough.
const REFINED: f64 = 1e-6;
/// Times that the field of a charged membrane is brought up to date on one mesh.
const SWEEPS: usize = 12;
/// What is left of a change of that field counts as nothing below this part of the accuracy asked for, relative to the tension over
/// the radius.
const SETTLED: f64 = 1e-2;
/// Meshes are made for this accuracy even where less is asked for, where it costs little.
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

/// Solves for the state that `system` closes, as [`solve_given`]. Where the membrane repels itself, its field is brought up to date
/// until it is that of the state, and then kept in `system`.
///
/// # Errors
/// [`Halt`]; `z` and `disc` then are those of the last attempt.
pub(super) fn solve(
    model: &Model,
    system: &mut System,
    disc: &mut Arc<Discretization>,
    z: &mut Vec<f64>,
    typical: &[f64],
    work: &mut Work,
) -> Result<Solution, Halt> {
    if !system.repels() {
        return solve_given(model, system, disc, z, typical, work);
    }
    let tension = model.initial.tension.abs().max(f64::MIN_POSITIVE);
    let enough = SETTLED * model.accuracy * tension / model.initial.radius;
    if system.pieces.iter().any(|piece| piece.repulsion.as_ref().is_some_and(|r| r.rest.is_none())) {
        // The field of a shape that its mesh does not resolve yet is no guide.
        solve_given(model, system, disc, z, typical, work)?;
    }
    let mut refinement = Refinement { thrifty: true, ..Refinement::default() };
    iterate(model, system, disc, z, &mut None, work)?;
    let accurate = |solution: &Solution| solution.worst_error(model.accuracy, typical).0 <= 1.0;
    let (mut sweeps, mut before) = (0, None);
    loop {
        let Some((rests, elsewhere)) = rests(system, disc, z) else { return Err(Halt::Field) };
        work.elsewhere += elsewhere;
        let Renewed { change, left, grain } = renew(system, rests, before, enough);
        sweeps += 1;
        // The mesh is judged at every sweep: on one that is too coarse the field need not settle.
        match refinement.round(model, system, disc, z, typical, work)? {
            Some(solution) if left <= enough && (left <= grain || accurate(&solution)) => return Ok(solution),
            Some(_) if sweeps == SWEEPS => return Err(Halt::Field),
            Some(_) => before = Some(change),
            None => {
                iterate(model, system, disc, z, &mut None, work)?;
                (sweeps, before) = (0, None);
            }
        }
    }
}

/// Solves for the state that `system` closes, from `z` on `disc` (`typical`: magnitudes of the quantities, for those that vanish),
/// and refines the mesh until every quantity is accurate, as far as the mesh can make it: what rounding adds is in the errors of
/// the solution, and may exceed what was asked.
///
/// # Errors
/// [`Halt`]; `z` and `disc` then are those of the last attempt.
fn solve_given(
    model: &Model,
    system: &System,
    disc: &mut Arc<Discretization>,
    z: &mut Vec<f64>,
    typical: &[f64],
    work: &mut Work,
) -> Result<Solution, Halt> {
    let mut refinement = Refinement::default();
    loop {
        if let Some(solution) = refinement.round(model, system, disc, z, typical, work)? {
            return Ok(solution);
        }
    }
}

/// Newton's iteration on one mesh, and what it took.
fn iterate(
    model: &Model,
    system: &System,
    disc: &Discretization,
    z: &mut Vec<f64>,
    kept: &mut Option<Linearization>,
    work: &mut Work,
) -> Result<Effort, Halt> {
    let mut effort = Effort::default();
    let result = newton(model.accuracy).solve(system, disc, z, kept, &mut effort);
    work.effort += effort;
    match result {
        Ok(()) => Ok(effort),
        Err(failure) => Err(Halt::Newton { failure, worst: largest_residuals(model, system, disc, z) }),
    }
}

/// The rounds of refinement for one state.
#[derive(Default)]
struct Refinement {
    /// True where each node of a mesh is dear: one that is finer than needed is made coarser in the first round.
    thrifty: bool,
    rounds: usize,
    /// The error of the round before.
    before: Option<f64>,
}

impl Refinement {
    /// Solves on a mesh. The solution if it is accurate enough, or as accurate as any mesh makes it; nothing where the mesh was
    /// refined.
    fn round(
        &mut self,
        model: &Model,
        system: &System,
        disc: &mut Arc<Discretization>,
        z: &mut Vec<f64>,
        typical: &[f64],
        work: &mut Work,
    ) -> Result<Option<Solution>, Halt> {
        let mut kept = None;
        let effort = iterate(model, system, disc, z, &mut kept, work)?;
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
        let solution = Solution::read(model, system, disc, z, &tangent, &estimate, &noise);
        work.intervals = disc.total_intervals();
        let wanted = if self.thrifty { model.accuracy } else { model.accuracy.min(LOOSEST) };
        let error = solution.worst_discretisation(wanted, typical);
        let (total, which) = solution.worst_error(model.accuracy, typical);
        let waste = solution.worst_of_mesh(wanted, typical);
        if self.thrifty && self.rounds == 0 && waste < WASTE && disc.total_intervals() > 3 * disc.meshes.len() {
            self.rounds += 1;
            remesh(disc, z, &estimate, (waste / AIM).max(LEAST_WASTE).sqrt());
            return Ok(None);
        }
        if error <= GOOD {
            return Ok(Some(solution));
        }
        let stuck = self.before.is_some_and(|before| !(error < before * 100.0 || error.is_infinite()));
        if self.rounds + 1 == ROUNDS || disc.total_intervals() > MOST_INTERVALS || stuck {
            if total <= 1.0 {
                return Ok(Some(solution));
            }
            return Err(too_coarse(model, &solution, which, disc));
        }
        self.rounds += 1;
        self.before = Some(error);
        remesh(disc, z, &estimate, (error / AIM).min(1e12));
        Ok(None)
    }
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
    let change = factors.solve_refined(system, disc, z, &rhs, 1e-9, &mut delta);
    if !(change < REFINED)
        && let Ok(even) = Linearization::even(system, disc, z)
    {
        even.solve_refined(system, disc, z, &rhs, 1e-9, &mut delta);
    }
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
