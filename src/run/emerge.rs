//! Contacts that appear or vanish at a pole.
//!
//! At its event such a contact is a point, which is no state of the equations: the first state behind it has a small contact, whose
//! radius is prescribed instead of the control. The membrane of the state before the event is taken over place by place.

use super::start::{FIRST_CONTACTS, SMALL, at_pole, grades, single};
use super::state::{self, Halt};
use super::trace::{Stop, Tracer};
use crate::bvp::{Discretization, Problem, quadratures_along, uniform};
use crate::model::Model;
use crate::physics::surface::Generator;
use crate::solution::Solution;
use crate::system::{Closing, Field, Kind, Piece, Place, Probe, Side};
use std::sync::Arc;

/// Intervals of a contact that appears, and of a free piece that it cuts.
const OF_CONTACT: usize = 2;
const OF_FREE: usize = 10;
/// The least radius of a first contact, in initial radii.
const LEAST: f64 = 2e-3;

/// The pieces of contact at a pole that only one of two stages has.
pub(super) fn emerging(old: &Model, new: &Model) -> Option<usize> {
    let known = |p: &Piece| old.system.pieces.iter().any(|o| o.name == p.name);
    let pieces = &new.system.pieces;
    (0..pieces.len()).find(|&i| matches!(pieces[i].kind, Kind::Contact(_)) && at_pole(&pieces[i]) && !known(&pieces[i]))
}

impl Tracer {
    /// Goes on with a contact that appears at a pole.
    pub(super) fn emerge(&mut self, model: Model, from: &Solution, piece: usize) -> Result<(), Stop> {
        let old = self.model.clone();
        let Kind::Contact(face) = &model.system.pieces[piece].kind else { return Err(Stop::Astray) };
        let most = SMALL * face.surface.straight() / model.initial.radius;
        let side = if model.system.pieces[piece].to == Place::Pole { Side::Start } else { Side::End };
        self.model = Arc::new(model);
        let mut failed = None;
        for contact in FIRST_CONTACTS {
            let radius = contact.min(most) * self.model.initial.radius;
            let (mut disc, mut z) = taken_over(&old, from, &self.model, radius);
            self.system = self.model.system.clone();
            let of = single(&self.system, Probe::End(piece, side, Field::U));
            self.system.closing = Closing::Value { of, target: radius };
            let model = self.model.clone();
            match state::solve(&model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work) {
                Ok(first) => {
                    let first = self.shrunk(first, piece, side, radius);
                    return self.begin_at(first);
                }
                Err(halt) => failed = failed.or(Some(halt)),
            }
        }
        Err(failed.map_or(Stop::Astray, Stop::Halt))
    }

    /// The same with a contact that is as small as can be, so that little of the branch behind the event is left out.
    fn shrunk(&mut self, first: Solution, piece: usize, side: Side, radius: f64) -> Solution {
        let model = self.model.clone();
        let mut best = first;
        let mut radius = radius;
        while radius > 4.0 * LEAST * model.initial.radius {
            radius *= 0.25;
            let of = single(&self.system, Probe::End(piece, side, Field::U));
            self.system.closing = Closing::Value { of, target: radius };
            let (mut disc, mut z) = (best.disc.clone(), best.state.clone());
            match state::solve(&model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work) {
                Ok(smaller) => best = smaller,
                Err(_) => break,
            }
        }
        best
    }

    /// Goes on without a contact that has vanished at a pole.
    pub(super) fn submerge(&mut self, model: Model, from: &Solution, c: f64) -> Result<(), Stop> {
        let (mut disc, mut z) = taken_over(&self.model, from, &model, 0.0);
        self.model = Arc::new(model);
        self.system = self.model.system.clone();
        let of = self.model.quantities[self.control].formula.clone();
        self.system.closing = Closing::Value { of, target: c };
        let model = self.model.clone();
        let first = state::solve(&model, &mut self.system, &mut disc, &mut z, &self.typical, &mut self.work);
        self.history = vec![first.map_err(Stop::Halt)?];
        self.entered = true;
        Ok(())
    }

    /// Begins the stage with a state that something else than the control closed.
    fn begin_at(&mut self, first: Solution) -> Result<(), Stop> {
        let c = self.value(&first);
        self.history = vec![first];
        let again: Result<Solution, Halt> = self.at(c);
        self.history = vec![again.map_err(Stop::Halt)?];
        self.entered = true;
        Ok(())
    }
}

