//! What happens on a branch: limit points, stops, and elements of the meridian that appear or vanish.

use super::emerge;
use super::outcome::Event;
use super::start::at_pole;
use super::state;
use super::trace::{Stop, Tracer};
use crate::bvp::{Discretization, Problem, uniform};
use crate::model::{Change, Model, When};
use crate::physics::surface::Generator;
use crate::solution::{Solution, profile};
use crate::system::{Closing, Field, Formula, Kind, Place, Probe, Side};
use std::sync::Arc;

/// What is watched for an event, relative to its next value, is zero below this in the state in which a stage begins.
const FRESH: f64 = 1e-6;
/// A contact at a pole that is smaller than this, in initial radii, is a point.
const POINT: f64 = 1e-3;

impl Tracer {
    pub(super) fn happen(&mut self, kind: &'static str, of: String, stage_after: String, solution: Solution) {
        let (stage_before, model) = (self.model.stage(), self.model.clone());
        self.outcome.events.push(Event { kind, of, stage_before, stage_after, solution, model });
    }

    /// Limit points and stops between two states, in the order of the control.
    pub(super) fn events(&mut self, a: &Solution, b: &Solution) -> Result<Vec<(&'static str, String, Solution)>, Stop> {
        let model = self.model.clone();
        let mut found = vec![];
        let (ca, cb) = (self.value(a), self.value(b));
        for name in &model.branch.limit_points {
            let Some(q) = model.quantities.iter().position(|q| q.name == *name) else { continue };
            if q == self.control {
                continue; // met as a turn of the control itself
            }
            let slope = |s: &Solution| s.quantity(q).map(|m| m.slope / self.rate(s));
            if let (Some(sa), Some(sb)) = (slope(a), slope(b))
                && sa * sb < 0.0
                && let Some(s) = self.extremum(q, a, b)
            {
                found.push(("fold", name.clone(), s));
            }
        }
        for (name, formula) in &model.branch.stops {
            let g = |s: &Solution| Some(on_slots(&model, formula, s));
            if let (Some(ga), Some(gb)) = (g(a), g(b))
                && ga * gb < 0.0
            {
                let s = self.between(a, b, g, 1e-15).ok_or(Stop::Astray)?;
                found.push(("end", name.clone(), s));
            }
        }
        // Where the branch ends a quantity may end with a double zero: that is no limit point.
        let ends: Vec<f64> = found.iter().filter(|f| f.0 == "end").map(|f| self.value(&f.2)).collect();
        found.retain(|f| f.0 != "fold" || ends.iter().all(|e| (self.value(&f.2) - e).abs() > 1e-6 * e.abs()));
        // Wrinkles: the least tension changes its sign.
        let least = |s: &Solution| Some(s.certificate.least_tension).filter(|w| w.is_finite());
        if let (Some(wa), Some(wb)) = (least(a), least(b))
            && wa * wb < 0.0
            && let Some(s) = self.between(a, b, least, 1e-6)
        {
            found.push(("wrinkling", "least tension".into(), s));
        }
        found.sort_by(|x, y| ((self.value(&x.2) - ca) / (cb - ca)).total_cmp(&((self.value(&y.2) - ca) / (cb - ca))));
        Ok(found)
    }

