//! Probes: the numbers of a system that formulas can ask for.

use super::load::Variable;
use super::{Coordinate, Kind, Piece, Place, System};
use crate::physics::membrane::tip_drift;
use crate::scalar::Scalar;

/// An end of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    /// The first point in walking order.
    Start,
    /// The last one.
    End,
}

/// A field at an end of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Field {
    /// Meridional stretch.
    Lambda,
    /// Hoop stretch.
    Mu,
    /// Tangent angle.
    Tau,
    /// Radius.
    U,
    /// Material angle from the top pole.
    Phi,
    /// Reference arc length from the top pole.
    S,
    /// Reference radius.
    Rho0,
    /// Energy per reference area.
    W,
    /// Meridional tension.
    TensionL,
    /// Hoop tension.
    TensionM,
    /// Position below the apex of the face (contact).
    Drop,
    /// Parameter of the generator of the face (contact).
    Along,
    /// Axial position, where it is a state (free, under a load that asks for it).
    Height,
    /// Contact pressure (contact).
    ContactPressure,
    /// d ln(mu/lambda)/d eta as around the tip of a cone; zero at the start of a tip.
    TipDrift,
}

/// A number that a formula can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Probe {
    /// A global.
    Global(usize),
    /// A field at an end of a piece.
    End(usize, Side, Field),
    /// A coupled quadrature of a piece.
    Quadrature(usize, usize),
    /// Volume swept by a piece of contact, integral of pi u^2 dh, in closed form.
    SweptVolume(usize),
    /// Length of the meridian on a piece of contact, in closed form.
    FaceLength(usize),
    /// A reported quadrature of a piece, tail of a tip included. Not for conditions.
    Reported(usize, usize),
    /// A field of the membrane where the formula is evaluated. For tractions only.
    Here(Variable),
    /// Largest radius of all pieces. Not for conditions.
    LargestRadius,
    /// A number read off a field, by its place in the list of the model. Not for conditions.
    Reading(usize),
    /// A limit at an element that is absent in this stage: it has no value.
    Absent,
    /// The coefficient C in lambda ~ C phi^(cos a - 1) at the start or end of a piece. Not for conditions.
    TipCoefficient(usize, Side),
}

impl Probe {
    /// True for numbers that conditions can be made of: those that depend on few slots.
    pub fn is_local(&self) -> bool {
        !matches!(
            self,
            Probe::Reported(..)
                | Probe::LargestRadius
                | Probe::Reading(_)
                | Probe::TipCoefficient(..)
                | Probe::Absent
                | Probe::Here(_)
        )
    }

    /// Adds the slots that it depends on.
    pub fn slots(&self, system: &System, out: &mut Vec<usize>) {
        let layout = &system.layout;
        let place = |place: Place, out: &mut Vec<usize>| {
            if let Place::Unknown(g) = place {
                out.push(layout.global(g));
            }
        };
        match *self {
            Probe::Global(g) => out.push(layout.global(g)),
            Probe::End(s, side, field) => {
                let piece = &system.pieces[s];
                let first = match side {
                    Side::Start => layout.start(s),
                    Side::End => layout.end(s),
                };
                out.extend((0..piece.states()).map(|c| first + c));
                place(piece.from, out);
                place(piece.to, out);
                if field == Field::ContactPressure {
                    out.extend(piece.parameters().iter().map(|&g| layout.global(g)));
                }
            }
            Probe::Quadrature(s, q) => out.push(layout.quadratures(s) + q),
            Probe::SweptVolume(s) | Probe::FaceLength(s) => {
                Probe::End(s, Side::Start, Field::Along).slots(system, out);
                Probe::End(s, Side::End, Field::Along).slots(system, out);
            }
            Probe::Reported(..)
            | Probe::LargestRadius
            | Probe::Reading(_)
            | Probe::TipCoefficient(..)
            | Probe::Absent
            | Probe::Here(_) => {}
        }
    }

