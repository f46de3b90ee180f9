//! A state as formulas see it: the value of every probe, on numbers that carry directions.

use super::{Carried, ERROR};
use crate::bvp::{Discretization, Estimate, quadratures_along, value_at};
use crate::model::Model;
use crate::physics::material::Energy;
use crate::physics::membrane::Local;
use crate::physics::tip;
use crate::scalar::Scalar;
use crate::system::{Coordinate, Field, Formula, Kind, Probe, Side, System, tip_coefficient};
use std::cell::OnceCell;

/// A state and what has been computed of it.
pub struct View<'a> {
    /// The problem.
    pub model: &'a Model,
    /// Its equations, with what is given in this state.
    pub system: &'a System,
    /// Mesh and scheme.
    pub disc: &'a Discretization,
    state: Vec<Carried>,
    slots: Vec<usize>,
    reported: Vec<Vec<Carried>>,
    largest_radius: OnceCell<Carried>,
}

impl<'a> View<'a> {
    /// Evaluates the quadratures of a state; with an estimate, the error direction holds what they miss, too.
    pub fn new(
        model: &'a Model,
        system: &'a System,
        disc: &'a Discretization,
        state: Vec<Carried>,
        estimate: Option<&Estimate>,
    ) -> Self {
        let slots = disc.slot_index();
        let mut view = View { model, system, disc, state, slots, reported: vec![], largest_radius: OnceCell::new() };
        for (s, piece) in system.pieces.iter().enumerate() {
            let coupled = piece.kind.coupled();
            let mut all = vec![Carried::from(0.0); coupled + piece.reported()];
            quadratures_along(system, disc, &|i| view.state[i], s, &mut all);
            if let Some(estimate) = estimate {
                for (sum, missed) in all.iter_mut().zip(&estimate.quadratures[s]) {
                    sum.du[ERROR] += missed;
                }
            }
            let mut reported = all.split_off(coupled);
            let side = match piece.coordinate {
                Coordinate::FromTip(_) => Some(Side::Start),
                Coordinate::ToTip(_) => Some(Side::End),
                _ => None,
            };
            if let Some(local) = side.and_then(|side| view.end(s, side)) {
                for (sum, tail) in reported.iter_mut().zip(piece.tip_tail(&local)) {
                    *sum = *sum + tail;
                }
            }
            view.reported.push(reported);
        }
        view
    }

    /// The value of a slot.
    pub fn slot(&self, slot: usize) -> Carried {
        self.state[self.slots[slot]]
    }

    /// The value of a global.
    pub fn global(&self, g: usize) -> Carried {
        self.state[self.disc.p() + g]
    }

    /// An unknown of the discrete problem.
    pub fn unknown(&self, i: usize) -> Carried {
        self.state[i]
    }

    /// The membrane at an end of a piece; nothing at a pole.
    pub fn end(&self, s: usize, side: Side) -> Option<Local<Carried>> {
        let system = self.system;
        let piece = &system.pieces[s];
        if piece.coordinate.is_pole(side) {
            return None;
        }
        let at = match side {
            Side::Start => self.disc.y(s, 0),
            Side::End => self.disc.y(s, self.disc.intervals(s)),
        };
        let x = if side == Side::Start { 0.0 } else { 1.0 };
        Some(self.local(s, x, &self.state[at..at + piece.states()]))
    }

    /// The membrane on a piece at x with states `y`.
    pub fn local(&self, s: usize, x: f64, y: &[Carried]) -> Local<Carried> {
        let system = self.system;
        let piece = &system.pieces[s];
        piece.local(&system.reference, &system.law, self.eta(s, x), y)
    }

    /// eta on a piece at x.
    pub fn eta(&self, s: usize, x: f64) -> Carried {
        let piece = &self.system.pieces[s];
        let p: Vec<Carried> = piece.parameters().iter().map(|&g| self.global(g)).collect();
        let (a, b) = piece.places(&p);
        piece.coordinate.at(x, a, b).0
    }

    /// Axial position of the apex of the face under a piece; zero where it lies on none.
    pub fn apex(&self, s: usize) -> Carried {
        let body = self.model.bodies.iter().find(|body| body.pieces.contains(&s));
        body.and_then(|body| self.value(&body.h)).unwrap_or(Carried::from(0.0))
    }

    /// A reported quadrature of a piece.
    pub fn reported(&self, s: usize, q: usize) -> Carried {
        self.reported[s][q]
    }

    fn probe(&self, probe: &Probe) -> Option<Carried> {
        match *probe {
            Probe::Reported(s, q) => Some(self.reported(s, q)),
            Probe::LargestRadius => Some(*self.largest_radius.get_or_init(|| self.find_largest_radius())),
            Probe::TipCoefficient(s, side) => self.tip_coefficient(s, side),
            Probe::Reading(i) => self.read(&self.model.readings[i]),
            Probe::Absent => None,
            Probe::End(s, side, field) if self.is_infinite_field(s, side, field) => None,
            Probe::End(s, side, Field::ContactPressure) if self.is_tip(s, side) => {
                Some(self.system.pieces[s].pressure.value(&|g| self.global(g)))
            }
            _ => Some(probe.value(self.system, &|slot| self.slot(slot))),
        }
    }

    /// The value of a formula; nothing where a part of it does not exist or is infinite by nature.
    pub fn value(&self, formula: &Formula) -> Option<Carried> {
        let mut exists = true;
        let value = formula.with(|probe| {
            self.probe(probe).unwrap_or_else(|| {
                exists = false;
                Carried::from(0.0)
            })
        });
        exists.then_some(value)
    }