    /// The first change of the elements of the meridian between two states, and the state in which it happens.
    pub(super) fn change(&mut self, a: &Solution, b: &Solution) -> Result<Option<(Change, Solution)>, Stop> {
        let model = self.model.clone();
        let (ca, cb) = (self.value(a), self.value(b));
        let mut first: Option<(f64, Change, Solution)> = None;
        for change in &model.changes {
            let onwards = (cb - ca).signum();
            let control = self.control;
            let rate = |s: &Solution| s.quantity(control).map_or(1.0, |q| q.slope);
            let g = |s: &Solution| match change.when {
                // The motion of a place per step of the branch.
                When::Motion(place, sense) => Some(sense * onwards * s.tangent[s.disc.p() + place] / rate(s)),
                _ => watched(&model, change, s),
            };
            let (Some(ga), Some(gb)) = (g(a), g(b)) else { continue };
            // A new contact has no length yet; it is undone only after it has had some. Neither is a touch believed where the stage
            // has just begun with the lift-off.
            let fresh = self.entered && self.history.len() == 1 && ga.abs() < FRESH * gb.abs();
            let begun = self.history.len() == 1;
            // What happens in the first of both states itself: the branch has turned, or nothing holds from the start.
            let at_once = match change.when {
                When::Motion(..) => ga < 0.0 && !(self.entered && begun),
                When::Exceeded(_) => gb > 0.0 && ga.abs() < FRESH * gb.abs() && !self.entered,
                _ => false,
            };
            if at_once {
                return Ok(Some((change.clone(), a.clone())));
            }
            let crossed = match change.when {
                When::Exceeded(_) => ga < 0.0 && gb > 0.0 && !fresh,
                When::Motion(..) => ga > 0.0 && gb < 0.0,
                When::Formula(_) => ga * gb < 0.0 && !fresh,
                When::Length(_) => ga > 1e-9 && gb < 0.0,
                When::Pressure(_) => ga > 0.0 && gb < 0.0,
            };
            if crossed {
                let s = self.between(a, b, g, 1e-14).ok_or(Stop::Astray)?;
                let t = (self.value(&s) - ca) / (cb - ca);
                if first.as_ref().is_none_or(|f| t < f.0) {
                    first = Some((t, change.clone(), s));
                }
            }
        }
        Ok(first.map(|(_, change, s)| (change, s)))
    }

    /// True if an element of the meridian appears or vanishes between two states.
    pub(super) fn passes(&self, a: &Solution, b: &Solution) -> bool {
        self.model.changes.iter().any(|change| {
            let g = |s: &Solution| watched(&self.model, change, s);
            let (Some(ga), Some(gb)) = (g(a), g(b)) else { return false };
            match change.when {
                When::Formula(_) | When::Exceeded(_) => ga * gb < 0.0,
                When::Length(_) | When::Pressure(_) => ga > 1e-9 && gb < 0.0,
                When::Motion(..) => false,
            }
        })
    }

    /// Goes on from a state in another stage.
    pub(super) fn enter(&mut self, model: Model, from: &Solution) -> Result<(), Stop> {
        let c = self.value(from);
        if let Some(piece) = emerge::emerging(&self.model, &model) {
            return self.emerge(model, from, piece);
        }
        if emerge::emerging(&model, &self.model).is_some() {
            return self.submerge(model, from, c);
        }
        let (mut disc, mut z) = carry(&self.model, from, &model);
        self.model = Arc::new(model);
        self.system = self.model.system.clone();
        let of = self.model.quantities[self.control].formula.clone();
        self.system.closing = Closing::Value { of, target: c };
        let solution = state::solve(&self.model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work)
            .map_err(Stop::Halt)?;
        self.history = vec![solution];
        self.entered = true;
        Ok(())
    }
}

impl Tracer {
    /// The material angle of the joint that a change concerns.
    pub(super) fn joint_angle(&self, change: &Change, s: &Solution) -> f64 {
        let place =
            self.model.edges.iter().find(|e| e.name == change.of).map(|e| self.model.system.pieces[e.before].to);
        match place {
            Some(Place::Unknown(g)) => self.model.system.reference.phi(s.disc.globals(&s.state)[g]),
            _ => 0.0,
        }
    }
}

/// The value of a formula of slots at a state.
pub(super) fn on_slots(model: &Model, formula: &Formula, s: &Solution) -> f64 {
    let index = s.disc.slot_index();
    formula.value(&model.system, &|slot| s.state[index[slot]])
}

