//! A piece of the meridian: its states, its equations, its quadratures.

use super::field::FieldFormula;
use super::load::{Load, Site, along};
use super::repulsion::Repulsion;
use super::{Coordinate, Place};
use crate::expr::Tape;
use crate::physics::material::Law;
use crate::physics::membrane::{Local, tip_energy};
use crate::physics::reference::Reference;
use crate::physics::surface::Face;
use crate::scalar::Scalar;
use std::f64::consts::PI;
use std::sync::Arc;

/// Most loads on one piece.
pub const MOST_LOADS: usize = 8;
/// Place of the axial force of the first load among what is reported of a piece.
pub const LOADS_AT: usize = 4;

/// What holds a piece of the membrane.
#[derive(Clone, Debug)]
pub enum Kind {
    /// Nothing but pressure.
    Free,
    /// A rigid frictionless face, along which the parameter of its generator says where the membrane is.
    Contact(Face),
}

impl Kind {
    /// Quadratures that conditions may use: increments of h and of the volume under the meridian, integral of pi u^2 dh; none
    /// on a face, where both follow from the radius.
    pub fn coupled(&self) -> usize {
        match self {
            Kind::Free => 2,
            Kind::Contact(_) => 0,
        }
    }
}

/// The net outward pressure on a piece: that of the fluid inside minus that outside.
#[derive(Clone, Debug, Default)]
pub struct Pressure {
    /// The global that is the pressure of the fluid.
    pub fluid: Option<usize>,
    /// The pressure outside, a formula of one output over globals.
    pub outside: Option<(Tape, Vec<usize>)>,
}

impl Pressure {
    /// The globals it depends on.
    fn globals(&self) -> Vec<usize> {
        let mut g: Vec<usize> = self.fluid.into_iter().collect();
        if let Some((_, inputs)) = &self.outside {
            g.extend(inputs);
        }
        g
    }

    /// The net pressure, `p` in the order of the globals it depends on.
    #[inline(always)]
    pub fn net<S: Scalar>(&self, p: &[S]) -> S {
        let (fluid, rest) = match self.fluid {
            Some(_) => (p[0], &p[1..]),
            None => (S::from(0.0), p),
        };
        match &self.outside {
            None => fluid,
            Some((tape, _)) => {
                let (mut work, mut out) = (vec![], [S::from(0.0)]);
                tape.eval(rest, &mut work, &mut out);
                fluid - out[0]
            }
        }
    }

    /// The net pressure, given every global.
    pub fn value<S: Scalar>(&self, global: &impl Fn(usize) -> S) -> S {
        let p: Vec<S> = self.globals().into_iter().map(global).collect();
        self.net(&p)
    }
}

/// A piece of the meridian.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Its name in the problem file.
    pub name: String,
    /// What holds it.
    pub kind: Kind,
    /// How it lies on the reference meridian.
    pub coordinate: Coordinate,
    /// Where it starts.
    pub from: Place,
    /// Where it ends.
    pub to: Place,
    /// The net pressure on it.
    pub pressure: Pressure,
    /// Other tractions on it.
    pub loads: Vec<Arc<Load>>,
    /// Part of the distance from `level` that they see: 1, and less only on the way to a first state, where it takes the steepness
    /// from forces of short range.
    pub reach: f64,
    /// Where the initial membrane stands, which loads of no reach see everywhere.
    pub level: f64,
    /// Axial position of the apex of the face, where a load asks for that of the membrane: a formula of one output over globals.
    pub apex: Option<(Tape, Vec<usize>)>,
    /// Its own screened repulsion.
    pub repulsion: Option<Repulsion>,
    /// Fields whose integrals over the reference area are reported.
    pub integrals: Vec<Arc<FieldFormula>>,
}

/// The place of a point of the membrane.
pub(super) struct Spot {
    pub rho0: f64,
    pub u: f64,
    pub lambda: f64,
    pub sin: f64,
    pub cos: f64,
}

impl Piece {
    /// Number of states: ln(lambda); ln(mu) and tau where it is free, and h where a load asks for it; the place on a face else
    /// ([`Face::parameter`]).
    pub fn states(&self) -> usize {
        match self.kind {
            Kind::Free => 3 + usize::from(self.follows_height()),
            Kind::Contact(_) => 2,
        }
    }

    /// True if h is one of its states: where loads act, which may depend on it and work along it.
    pub fn follows_height(&self) -> bool {
        matches!(self.kind, Kind::Free) && (!self.loads.is_empty() || self.repulsion.is_some())
    }

    /// Quadratures that are only reported: elastic energy, deformed area, length of the meridian (free), reference area, the axial force of
    /// each load, the axial force and the energy of its own repulsion and the same of its image, and integrals of fields.
    pub fn reported(&self) -> usize {
        self.integrals_at() + self.integrals.len()
    }

