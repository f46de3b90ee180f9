//! Whether the conditions determine the unknowns: the rank of the matching system at converged states.
//!
//! Counted is not independent. A set of conditions may close the count and still contain one that follows from the others, as
//! "axial force continuous" does where both sides reach a pole. It shows in the matching system of a converged state, where
//! everything inside the segments is eliminated and one row for each condition and one column for each slot is left: scaled, its
//! smallest singular values are compared with the largest. Only what is singular at every state examined is a property of the
//! conditions; a limit point is singular at one.
//!
//! Where the conditions leave something free no state can be solved for with them. Then the initial state, known in closed form, is
//! examined, a known condition is sought that closes the system, and the members of the family that it selects are examined with
//! the conditions as written.

use super::{start, state};
use crate::bvp::{Discretization, Problem, matching};
use crate::model::Model;
use crate::physics::surface::Surface;
use crate::scalar::Dual;
use crate::system::{Closing, Formula, Kind, System};
use nalgebra::DMatrix;
use std::sync::Arc;

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
    /// True if what stays free is a neutral translation: the whole membrane may stand anywhere on the axis, and nothing else changes.
    pub neutral: bool,
    /// Declared unknowns that the conditions keep at one value all along the branch, with that value.
    pub forced: Vec<(String, f64)>,
    /// Smallest singular value relative to the largest, at the best of the states examined.
    pub smallest: f64,
}

/// A singular value below this, relative to the largest, is none. The states are converged to better than 1e-10, and so far is a
/// dependent row from being one; the first states of well-posed problems keep 1e-6 and more.
const NONE: f64 = 1e-9;
/// A component of a null vector above this, relative to the largest, is named.
const NAMED: f64 = 0.1;
/// A condition whose derivative along the free direction exceeds this, relative to its size, closes the system.
const CLOSES: f64 = 1e-6;
/// An unknown that changes less, relative to the control, does not change.
const CHANGES: f64 = 1e-9;

/// The slots' magnitudes, if the conditions are dependent at a state within a `tolerance`.
pub(super) fn singular(system: &System, disc: &Arc<Discretization>, z: &[f64], tolerance: f64) -> Option<Vec<f64>> {
    let found = examine(system, &Member { disc: disc.clone(), z: z.to_vec() })?;
    (found.smallest < tolerance).then_some(found.scales)
}

/// A state at which the conditions are examined.
struct Member {
    disc: Arc<Discretization>,
    z: Vec<f64>,
}

/// What is found at one state.
struct Finding {
    none: Vec<usize>,
    smallest: f64,
    rows: DMatrix<f64>,
    columns: DMatrix<f64>,
    scales: Vec<f64>,
}