    /// True if a formula depends on something that is infinite at a tip.
    pub fn is_infinite(&self, formula: &Formula) -> bool {
        formula.probes().any(|p| match *p {
            Probe::End(s, side, field) => self.is_infinite_field(s, side, field),
            // Largest at a tip is largest without bound.
            Probe::Reading(i) => self.read(&self.model.readings[i]).is_none(),
            _ => false,
        })
    }

    fn is_tip(&self, s: usize, side: Side) -> bool {
        matches!(
            (self.system.pieces[s].coordinate, side),
            (Coordinate::FromTip(_), Side::Start) | (Coordinate::ToTip(_), Side::End)
        )
    }

    fn is_infinite_field(&self, s: usize, side: Side, field: Field) -> bool {
        let locks = self.system.law.locking().is_some();
        self.is_tip(s, side)
            && match field {
                Field::W | Field::TensionL | Field::TensionM => true,
                Field::ContactPressure => self.end(s, side).is_some_and(|m| tip::presses_without_bound(&m)),
                Field::Lambda | Field::Mu => !locks,
                _ => false,
            }
    }

    /// Fields that are infinite at the tips of this state.
    pub fn infinite(&self) -> Vec<String> {
        let mut names = vec![];
        for (s, piece) in self.system.pieces.iter().enumerate() {
            for (side, end) in [(Side::Start, "start"), (Side::End, "end")] {
                for (field, name) in [
                    (Field::Lambda, "lambda"),
                    (Field::Mu, "mu"),
                    (Field::W, "w"),
                    (Field::TensionL, "w_l"),
                    (Field::TensionM, "w_m"),
                    (Field::ContactPressure, "p_c"),
                ] {
                    if self.is_infinite_field(s, side, field) {
                        names.push(format!("{}.{end}.{name}", piece.name));
                    }
                }
            }
        }
        names
    }

    /// C of a neo-Hookean membrane: from the tip of a cone, or the stretch of a pole on a plane.
    fn tip_coefficient(&self, s: usize, side: Side) -> Option<Carried> {
        let system = self.system;
        let Kind::Contact(face) = &system.pieces[s].kind else { return None };
        if !system.law.is_neo_hookean() {
            return None;
        }
        if system.pieces[s].coordinate.is_pole(side) {
            let at = self.disc.y(s, if side == Side::Start { 0 } else { self.disc.intervals(s) });
            return Some(self.state[at].exp());
        }
        if !self.is_tip(s, side) {
            return None;
        }
        // Read in the middle of the piece: what it starts with wrongly has decayed, and the reference shape is still flat.
        let eta = self.eta(s, 0.5);
        let inwards = if side == Side::Start { eta } else { -eta };
        // phi = 2 exp(eta) near the pole.
        let ln_phi = inwards + std::f64::consts::LN_2;
        let (interval, theta) = self.disc.locate(s, 0.5);
        let ln_lambda = value_at(system, self.disc, &|i| self.state[i], s, interval, theta)?[0];
        let (mut ln_c, missed) = tip_coefficient(face.tip_inclination().cos(), ln_phi, ln_lambda)?;
        ln_c.du[ERROR] += missed;
        Some(ln_c.exp())
    }

    /// The largest radius: at an end of a piece, or inside a free one where the tangent is vertical.
    fn find_largest_radius(&self) -> Carried {
        let system = self.system;
        let mut best = Carried::from(0.0);
        let mut consider = |u: Carried| {
            if u.re > best.re {
                best = u;
            }
        };
        for (s, piece) in system.pieces.iter().enumerate() {
            let n = piece.states();
            for side in [Side::Start, Side::End] {
                if let Some(m) = self.end(s, side) {
                    consider(m.u());
                }
            }
            if !matches!(piece.kind, Kind::Free) {
                continue;
            }
            let tau = |i: usize| self.state[self.disc.y(s, i) + 2].re;
            let vertical = std::f64::consts::FRAC_PI_2;
            for i in 0..self.disc.intervals(s) {
                if (tau(i) - vertical) * (tau(i + 1) - vertical) >= 0.0 {
                    continue;
                }
                // Where the polynomial is vertical; the radius is stationary there, so the place need not be exact.
                let at = |theta: f64| self.interpolate(s, i, theta, n);
                let rising = tau(i + 1) > tau(i);
                let (mut a, mut b) = (0.0, 1.0);
                for _ in 0..60 {
                    let m = 0.5 * (a + b);
                    if (at(m)[2].re > vertical) == rising { b = m } else { a = m }
                }
                let theta = 0.5 * (a + b);
                let y = value_at(system, self.disc, &|i| self.state[i], s, i, theta).unwrap_or_else(|| at(theta));
                let x = self.disc.meshes[s][i] + theta * self.disc.width(s, i);
                consider(self.local(s, x, &y).u());
            }
        }
        best
    }

    /// The piecewise polynomial with its directions.
    pub fn interpolate(&self, s: usize, i: usize, theta: f64, n: usize) -> Vec<Carried> {
        let (y, k) = (self.disc.y(s, i), self.disc.k(s, i));
        let h = self.disc.width(s, i);
        (0..n)
            .map(|c| {
                (0..self.disc.gauss.stages()).fold(self.state[y + c], |v, l| {
                    v + self.state[k + l * n + c] * (h * self.disc.gauss.integral(l, theta))
                })
            })
            .collect()
    }
}