    /// The place of the first integral of a field among what is reported.
    pub fn integrals_at(&self) -> usize {
        LOADS_AT + self.loads.len() + self.repulsion.as_ref().map_or(0, Repulsion::reported)
    }

    /// The place of the axial force of its own repulsion among what is reported; the energy follows.
    pub fn repulsion_at(&self) -> usize {
        LOADS_AT + self.loads.len()
    }

    /// The globals that its equations depend on: unknown places, then those of the pressure.
    pub fn parameters(&self) -> Vec<usize> {
        let mut p: Vec<usize> = [self.from, self.to]
            .into_iter()
            .filter_map(|place| match place {
                Place::Unknown(g) => Some(g),
                _ => None,
            })
            .collect();
        p.extend(self.pressure.globals());
        for load in &self.loads {
            p.extend(load.globals());
        }
        p.extend(self.apex.iter().flat_map(|(_, globals)| globals));
        p
    }

    /// The tangent angle at a state of this piece.
    fn tau<S: Scalar>(&self, local: &Local<S>, y: &[S]) -> S {
        match &self.kind {
            Kind::Free => y[2],
            Kind::Contact(face) => face.tangent(face.frame(face.parameter(y[1], local.rho0)).angle),
        }
    }

    /// The axial position that loads see, where they are given one; `rest`: the parameters without the places.
    pub fn height<S: Scalar>(&self, local: &Local<S>, y: &[S], rest: &[S]) -> S {
        let h = match &self.kind {
            Kind::Free => y.get(3).copied().unwrap_or(S::from(0.0)),
            Kind::Contact(face) => {
                let apex = self.apex.as_ref().map_or(S::from(0.0), |(tape, globals)| {
                    let (mut work, mut out) = (vec![], [S::from(0.0)]);
                    tape.eval(&rest[rest.len() - globals.len()..], &mut work, &mut out);
                    out[0]
                });
                apex + face.drop(face.parameter(y[1], local.rho0))
            }
        };
        if self.reach == 1.0 { h } else { (h - self.level) * self.reach + self.level }
    }

    /// What its own repulsion does to the membrane at a state: its response with the local energy, and the traction away from the
    /// axis and downwards that is left, along the membrane and outwards. A tension that depends on h pulls as well.
    fn repelled<S: Scalar>(&self, repulsion: &Repulsion, m: &Local<S>, x: f64, h: S) -> (Local<S>, [S; 2]) {
        let [radial, axial] = repulsion.rest(x, m.rho0);
        if repulsion.image.is_none() {
            return (repulsion.added_to(m, h), along(m, [radial, axial]));
        }
        let [t, n] = along(m, [radial, axial + repulsion.pull(m, h)]);
        (repulsion.added_to(m, h), [t, n])
    }

    /// The force of each load per reference area, away from the axis and downwards, at eta; `rest`: the parameters without the places.
    pub fn forces<S: Scalar>(
        &self,
        reference: &Reference,
        eta: S,
        local: &Local<S>,
        y: &[S],
        rest: &[S],
        mut each: impl FnMut(usize, [S; 2]),
    ) {
        let (tau, h) = (self.tau(local, y), self.height(local, y, rest));
        let mut rest = &rest[self.pressure.globals().len()..];
        let phi = reference.phi(eta);
        let site = Site { local: *local, tau, h, phi, arc: phi * reference.radius(), pressed: S::from(0.0) };
        for (i, load) in self.loads.iter().enumerate() {
            let (own, others) = rest.split_at(load.globals().count());
            each(i, load.force(&site, own));
            rest = others;
        }
    }

