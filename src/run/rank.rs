//! Whether the conditions determine the unknowns: the rank of the matching system at converged states.
//!
//! Counted is not independent. A set of conditions may close the count and still contain one that follows from the others, as
//! "axial force continuous" does where both sides reach a pole. It shows in the matching system of a converged state, where
//! everything inside the segments is eliminated and one row for each condition and one column for each slot is left: scaled, its
//! smallest singular values are compared with the largest. Only what is singular at every state examined is a property of the
//! conditions; a limit point is singular at one.

use super::{start, state};
use crate::bvp::{Linearization, Problem};
use crate::model::Model;
use crate::system::Closing;
use nalgebra::DMatrix;

/// The verdict.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rank {
    /// Number of conditions that follow from others; nothing where no state could be examined.
    pub deficiency: Option<usize>,
    /// Conditions among which one is dependent, by name.
    pub dependent: Vec<String>,
    /// Unknowns that stay free, by name.
    pub free: Vec<String>,
    /// Known conditions that would close the system.
    pub closing: Vec<String>,
    /// Smallest singular value relative to the largest, at the best of the states examined.
    pub smallest: f64,
}

/// A singular value below this, relative to the largest, is none: rounding leaves 1e-13 of a dependent row, and the most nearly
/// neutral well-posed states known (large stretch, squeezed flat) keep 1e-8.
const NONE: f64 = 1e-11;
/// A component of a null vector above this, relative to the largest, is named.
const NAMED: f64 = 0.1;

/// Examines the conditions of a model at its first states.
pub fn rank(model: &Model) -> Rank {
    let mut work = state::Work::default();
    let Ok(first) = start::first(model, &mut work) else { return Rank::default() };
    let mut system = model.system.clone();
    let layout = system.layout().clone();
    let control = model.quantities.iter().find(|q| q.name == model.branch.control).expect("the control is a quantity");
    let mut best: Option<Rank> = None;
    let (mut disc, mut z) = (first.disc.clone(), first.state.clone());
    let index = disc.slot_index();
    let here = control.formula.value(&system, &|slot| z[index[slot]]);
    // A few members of the family: the first state, and two a little further on.
    let targets = model.branch.steps.targets(here);
    let ahead = targets.get(1).or(targets.first()).map_or(0.0, |t| t - here);
    for part in [0.0, 0.3, 1.0] {
        system.closing = Closing::Value { of: control.formula.clone(), target: here + part * ahead };
        if state::solve(model, &system, &mut disc, &mut z, &[], &mut work).is_err() {
            continue;
        }
        let Ok(factors) = Linearization::new(&system, &disc, &z) else { continue };
        let size = layout.slots();
        let index = disc.slot_index();
        let globals = layout.global(0);
        let scale =
            |slot: usize| if slot < globals { 1.0 } else { system.global_scale(slot - globals, z[index[slot]]) };
        let mut matrix = DMatrix::from_row_slice(size, size, &factors.matrix);
        for c in 0..size {
            matrix.column_mut(c).scale_mut(scale(c));
        }
        for mut row in matrix.row_iter_mut() {
            let length = row.norm();
            if length > 0.0 {
                row /= length;
            }
        }
        let svd = matrix.svd(true, true);
        let (Some(u), Some(v)) = (&svd.u, &svd.v_t) else { continue };
        let largest = svd.singular_values.max();
        let smallest = svd.singular_values.min() / largest;
        let none: Vec<usize> = (0..size).filter(|&i| svd.singular_values[i] < NONE * largest).collect();
        let first_condition = size - layout.conditions();
        let mut found = Rank { deficiency: Some(none.len()), smallest, ..Rank::default() };
        for &i in &none {
            let weights: Vec<f64> = (first_condition..size).map(|r| u[(r, i)].abs()).collect();
            let most = weights.iter().fold(0.0_f64, |a, b| a.max(*b));
            for (w, entry) in weights.iter().zip(&model.ledger.conditions) {
                if *w > NAMED * most && !found.dependent.contains(&entry.name) {
                    found.dependent.push(entry.name.clone());
                }
            }
            let weights: Vec<f64> = (0..layout.globals).map(|g| v[(i, layout.global(g))].abs()).collect();
            let most = weights.iter().fold(0.0_f64, |a, b| a.max(*b));
            for (w, name) in weights.iter().zip(&model.globals) {
                if *w > NAMED * most && !found.free.contains(name) {
                    found.free.push(name.clone());
                }
            }
        }
        if best.as_ref().is_none_or(|b| found.deficiency < b.deficiency || found.smallest > b.smallest) {
            best = Some(found);
        }
    }
    best.unwrap_or_default()
}