/// Examines the conditions of a model.
pub fn rank(model: &Model) -> Rank {
    let mut system = model.system.clone();
    let control =
        &model.quantities.iter().find(|q| q.name == model.branch.control).expect("the control is a quantity").formula;
    system.closing = Closing::Value { of: control.clone(), target: 0.0 };
    let mut work = state::Work::default();
    let touching = model.system.pieces.iter().any(|p| matches!(p.kind, Kind::Contact(_)));
    // With a contact it is nearly a state only; what depends on each other everywhere shows there, too.
    let initial = (model.initial.stretch > 1.0).then(|| {
        let contact = if touching { start::FIRST_CONTACTS[0] } else { 0.0 };
        let (disc, z) = start::sample(model, model.initial.stretch, contact, start::FINER);
        Member { disc, z }
    });
    let mut members: Vec<Member> = vec![];
    if let Ok(first) = start::first(model, &mut work) {
        members = family(model, &system, control, Member { disc: first.disc.clone(), z: first.state.clone() });
    }
    if members.is_empty() {
        // No state with the conditions as they are: look where they leave something free.
        let Some(initial) = initial else { return Rank::default() };
        let Some(found) = examine(&system, &initial) else { return Rank::default() };
        if touching && found.none.is_empty() {
            return Rank::default();
        }
        // Independent at one state is independent.
        let closing = if found.none.is_empty() { vec![] } else { closing(model, &system, &initial, &found) };
        let replaced = dependent_row(model, &found);
        let substitute = closing.iter().find_map(|&i| {
            let mut closed = system.clone();
            closed.conditions[replaced] = model.known_conditions[i].1.clone();
            let start = Member { disc: initial.disc.clone(), z: initial.z.clone() };
            let members = family(model, &closed, control, start);
            (!members.is_empty()).then_some(members)
        });
        members.push(initial);
        members.extend(substitute.into_iter().flatten());
    }
    let findings: Vec<(Finding, &Member)> =
        members.iter().filter_map(|m| examine(&system, m).map(|f| (f, m))).collect();
    let best =
        findings.iter().min_by(|a, b| a.0.none.len().cmp(&b.0.none.len()).then(b.0.smallest.total_cmp(&a.0.smallest)));
    let Some((found, member)) = best else { return Rank::default() };
    let mut rank = Rank { deficiency: Some(found.none.len()), smallest: found.smallest, ..Rank::default() };
    let layout = system.layout();
    let first = layout.slots() - layout.conditions();
    for &i in &found.none {
        let rows = (0..layout.conditions()).map(|c| found.rows[(first + c, i)]);
        let names = model.ledger.conditions.iter().map(|e| e.name.as_str());
        name(rows.zip(names), &mut rank.dependent);
        let columns = (0..layout.globals).map(|g| found.columns[(i, layout.global(g))]);
        name(columns.zip(model.globals.iter().map(String::as_str)), &mut rank.free);
    }
    rank.neutral = !found.none.is_empty() && found.none.iter().all(|&i| is_translation(model, &system, found, i));
    if !found.none.is_empty() {
        rank.closing =
            closing(model, &system, member, found).into_iter().map(|i| model.known_conditions[i].0.clone()).collect();
    } else if members.len() > 1 {
        rank.forced = forced(model, &members);
    }
    rank
}

/// True if a free direction moves the membrane along the axis without a change of its shape: only axial positions have a part in it.
fn is_translation(model: &Model, system: &System, found: &Finding, i: usize) -> bool {
    let layout = system.layout();
    let mut axial: Vec<usize> = vec![];
    for (s, piece) in system.pieces.iter().enumerate() {
        let height = match &piece.kind {
            Kind::Free if piece.follows_height() => Some(3),
            // On the side of a cylinder the place is an axial position.
            Kind::Contact(face) if matches!(face.surface, Surface::Cylinder(_)) => Some(1),
            _ => None,
        };
        axial.extend(height.into_iter().flat_map(|c| [layout.start(s) + c, layout.end(s) + c]));
    }
    let starts = (0..layout.globals).filter(|&g| model.globals[g].ends_with(".start.h"));
    axial.extend(starts.map(|g| layout.global(g)));
    let size = |axially: bool| {
        let slots = (0..layout.slots()).filter(|s| axial.contains(s) == axially);
        slots.map(|s| (found.columns[(i, s)] * found.scales[s]).abs()).fold(0.0, f64::max)
    };
    size(false) < CLOSES * size(true)
}

/// Up to three states of a system, from a state near it.
fn family(model: &Model, system: &System, control: &Formula, start: Member) -> Vec<Member> {
    let mut work = state::Work::default();
    let (mut disc, mut z) = (start.disc, start.z);
    let index = disc.slot_index();
    let here = control.value(system, &|slot| z[index[slot]]);
    let targets = model.branch.steps.targets(here);
    let ahead = targets.get(1).or(targets.first()).map_or(0.0, |t| t - here);
    let mut members = vec![];
    for part in [0.0, 0.3, 1.0] {
        let mut system = system.clone();
        system.closing = Closing::Value { of: control.clone(), target: here + part * ahead };
        if state::solve(model, &mut system, &mut disc, &mut z, &[], &mut work).is_ok() {
            members.push(Member { disc: disc.clone(), z: z.clone() });
        }
    }
    members
}

/// Magnitude of each slot.
fn scales(system: &System, member: &Member) -> Vec<f64> {
    let layout = system.layout();
    let index = member.disc.slot_index();
    let globals = layout.global(0);
    let scale =
        |slot: usize| if slot < globals { 1.0 } else { system.global_scale(slot - globals, member.z[index[slot]]) };
    (0..layout.slots()).map(scale).collect()
}