    /// The value of a local probe, given each slot.
    ///
    /// # Panics
    /// For probes that are not local.
    pub fn value<S: Scalar>(&self, system: &System, slot: &impl Fn(usize) -> S) -> S {
        let layout = &system.layout;
        match *self {
            Probe::Global(g) => slot(layout.global(g)),
            Probe::Quadrature(s, q) => slot(layout.quadratures(s) + q),
            Probe::End(s, side, field) => end_field(system, s, side, field, slot),
            Probe::SweptVolume(s) | Probe::FaceLength(s) => match &system.pieces[s].kind {
                Kind::Free => S::from(0.0),
                Kind::Contact(face) => {
                    // Between the axis and a tip's inner end the face goes on.
                    let place = |side| match (side, system.pieces[s].coordinate) {
                        (Side::Start, Coordinate::FromTip(_)) | (Side::End, Coordinate::ToTip(_)) => S::from(0.0),
                        _ => end_field(system, s, side, Field::Along, slot),
                    };
                    let (from, to) = (place(Side::Start), place(Side::End));
                    if matches!(self, Probe::FaceLength(_)) {
                        face.length(from, to)
                    } else {
                        face.swept_volume(from, to)
                    }
                }
            },
            Probe::Reported(..)
            | Probe::LargestRadius
            | Probe::Reading(_)
            | Probe::TipCoefficient(..)
            | Probe::Absent
            | Probe::Here(_) => {
                unreachable!("only local probes have a value in slots")
            }
        }
    }
}

/// The eta of an end, or nothing at a pole.
pub(super) fn end_eta<S: Scalar>(system: &System, piece: &Piece, side: Side, slot: &impl Fn(usize) -> S) -> Option<S> {
    let eta = |place: Place| match place {
        Place::Pole => None,
        Place::Fixed(eta) => Some(S::from(eta)),
        Place::Unknown(g) => Some(slot(system.layout.global(g))),
    };
    match (side, piece.coordinate) {
        (Side::Start, Coordinate::FromTip(length)) => eta(piece.to).map(|b| b - length),
        (Side::End, Coordinate::ToTip(length)) => eta(piece.from).map(|a| a + length),
        (Side::Start, _) => eta(piece.from),
        (Side::End, _) => eta(piece.to),
    }
}

fn end_states<S: Scalar>(system: &System, s: usize, side: Side, slot: &impl Fn(usize) -> S) -> [S; 4] {
    let layout = &system.layout;
    let first = match side {
        Side::Start => layout.start(s),
        Side::End => layout.end(s),
    };
    std::array::from_fn(|c| if c < system.pieces[s].states() { slot(first + c) } else { S::from(0.0) })
}

fn end_field<S: Scalar>(system: &System, s: usize, side: Side, field: Field, slot: &impl Fn(usize) -> S) -> S {
    let piece = &system.pieces[s];
    let y = end_states(system, s, side, slot);
    let eta = end_eta(system, piece, side, slot);
    let rho0 = || eta.map_or(S::from(0.0), |eta| system.reference.at(eta).rho0);
    let (ln_mu, tau) = piece.shape(rho0(), &y);
    let (lambda, mu) = (y[0].exp(), ln_mu.exp());
    let phi = || match (eta, side) {
        (Some(eta), _) => system.reference.phi(eta),
        (None, Side::Start) => S::from(0.0),
        (None, Side::End) => S::from(std::f64::consts::PI),
    };
    match field {
        Field::Lambda => lambda,
        Field::Mu => mu,
        Field::U => mu * rho0(),
        Field::Phi => phi(),
        Field::S => phi() * system.reference.radius(),
        Field::Rho0 => rho0(),
        Field::Tau => tau,
        Field::Height => y[3],
        Field::W => system.law.response(lambda, mu).w,
        Field::TensionL => system.law.response(lambda, mu).w_l,
        Field::TensionM => system.law.response(lambda, mu).w_m,
        Field::Drop => match &piece.kind {
            Kind::Contact(face) => face.drop(face.parameter(y[1], rho0())),
            Kind::Free => S::from(0.0),
        },
        Field::Along => match &piece.kind {
            Kind::Contact(face) => face.parameter(y[1], rho0()),
            Kind::Free => S::from(0.0),
        },
        Field::ContactPressure => {
            let p: Vec<S> = piece.parameters().iter().map(|&g| slot(system.layout.global(g))).collect();
            let x = if side == Side::Start { 0.0 } else { 1.0 };
            piece.contact_pressure(&system.reference, &system.law, x, &y[..piece.states()], &p)
        }
        Field::TipDrift => match &piece.kind {
            Kind::Contact(face) => tip_drift(&system.law, face.tip_inclination().cos(), lambda, mu),
            Kind::Free => S::from(0.0),
        },
    }
}