    /// The eta of both ends and the rest of the parameters; poles have 0, which nothing uses.
    #[inline(always)]
    pub fn ends<'a, S: Scalar>(&self, p: &'a [S]) -> (S, S, &'a [S]) {
        let mut rest = p;
        let mut take = |place: Place| match place {
            Place::Pole => S::from(0.0),
            Place::Fixed(eta) => S::from(eta),
            Place::Unknown(_) => {
                let eta = rest[0];
                rest = &rest[1..];
                eta
            }
        };
        let (a, b) = (take(self.from), take(self.to));
        (a, b, rest)
    }

    /// The eta of both ends, given the parameters; poles have 0, which nothing uses.
    pub fn places<S: Scalar>(&self, p: &[S]) -> (S, S) {
        let (a, b, _) = self.ends(p);
        (a, b)
    }

    /// The membrane at a state of this piece.
    #[inline(always)]
    pub fn local<S: Scalar>(&self, reference: &Reference, law: &Law, eta: S, y: &[S]) -> Local<S> {
        let point = reference.at(eta);
        let (ln_mu, tau) = self.shape(point.rho0, y);
        Local::new(law, point, y[0], ln_mu, tau)
    }

    /// Where the membrane is at a state of this piece, without its response.
    pub(super) fn spot(&self, reference: &Reference, eta: f64, y: &[f64]) -> Spot {
        let rho0 = reference.at(eta).rho0;
        let (ln_mu, tau) = self.shape(rho0, y);
        let (sin, cos) = tau.sin_cos();
        Spot { rho0, u: rho0 * ln_mu.exp(), lambda: y[0].exp(), sin, cos }
    }

    /// Axial position of the apex of its face, given every global; zero where it has none.
    pub fn apex_at(&self, global: &impl Fn(usize) -> f64) -> f64 {
        self.apex.as_ref().map_or(0.0, |(tape, globals)| {
            let inputs: Vec<f64> = globals.iter().map(|&g| global(g)).collect();
            let (mut work, mut out) = (vec![], [0.0]);
            tape.eval(&inputs, &mut work, &mut out);
            out[0]
        })
    }

    /// ln(mu) and tau at reference radius `rho0`, from the states.
    #[inline(always)]
    pub(super) fn shape<S: Scalar>(&self, rho0: S, y: &[S]) -> (S, S) {
        match &self.kind {
            Kind::Free => (y[1], y[2]),
            Kind::Contact(face) => {
                let t = face.parameter(y[1], rho0);
                (face.ln_mu(y[1], t, rho0), face.tangent(face.frame(t).angle))
            }
        }
    }

    /// Equations and quadratures at `x`: `out` receives as many as it has room for.
    #[inline(always)]
    pub fn flow<S: Scalar>(&self, reference: &Reference, law: &Law, x: f64, y: &[S], p: &[S], out: &mut [S]) {
        let (a, b, rest) = self.ends(p);
        let (eta, stretch) = self.coordinate.at(x, a, b);
        let m = self.local(reference, law, eta, y);
        let (mut balanced, mut pull, mut push, mut drawn) = (m, S::from(0.0), S::from(0.0), S::from(0.0));
        if let Some(repulsion) = &self.repulsion {
            let h = self.height(&m, y, rest);
            (balanced, [pull, push]) = self.repelled(repulsion, &m, x, h);
            if repulsion.image.is_some() {
                drawn = repulsion.pull(&m, h);
                // d w_l/dh dh/ds = -(d w/dh) sin(tau), as lambda w_l = -w.
                pull = pull + drawn * m.sin * self.reach;
            }
        }
        let loaded = (!self.loads.is_empty()).then(|| self.loaded(reference, eta, &m, y, rest));
        if let Some((t, n, _)) = &loaded {
            (pull, push) = (pull + *t, push + *n);
        }
        let [f0, f1] = balanced.stretching(pull);
        out[0] = f0 * stretch;
        let measure = m.rho0 * stretch;
        let states = self.states();
        match &self.kind {
            Kind::Free => {
                out[1] = f1 * stretch;
                out[2] = balanced.turning(self.pressure.net(rest), push) * stretch;
                if states > 3 {
                    out[3] = measure * m.lambda * m.sin;
                }
            }
            Kind::Contact(face) => {
                let t = face.parameter(y[1], m.rho0);
                out[1] = face.advance(&face.frame(t), t, &m) * stretch;
            }
        }
        let coupled = self.kind.coupled();
        if coupled > 0 && out.len() > states {
            self.falling(&m, measure, &mut out[states..]);
        }
        if out.len() > states + coupled {
            let out = &mut out[states + coupled..];
            self.reported_flow(&m, measure, out);
            if let Some((_, _, axial)) = &loaded {
                for (o, force) in out[LOADS_AT..].iter_mut().zip(axial).take(self.loads.len()) {
                    *o = m.rho0 * *force * measure * (2.0 * PI);
                }
            }
            if !self.integrals.is_empty() {
                let site = self.site(reference, law, x, y, p);
                for (o, field) in out[self.integrals_at()..].iter_mut().zip(&self.integrals) {
                    *o = m.rho0 * measure * (2.0 * PI) * field.at(&site);
                }
            }
            if let Some(repulsion) = &self.repulsion {
                let [_, axial, energy, image, image_energy] = repulsion.given(x);
                let area = m.rho0 * measure * (2.0 * PI);
                // They are given at a shape; how they change with it is, to leading order, how the local energy does.
                let spread = m.lambda * m.mu;
                let thinner = spread.recip() * spread.value();
                let out = &mut out[self.repulsion_at()..];
                out[0] = (drawn + axial) * area;
                out[1] = area * thinner * energy;
                if let Some(of) = repulsion.image {
                    let h = self.height(&m, y, rest);
                    let nearer = ((h - h.value()) * (2.0 * repulsion.k * of.side)).exp();
                    out[2] = area * thinner * nearer * image;
                    out[3] = area * thinner * nearer * image_energy;
                }
            }
        }
    }

    /// Tangential and normal part of all loads per reference area, and the axial force of each.
    #[inline(never)]
    fn loaded<S: Scalar>(
        &self,
        reference: &Reference,
        eta: S,
        m: &Local<S>,
        y: &[S],
        rest: &[S],
    ) -> (S, S, [S; MOST_LOADS]) {
        let (mut pull, mut push, mut axial) = (S::from(0.0), S::from(0.0), [S::from(0.0); MOST_LOADS]);
        self.forces(reference, eta, m, y, rest, |i, force| {
            let [t, n] = along(m, force);
            (pull, push, axial[i]) = (pull + t, push + n, force[1]);
        });
        (pull, push, axial)
    }

    /// The membrane with what its own repulsion adds to its tensions, and the tangential and normal traction per reference area of
    /// everything but pressure and that.
    pub fn balance<S: Scalar>(&self, reference: &Reference, law: &Law, x: f64, y: &[S], p: &[S]) -> (Local<S>, [S; 2]) {
        let (a, b, rest) = self.ends(p);
        let eta = self.coordinate.at(x, a, b).0;
        let m = self.local(reference, law, eta, y);
        let (t, n, _) = self.loaded(reference, eta, &m, y, rest);
        match &self.repulsion {
            None => (m, [t, n]),
            Some(repulsion) => {
                let (balanced, [rt, rn]) = self.repelled(repulsion, &m, x, self.height(&m, y, rest));
                (balanced, [t + rt, n + rn])
            }
        }
    }

    /// What fields see at a state of the piece; h is left out.
    #[inline(never)]
    pub fn site<S: Scalar>(&self, reference: &Reference, law: &Law, x: f64, y: &[S], p: &[S]) -> Site<S> {
        let (a, b, _) = self.ends(p);
        self.site_at(reference, law, x, self.coordinate.at(x, a, b).0, y, p)
    }

    /// The same where eta carries directions of its own.
    pub fn site_at<S: Scalar>(&self, reference: &Reference, law: &Law, x: f64, eta: S, y: &[S], p: &[S]) -> Site<S> {
        let local = self.local(reference, law, eta, y);
        let (_, tau) = self.shape(local.rho0, y);
        let phi = reference.phi(eta);
        let pressed = self.contact_pressure(reference, law, x, y, p);
        Site { local, tau, h: S::from(0.0), phi, arc: phi * reference.radius(), pressed }
    }

    /// Contact pressure on the face that holds the piece, at a state of the membrane; zero on a free piece.
    pub fn contact_pressure<S: Scalar>(&self, reference: &Reference, law: &Law, x: f64, y: &[S], p: &[S]) -> S {
        let (m, [_, push]) = self.balance(reference, law, x, y, p);
        let net = self.pressure.net(self.ends(p).2) + push / (m.lambda * m.mu);
        let Kind::Contact(face) = &self.kind else { return S::from(0.0) };
        let t = face.parameter(y[1], m.rho0);
        let frame = face.frame(t);
        m.contact_pressure(net, face.bend(&frame) * face.sense / frame.speed, face.hoop(&frame, t, m.u()))
    }

    /// (4) of the membrane, and pi u^2 dh.
    #[inline(always)]
    fn falling<S: Scalar>(&self, m: &Local<S>, measure: S, out: &mut [S]) {
        let fall = measure * m.lambda * m.sin;
        let u = m.u();
        out[0] = fall;
        out[1] = u * u * fall * PI;
    }

    /// Energy 2 pi rho0 w dS, area 2 pi u lambda dS, length lambda dS, reference area 2 pi rho0 dS.
    #[inline(always)]
    fn reported_flow<S: Scalar>(&self, m: &Local<S>, measure: S, out: &mut [S]) {
        out[0] = m.rho0 * m.response.w * measure * (2.0 * PI);
        out[1] = m.u() * m.lambda * measure * (2.0 * PI);
        // Along a face the length follows from the parameters of its ends, and is no smooth function of x at a pole.
        out[2] = if matches!(self.kind, Kind::Free) { m.lambda * measure } else { S::from(0.0) };
        out[3] = m.rho0 * measure * (2.0 * PI);
    }

    /// What the quadratures miss between the tip of a cone and the innermost point resolved, `m`, on a straight face: energy, area, no
    /// length, and reference area, in closed form.
    pub fn tip_tail<S: Scalar>(&self, m: &Local<S>) -> [S; LOADS_AT] {
        let (u, along) = (m.u(), 1.0 / m.cos.value().abs());
        [tip_energy(m), u * u * (PI * along), S::from(0.0), m.rho0 * m.rho0 * PI]
    }
}