/// What is watched for a change, at a state.
fn watched(model: &Model, change: &Change, s: &Solution) -> Option<f64> {
    match &change.when {
        When::Formula(formula) | When::Exceeded(formula) => Some(on_slots(model, formula, s)),
        When::Motion(..) => None,
        When::Length(piece) => {
            let globals = s.disc.globals(&s.state);
            let at = |place: Place| match place {
                Place::Unknown(g) => Some(globals[g]),
                Place::Fixed(eta) => Some(eta),
                Place::Pole => None,
            };
            let p = &model.system.pieces[*piece];
            if at_pole(p) {
                // A contact at a pole that is undone shrinks to a point.
                let side = if p.to == Place::Pole { Side::Start } else { Side::End };
                let index = s.disc.slot_index();
                let u = Probe::End(*piece, side, Field::U).value(&model.system, &|slot| s.state[index[slot]]);
                return Some(u / model.initial.radius - POINT);
            }
            Some(at(p.to)? - at(p.from)?)
        }
        When::Pressure(piece) => {
            let name = &model.system.pieces[*piece].name;
            profile(model, s).iter().filter(|r| r.segment == *name).filter_map(|r| r.p_c).reduce(f64::min)
        }
    }
}

/// A state of one stage as a first approximation in another: pieces and unknowns of the same name keep what they have; a piece
/// that appears has no length, at the end of the piece before it.
fn carry(old: &Model, s: &Solution, new: &Model) -> (Arc<Discretization>, Vec<f64>) {
    let same = |name: &str| old.system.pieces.iter().position(|p| p.name == name);
    let pieces = &new.system.pieces;
    let meshes =
        pieces.iter().map(|p| same(&p.name).map_or_else(|| uniform(2), |o| s.disc.meshes[o].clone())).collect();
    let disc = Discretization::new(new.system.layout().clone(), s.disc.gauss.clone(), meshes);
    let mut z = vec![0.0; disc.unknowns()];
    let old_globals = s.disc.globals(&s.state);
    let place = |place: Place| match place {
        Place::Unknown(g) => old_globals[g],
        Place::Fixed(eta) => eta,
        Place::Pole => 0.0,
    };
    for (i, piece) in pieces.iter().enumerate() {
        if let Some(o) = same(&piece.name) {
            let from = s.disc.y(o, 0)..s.disc.q(o) + s.disc.layout.segments[o].coupled;
            z[disc.y(i, 0)..disc.q(i) + disc.layout.segments[i].coupled].copy_from_slice(&s.state[from]);
            continue;
        }
        let Some(o) = i.checked_sub(1).and_then(|b| same(&pieces[b].name)) else { continue };
        let end = s.disc.y(o, s.disc.intervals(o));
        let n = piece.states().min(old.system.pieces[o].states());
        // Of no length, at the place of a face where the membrane just touches it.
        let before = &old.system.pieces[o];
        let p: Vec<f64> = before.parameters().iter().map(|&g| old_globals[g]).collect();
        let y = &s.state[end..end + before.states()];
        let m = before.local(&old.system.reference, &old.system.law, before.places(&p).1, y);
        for point in 0..=disc.intervals(i) {
            let at = disc.y(i, point);
            z[at..at + n].copy_from_slice(&s.state[end..end + n]);
            if let Kind::Contact(face) = &piece.kind {
                let t = face.surface.at_radius(m.u()).unwrap_or(0.0);
                z[at + 1] = face.state(t, m.rho0);
            }
        }
    }
    for (g, name) in new.globals.iter().enumerate() {
        let at = disc.p() + g;
        if let Some(o) = old.globals.iter().position(|n| n == name) {
            z[at] = old_globals[o];
            continue;
        }
        for (i, piece) in pieces.iter().enumerate() {
            let before = i.checked_sub(1).and_then(|b| same(&pieces[b].name));
            if piece.to == Place::Unknown(g)
                && let Some(o) = same(&piece.name)
            {
                z[at] = place(old.system.pieces[o].to);
            } else if piece.from == Place::Unknown(g)
                && let Some(o) = same(&piece.name)
            {
                z[at] = place(old.system.pieces[o].from);
            } else if *name == format!("{}.start.h", piece.name)
                && let Some(o) = before
            {
                // Where the piece before it ends: its start, and its fall.
                let start = old.globals.iter().position(|n| *n == format!("{}.start.h", old.system.pieces[o].name));
                z[at] = start.map_or(0.0, |g| old_globals[g]) + s.state[s.disc.q(o)];
            }
        }
    }
    (Arc::new(disc), z)
}