/// The membrane of a state of one stage on meshes of another, in which contacts at poles that the first does not have are of a radius.
fn taken_over(old: &Model, s: &Solution, new: &Model, radius: f64) -> (Arc<Discretization>, Vec<f64>) {
    let (olds, news) = (&old.system, &new.system);
    let reference = &olds.reference;
    let known = |name: &str| olds.pieces.iter().position(|p| p.name == name);
    let old_globals = s.disc.globals(&s.state);
    let parameters =
        |piece: &Piece, globals: &[f64]| -> Vec<f64> { piece.parameters().iter().map(|&g| globals[g]).collect() };
    let old_eta = |p: usize, x: f64| {
        let piece = &olds.pieces[p];
        let (a, b) = piece.places(&parameters(piece, old_globals));
        piece.coordinate.at(x, a, b).0
    };
    // ln(lambda), radius and tangent angle at a material point of the old stage, and h where it is a state.
    let membrane = |eta: f64| -> [f64; 4] {
        let last = olds.pieces.len() - 1;
        let p = (0..last).find(|&p| eta <= old_eta(p, 1.0)).unwrap_or(last);
        let (mut a, mut b) = (0.0, 1.0);
        for _ in 0..100 {
            let m = 0.5 * (a + b);
            if old_eta(p, m) < eta { a = m } else { b = m }
        }
        let piece = &olds.pieces[p];
        let (interval, theta) = s.disc.locate(p, 0.5 * (a + b));
        let mut y = [0.0; 4];
        s.disc.interpolate(&s.state, p, interval, theta, &mut y[..piece.states()]);
        let m = piece.local(reference, &olds.law, eta, &y[..piece.states()]);
        [y[0], m.u(), m.sin.atan2(m.cos), if matches!(piece.kind, Kind::Free) { y[3] } else { 0.0 }]
    };
    let meshes: Vec<Vec<f64>> = news
        .pieces
        .iter()
        .map(|piece| match (known(&piece.name), &piece.kind) {
            (None, _) => uniform(OF_CONTACT),
            (Some(_), Kind::Free) => grades(piece, uniform(OF_FREE)),
            (Some(o), _) => s.disc.meshes[o].clone(),
        })
        .collect();
    let disc = Discretization::new(news.layout().clone(), s.disc.gauss.clone(), meshes);
    let mut globals = vec![0.0; new.globals.len()];
    for (g, name) in new.globals.iter().enumerate() {
        let same = old.globals.iter().position(|n| n == name);
        let by_piece = news.pieces.iter().find_map(|piece| {
            let o = known(&piece.name)?;
            let place = if piece.from == Place::Unknown(g) {
                olds.pieces[o].from
            } else if piece.to == Place::Unknown(g) {
                olds.pieces[o].to
            } else {
                return None;
            };
            if let Place::Unknown(old) = place { Some(old_globals[old]) } else { None }
        });
        globals[g] = same.map(|o| old_globals[o]).or(by_piece).unwrap_or(0.0);
    }
    for piece in news.pieces.iter().filter(|p| known(&p.name).is_none() && at_pole(p)) {
        let pole = if piece.from == Place::Pole { f64::NEG_INFINITY } else { f64::INFINITY };
        let stretch = membrane(pole.clamp(-30.0, 30.0))[0].exp();
        let eta = reference.eta(radius / (stretch * reference.radius()));
        match (piece.from, piece.to) {
            (Place::Pole, Place::Unknown(g)) => globals[g] = eta,
            (Place::Unknown(g), _) => globals[g] = -eta,
            _ => {}
        }
    }
    let exact = |i: usize, x: f64, y: &mut [f64]| {
        let piece = &news.pieces[i];
        let (a, b) = piece.places(&parameters(piece, &globals));
        let eta = piece.coordinate.at(x.clamp(1e-12, 1.0 - 1e-12), a, b).0;
        let rho0 = reference.at(eta).rho0;
        let [ln_lambda, u, tau, h] = membrane(eta);
        y[0] = ln_lambda;
        match &piece.kind {
            Kind::Free => {
                (y[1], y[2]) = ((u / rho0).ln(), tau);
                if y.len() > 3 {
                    y[3] = h;
                }
            }
            Kind::Contact(face) => y[1] = face.state(face.surface.at_radius(u).unwrap_or(0.0), rho0),
        }
    };
    let mut z = disc.sample(&globals, exact);
    for (i, piece) in news.pieces.iter().enumerate() {
        if piece.kind.coupled() > 0 {
            let mut q = [0.0; 2];
            quadratures_along(news, &disc, &|k| z[k], i, &mut q);
            let at = disc.q(i);
            z[at..at + 2].copy_from_slice(&q);
        }
    }
    (Arc::new(disc), z)
}
