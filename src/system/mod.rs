//! The bridge: a membrane between rigid bodies as a boundary-value problem.
//!
//! Here, and nowhere else, the physics and the numerics meet. A [`System`] is the list of pieces of the meridian in walking
//! order, the named globals, and the conditions, each a formula over [`Probe`]s. What the pieces and conditions are is decided
//! above ([`crate::model`]); how the discrete problem is solved, below ([`crate::bvp`]).
//!
//! States of a piece: ln(lambda), ln(mu), and on a free piece tau. The axial position needs no state: its increment is a quadrature
//! of a free piece, and on a face it follows from the radius.

mod charge;
mod coordinate;
mod field;
mod load;
mod piece;
mod probe;
mod repulsion;
mod tip;

pub use charge::{Renewed, continue_field, renew, rests};
pub use coordinate::{Coordinate, Place, tip_length};
pub use field::{FieldFormula, Reading, What};
pub use load::{Component, Load, Site, Variable, along};
pub use piece::{Kind, LOADS_AT, MOST_LOADS, Piece, Pressure};
pub use probe::{Field, Probe, Side};
pub use repulsion::{Image, Repulsion, Rest};
pub use tip::coefficient as tip_coefficient;

use crate::bvp::{Layout, Problem, Segment};
use crate::expr::Tape;
use crate::physics::material::Law;
use crate::physics::reference::Reference;
use crate::scalar::Scalar;

/// A formula over probes. As a condition it must vanish.
#[derive(Clone, Debug)]
pub struct Formula {
    tape: Tape,
    probes: Vec<Probe>,
    slots: Vec<usize>,
}

/// What closes the problem: the last condition, which moves along a branch.
#[derive(Clone, Debug)]
pub enum Closing {
    /// A condition (a quantity) has a value.
    Value {
        /// The quantity.
        of: Formula,
        /// Its value.
        target: f64,
    },
    /// Pseudo-arclength: the sum of direction times slot has a value.
    Arc {
        /// Slots and their coefficients.
        slots: Vec<usize>,
        /// Coefficient of each slot.
        direction: Vec<f64>,
        /// The value.
        target: f64,
    },
}

/// A membrane between rigid bodies, ready to be discretised.
#[derive(Clone, Debug)]
pub struct System {
    /// The stress-free shape.
    pub reference: Reference,
    /// The material.
    pub law: Law,
    /// The pieces of the meridian, from the top.
    pub pieces: Vec<Piece>,
    /// The conditions, all but the closing one.
    pub conditions: Vec<Formula>,
    /// The closing condition.
    pub closing: Closing,
    layout: Layout,
}

impl System {
    /// Assembles a system with `globals` globals; conditions are added afterwards, when their slots are known.
    pub fn new(reference: Reference, law: Law, pieces: Vec<Piece>, globals: usize) -> Self {
        let segments = pieces
            .iter()
            .map(|p| Segment {
                states: p.states(),
                coupled: p.kind.coupled(),
                reported: p.reported(),
                parameters: p.parameters(),
            })
            .collect();
        let layout = Layout { segments, globals };
        let closing = Closing::Arc { slots: vec![], direction: vec![], target: 0.0 };
        System { reference, law, pieces, conditions: vec![], closing, layout }
    }

    /// Adds the integral of a field over the reference area of a piece to what is reported of it; the place of the integral there.
    pub fn integrate(&mut self, piece: usize, field: std::sync::Arc<FieldFormula>) -> usize {
        let at = self.pieces[piece].reported();
        self.pieces[piece].integrals.push(field);
        self.layout.segments[piece].reported += 1;
        at
    }

    /// True where the membrane repels itself.
    pub fn repels(&self) -> bool {
        self.pieces.iter().any(|piece| piece.repulsion.is_some())
    }

    /// A formula from a tape with one output over `probes`.
    pub fn formula(&self, tape: Tape, probes: Vec<Probe>) -> Formula {
        let mut slots: Vec<usize> = vec![];
        for &i in tape.inputs() {
            probes[i].slots(self, &mut slots);
        }
        slots.sort_unstable();
        slots.dedup();
        Formula { tape, probes, slots }
    }
}

impl Formula {
    /// The value of the formula, given the value of each slot.
    pub fn value<S: Scalar>(&self, system: &System, slot: &impl Fn(usize) -> S) -> S {
        self.with(|probe| probe.value(system, slot))
    }

    /// The value of the formula, given the value of each probe that it uses.
    pub fn with<S: Scalar>(&self, mut probe: impl FnMut(&Probe) -> S) -> S {
        let mut inputs = vec![S::from(0.0); self.probes.len()];
        for &i in self.tape.inputs() {
            inputs[i] = probe(&self.probes[i]);
        }
        let (mut work, mut out) = (vec![], [S::from(0.0)]);
        self.tape.eval(&inputs, &mut work, &mut out);
        out[0]
    }

    /// The probes it uses.
    pub fn probes(&self) -> impl Iterator<Item = &Probe> {
        self.tape.inputs().iter().map(|&i| &self.probes[i])
    }

    /// The slots it depends on.
    pub fn slots(&self) -> &[usize] {
        &self.slots
    }
}

impl Problem for System {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    #[inline]
    fn flow<S: Scalar>(&self, segment: usize, x: f64, y: &[S], p: &[S], out: &mut [S]) {
        self.pieces[segment].flow(&self.reference, &self.law, x, y, p, out);
    }

    fn condition_slots(&self, i: usize) -> &[usize] {
        match (self.conditions.get(i), &self.closing) {
            (Some(c), _) => &c.slots,
            (None, Closing::Value { of, .. }) => &of.slots,
            (None, Closing::Arc { slots, .. }) => slots,
        }
    }

    fn condition<S: Scalar>(&self, i: usize, slots: &[S]) -> S {
        let value = |c: &Formula| {
            c.value(self, &|slot| {
                let at = c.slots.iter().position(|&s| s == slot).expect("a condition asks for its own slots");
                slots[at]
            })
        };
        match (self.conditions.get(i), &self.closing) {
            (Some(c), _) => value(c),
            (None, Closing::Value { of, target }) => value(of) - *target,
            (None, Closing::Arc { direction, target, .. }) => {
                slots.iter().zip(direction).fold(S::from(-target), |sum, (s, d)| sum + *s * *d)
            }
        }
    }

    fn noise(&self, segment: usize, x: f64) -> f64 {
        // The terms of (1) to (3) of the membrane are of order 1 in eta, and a few roundings go into each.
        let (a, b) = (-1.0, 1.0);
        let piece = &self.pieces[segment];
        let measure = piece.coordinate.at(x, a, b).1.abs().max(1.0);
        // A given traction has the error of its quadrature.
        let given = piece.repulsion.as_ref().and_then(|r| r.rest.as_ref());
        let given = given.map_or(0.0, |rest| rest.error / self.law.response(1.0, 1.0).w_ll);
        (4.0 * f64::EPSILON + given) * measure
    }

    fn unresolved(&self, segment: usize, interval: usize) -> f64 {
        let given = self.pieces[segment].repulsion.as_ref().and_then(|r| r.rest.as_ref());
        given.and_then(|rest| rest.unresolved.get(interval)).copied().unwrap_or(0.0)
    }

    fn global_scale(&self, _: usize, value: f64) -> f64 {
        value.abs().max(1e-3)
    }
}