fn examine(system: &System, member: &Member) -> Option<Finding> {
    let size = system.layout().slots();
    let raw = matching(system, &member.disc, &member.z).ok()?;
    let scales = scales(system, member);
    let mut matrix = DMatrix::from_row_slice(size, size, &raw);
    for (c, scale) in scales.iter().enumerate() {
        matrix.column_mut(c).scale_mut(*scale);
    }
    for mut row in matrix.row_iter_mut() {
        let length = row.norm();
        if length > 0.0 {
            row /= length;
        }
    }
    let svd = matrix.svd(true, true);
    let largest = svd.singular_values.max();
    let none = (0..size).filter(|&i| svd.singular_values[i] < NONE * largest).collect();
    Some(Finding { none, smallest: svd.singular_values.min() / largest, rows: svd.u?, columns: svd.v_t?, scales })
}

/// Known conditions that change along the free directions, by their place in the model.
fn closing(model: &Model, system: &System, member: &Member, found: &Finding) -> Vec<usize> {
    let index = member.disc.slot_index();
    let along = |formula: &Formula, i: usize| {
        // Derivative along the free direction, and the size of the gradient.
        let value = formula.value(system, &|slot| Dual::<1> {
            re: member.z[index[slot]],
            du: [found.columns[(i, slot)] * found.scales[slot]],
        });
        let gradient: f64 = formula
            .slots()
            .iter()
            .map(|&s| {
                let one =
                    |slot| Dual::<1> { re: member.z[index[slot]], du: [if slot == s { found.scales[s] } else { 0.0 }] };
                formula.value(system, &one).du[0].powi(2)
            })
            .sum();
        value.du[0].abs() > CLOSES * gradient.sqrt()
    };
    (0..model.known_conditions.len())
        .filter(|&c| found.none.iter().any(|&i| along(&model.known_conditions[c].1, i)))
        .collect()
}

/// The condition to do without: the one that the file writes itself, among the dependent ones, or the one with the largest part.
fn dependent_row(model: &Model, found: &Finding) -> usize {
    let layout = model.system.layout();
    let first = layout.slots() - layout.conditions();
    let count = model.system.conditions.len();
    let weight = |c: usize| found.none.iter().map(|&i| found.rows[(first + c, i)].abs()).fold(0.0, f64::max);
    let most = (0..count).map(weight).fold(0.0, f64::max);
    let written = |c: usize| {
        let origin = &model.ledger.conditions[c].origin;
        origin.contains("Conditions") || origin.contains("Joint)") || origin == "constraint"
    };
    let candidates = (0..count).filter(|&c| weight(c) > NAMED * most);
    candidates.max_by(|&a, &b| written(a).cmp(&written(b)).then(weight(a).total_cmp(&weight(b)))).unwrap_or(0)
}

/// Names the large components of a null vector.
fn name<'a>(components: impl Iterator<Item = (f64, &'a str)>, names: &mut Vec<String>) {
    let all: Vec<(f64, &str)> = components.map(|(v, n)| (v.abs(), n)).collect();
    let most = all.iter().fold(0.0_f64, |a, b| a.max(b.0));
    for (v, n) in all {
        if v > NAMED * most && !names.iter().any(|m| m == n) {
            names.push(n.to_owned());
        }
    }
}

/// Declared unknowns that are the same in all members.
fn forced(model: &Model, members: &[Member]) -> Vec<(String, f64)> {
    let value = |m: &Member, g: usize| m.disc.globals(&m.z)[g];
    let control = |m: &Member| {
        let index = m.disc.slot_index();
        let q = model.quantities.iter().find(|q| q.name == model.branch.control).expect("the control is a quantity");
        q.formula.value(&model.system, &|slot| m.z[index[slot]])
    };
    let (a, b) = (&members[0], &members[members.len() - 1]);
    let moved = (control(b) - control(a)).abs();
    let declared = model.problem.unknowns.keys().filter(|n| **n != model.branch.control);
    declared
        .filter_map(|name| {
            let g = model.globals.iter().position(|n| n == name)?;
            let (va, vb) = (value(a, g), value(b, g));
            (moved > 0.0 && (vb - va).abs() < CHANGES * moved).then(|| (name.clone(), vb))
        })
        .collect()
}
