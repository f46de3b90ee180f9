//! What proves a state: first integrals, balance of forces, virtual work, admissibility.

use super::{Carried, TANGENT, View};
use crate::model::{Grip, Model};
use crate::physics::membrane::Local;
use crate::scalar::Scalar;
use crate::system::{Coordinate, Formula, Kind, LOADS_AT, Side};
use std::f64::consts::PI;

/// Independent checks of a state; numbers are relative mismatches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Certificate {
    /// Spread of 2 pi rho0 w_l sin tau - pi u^2 p along free pieces.
    pub first_integral: f64,
    /// Contact pressure integrated over each face against the balance of that patch.
    pub force_balance: f64,
    /// Derivative of the energy along the branch against the work of bodies and pressure.
    pub virtual_work: f64,
    /// Worst mismatch of the identities that the file declares.
    pub identities: f64,
    /// The least principal tension of the membrane, at mesh points; negative where it would wrinkle.
    pub least_tension: f64,
    /// Everything that makes the state inadmissible: the condition and the place.
    pub violations: Vec<String>,
}

/// Relative size below which a tension, pressure or gap of the wrong sign is rounding.
const TOLERANCE: f64 = 1e-9;
/// Depth inside a body, relative to the size of the membrane, that is rounding.
const GAP: f64 = 1e-7;
/// A pull of an edge, relative to the tension, that is rounding.
const EDGE: f64 = 1e-7;
/// A mismatch of an identity above this is a violation.
const IDENTITY: f64 = 1e-6;

impl Certificate {
    /// Checks a state.
    pub fn new(model: &Model, view: &View) -> Self {
        let mut c = Certificate { least_tension: f64::INFINITY, ..Certificate::default() };
        c.first_integrals(view);
        c.forces(view);
        c.work(model, view);
        for (name, lhs, rhs) in &model.identities {
            if let (Some(l), Some(r)) = (view.value(lhs), view.value(rhs)) {
                let scale = l.re.abs().max(r.re.abs());
                let mismatch = if scale > 0.0 { (l.re - r.re).abs() / scale } else { 0.0 };
                c.identities = c.identities.max(mismatch);
                if mismatch > IDENTITY {
                    c.violations.push(format!("identity `{name}` misses by {mismatch:.1e}"));
                }
            }
        }
        c.admissible(model, view);
        c
    }

    /// True where nothing is violated.
    pub fn is_admissible(&self) -> bool {
        self.violations.is_empty()
    }

    fn first_integrals(&mut self, view: &View) {
        for (s, piece) in view.system.pieces.iter().enumerate() {
            if !matches!(piece.kind, Kind::Free) {
                continue;
            }
            let p = piece.pressure.value(&|g| view.global(g)).re;
            let (mut low, mut high, mut size) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
            let points = mesh_points(view, s);
            let last = points.len() - 1;
            // Other tractions are summed over the whole piece: only its ends can be compared.
            let other = (piece.reported() > LOADS_AT).then(|| other_force(view, s).re);
            for (i, m) in points {
                let (pull, push) = (2.0 * PI * m.rho0 * m.w_balanced * m.sin, PI * m.u * m.u * p);
                size = size.max(pull.abs()).max(push.abs());
                let along = match other {
                    Some(_) if i > 0 && i < last => continue,
                    Some(force) if i == last => force,
                    _ => 0.0,
                };
                low = low.min(pull - push + along);
                high = high.max(pull - push + along);
            }
            if size > 0.0 {
                self.first_integral = self.first_integral.max((high - low) / size);
            }
        }
    }

    fn forces(&mut self, view: &View) {
        for (s, piece) in view.system.pieces.iter().enumerate() {
            if matches!(piece.kind, Kind::Free) {
                continue;
            }
            let (balance, size) = patch_balance(view, s);
            if size > 0.0 {
                let mismatch = (integrated_force(view, s) - balance.re).abs() / size;
                self.force_balance = self.force_balance.max(mismatch);
            }
        }
    }

    /// dE = sum over bodies and joints of force times displacement + p dV, per image, along the tangent. A joint moves with its
    /// line, not with the material: what slides through it without friction needs no work.
    fn work(&mut self, model: &Model, view: &View) {
        let along = |v: Carried| v.du[TANGENT];
        let mut energy: f64 = (0..view.system.pieces.len()).map(|s| along(view.reported(s, 0))).sum();
        let mut work = 0.0;
        let mut size = energy.abs();
        for body in &model.bodies {
            let Some(h) = view.value(&body.h) else { continue };
            let push: f64 = body.pieces.iter().map(|&s| patch_balance(view, s).0.re).sum();
            work += push * along(h);
            size += (push * along(h)).abs();
        }
        for (s, piece) in view.system.pieces.iter().enumerate() {
            let p = piece.pressure.value(&|g| view.global(g)).re;
            let volume = match &piece.kind {
                Kind::Free => crate::system::Probe::Quadrature(s, 1),
                Kind::Contact(_) => crate::system::Probe::SweptVolume(s),
            };
            let v = volume.value(view.system, &|slot| view.slot(slot));
            // What the piece sweeps: its volume between the planes through its ends changes also as these move.
            let plane = |end: Option<Local<Carried>>, h: Option<&Formula>| -> f64 {
                let (Some(m), Some(h)) = (end, h.and_then(|h| view.value(h))) else { return 0.0 };
                PI * m.u().re.powi(2) * along(h)
            };
            let top = plane(view.end(s, Side::Start), model.heights.get(s));
            let bottom = plane(view.end(s, Side::End), model.heights.get(s + 1));
            work += p * (along(v) + top - bottom);
            size += (p * along(v)).abs();
        }
        for s in 0..view.system.pieces.len() {
            let (done, stored) = traction_work(view, s);
            work += done;
            energy += stored;
            size += done.abs() + stored.abs();
        }
        // Where pieces meet, a line force may pull: what the tensions of both sides leave.
        for s in 1..view.system.pieces.len() {
            let (Some(a), Some(b)) = (view.end(s - 1, Side::End), view.end(s, Side::Start)) else { continue };
            let Some(h) = view.value(&model.heights[s]) else { continue };
            let pull = |before: Carried, after: Carried| 2.0 * PI * (a.rho0 * before - b.rho0 * after).re;
            let radial = pull(a.response.w_l * a.cos, b.response.w_l * b.cos) * along(a.u());
            let axial = pull(a.response.w_l * a.sin, b.response.w_l * b.sin) * along(h);
            work += radial + axial;
            size += radial.abs() + axial.abs();
        }
        // What slides over an edge with friction loses energy.
        for edge in &model.edges {
            if let (Some((_, Grip::Forward | Grip::Backward)), Some(a), Some(b)) =
                (edge.grip, view.end(edge.before, Side::End), view.end(edge.before + 1, Side::Start))
            {
                let held = |m: &Local<Carried>| (m.lambda * m.response.w_l - m.response.w).re;
                let eta = view.eta(edge.before + 1, 0.0);
                let lost = 2.0 * PI * a.rho0.re.powi(2) * (held(&b) - held(&a)) * along(eta);
                work += lost;
                size += lost.abs();
            }
        }
        // What adheres gains its energy, per reference area.
        for adhesion in &model.adhesions {
            let Some(energy) = view.value(&adhesion.energy) else { continue };
            let s = adhesion.before + 1;
            let (Some(m), eta) = (view.end(s, Side::Start), view.eta(s, 0.0)) else { continue };
            let covered = (m.rho0 * m.rho0 * 2.0 * PI).re * along(eta);
            let gain = energy.re * if adhesion.free_first { -covered } else { covered };
            work += gain;
            size += gain.abs();
        }
        self.virtual_work = if size > 0.0 { (energy - work).abs() / size } else { 0.0 };
    }

    fn admissible(&mut self, model: &Model, view: &View) {
        let mut worst: Vec<(String, f64, String)> = vec![];
        let mut note = |what: &str, name: &str, phi: f64, value: f64| {
            let key = format!("{what} on {name}");
            match worst.iter_mut().find(|w| w.0 == key) {
                Some(w) if value < w.1 => (w.1, w.2) = (value, format!("phi = {phi:.4}")),
                Some(_) => {}
                None => worst.push((key, value, format!("phi = {phi:.4}"))),
            }
        };
        let last = view.system.pieces.len() - 1;
        let mirror = (model.images > 1.0).then(|| heights(model, view, last).last().copied()).flatten();
        for (s, piece) in view.system.pieces.iter().enumerate() {
            let p = piece.pressure.value(&|g| view.global(g)).re;
            let (heights, apex) = (heights(model, view, s), view.apex(s).re);
            for (i, m) in mesh_points(view, s) {
                let scale = m.w_l.abs().max(m.w_m.abs());
                self.least_tension = self.least_tension.min(m.w_l).min(m.w_m);
                if m.w_l < -TOLERANCE * scale {
                    note("meridional tension < 0", &piece.name, m.phi, m.w_l);
                }
                if m.w_m < -TOLERANCE * scale {
                    note("hoop tension < 0", &piece.name, m.phi, m.w_m);
                }
                if !matches!(piece.kind, Kind::Free) {
                    let p_c = m.p_c;
                    if p_c < -TOLERANCE * p.abs().max(p_c.abs()) {
                        note("contact pressure < 0", &piece.name, m.phi, p_c);
                    }
                    // Where its face ends there is nothing to lie on.
                    let over = model.bodies.iter().find_map(|body| body.overhang(s, m.along));
                    if let Some((far, face)) = over.filter(|(far, _)| *far > GAP * model.initial.radius) {
                        note(&format!("lies beyond the end of {face}"), &piece.name, m.phi, -far);
                    }
                }
                // No point of the membrane stands inside a body, nor beyond its mirror.
                let h = match &piece.kind {
                    Kind::Free => heights[i],
                    Kind::Contact(_) => apex + m.drop,
                };
                for body in model.bodies.iter().filter(|body| !body.pieces.contains(&s)) {
                    let Some(foremost) = view.value(&body.h) else { continue };
                    let Some(depth) = body.penetration(m.u, h - foremost.re) else { continue };
                    if depth > GAP * model.initial.radius {
                        note(&format!("runs through {}", body.name), &piece.name, m.phi, -depth);
                    }
                }
                if let Some(mirror) = mirror.filter(|mirror| h - mirror > GAP * model.initial.radius) {
                    note("runs through its mirror image", &piece.name, m.phi, mirror - h);
                }
            }
        }
        let tau = |m: &Local<Carried>| m.sin.re.atan2(m.cos.re);
        // An edge presses on the membrane, away from the faces that meet in it.
        for edge in &model.edges {
            if let (Some(a), Some(b)) = (view.end(edge.before, Side::End), view.end(edge.before + 1, Side::Start)) {
                let (ta, tb) = (a.response.w_l.re, b.response.w_l.re);
                let size = ta.abs().max(tb.abs());
                if let Some((friction, Grip::First | Grip::At(_))) = edge.grip {
                    let beyond = (ta / tb).ln().abs() - friction * (tau(&a) - tau(&b)).abs();
                    if beyond > EDGE {
                        self.violations.push(format!("friction cannot hold at {} (by {beyond:.3e})", edge.name));
                    }
                }
                let force = [ta * a.cos.re - tb * b.cos.re, ta * a.sin.re - tb * b.sin.re];
                for (face, push) in edge.pushes(force) {
                    if push < -EDGE * size {
                        self.violations.push(format!("edge force pulls at {} off {face} ({push:.3e})", edge.name));
                    }
                }
            }
        }
        self.violations
            .extend(worst.into_iter().map(|(what, value, place)| format!("{what} ({value:.3e} at {place})")));
    }
}

/// The axial force of a face on the membrane, downwards, from the balance of that patch: p pi [u^2] - 2 pi [rho0 w_l sin tau], which
/// vanishes at a pole or tip; and the size of its terms.
fn patch_balance(view: &View, s: usize) -> (Carried, f64) {
    let piece = &view.system.pieces[s];
    let p = piece.pressure.value(&|g| view.global(g));
    let mut balance = -other_force(view, s);
    let mut size = balance.re.abs();
    for (side, sign) in [(Side::Start, -1.0), (Side::End, 1.0)] {
        let tip = matches!(
            (piece.coordinate, side),
            (Coordinate::FromTip(_), Side::Start) | (Coordinate::ToTip(_), Side::End)
        );
        if let Some(m) = view.end(s, side).filter(|_| !tip) {
            let w_l = balanced(view, s, side, &m).response.w_l;
            let (push, pull) = (m.u() * m.u() * p * PI, m.rho0 * w_l * m.sin * (2.0 * PI));
            balance = balance + (push - pull) * sign;
            size = size.max(push.re.abs()).max(pull.re.abs());
        }
    }
    (balance, size)
}

/// The membrane at an end of a piece with what its own repulsion adds to its tensions.
fn balanced(view: &View, s: usize, side: Side, m: &Local<Carried>) -> Local<Carried> {
    let piece = &view.system.pieces[s];
    let Some(repulsion) = &piece.repulsion else { return *m };
    let p: Vec<Carried> = piece.parameters().iter().map(|&g| view.global(g)).collect();
    let i = if side == Side::Start { 0 } else { view.disc.intervals(s) };
    let y: Vec<Carried> = (0..piece.states()).map(|c| view.unknown(view.disc.y(s, i) + c)).collect();
    repulsion.added_to(m, piece.height(m, &y, piece.ends(&p).2))
}

/// What the tractions besides pressure do along the tangent, and the change of the local energy of the repulsion: at fixed material
/// points, which move by du - (du/d eta) d eta where a place of the mesh moves by d eta.
fn traction_work(view: &View, s: usize) -> (f64, f64) {
    let system = &view.system;
    let piece = &system.pieces[s];
    if piece.reported() == LOADS_AT {
        return (0.0, 0.0);
    }
    let (disc, n) = (view.disc, piece.states());
    let p: Vec<Carried> = piece.parameters().iter().map(|&g| view.global(g)).collect();
    let (a, b) = piece.places(&p);
    let (mut work, mut stored) = (0.0, 0.0);
    for i in 0..disc.intervals(s) {
        let (x0, width) = (disc.meshes[s][i], disc.width(s, i));
        for (node, weight) in disc.gauss.nodes.iter().zip(&disc.gauss.weights) {
            let x = x0 + width * node;
            let y = view.interpolate(s, i, *node, n);
            let (eta, stretch) = piece.coordinate.at(x, a, b);
            let m = piece.local(&system.reference, &system.law, eta, &y);
            let measure = m.rho0 * m.rho0 * stretch * (2.0 * PI * weight * width);
            let (_, [pull, push]) = piece.balance(&system.reference, &system.law, x, &y, &p);
            let [radial, axial] = [pull * m.cos + push * m.sin, pull * m.sin - push * m.cos];
            let moves = |v: Carried, slope: f64| v.du[TANGENT] - slope * eta.du[TANGENT];
            let along = (m.rho0 * m.lambda).re;
            let du = moves(m.u(), along * m.cos.re);
            let dh = match &piece.kind {
                Kind::Free => moves(y.get(3).copied().unwrap_or(Carried::from(0.0)), along * m.sin.re),
                Kind::Contact(face) => moves(view.apex(s) + face.drop(face.parameter(y[1], m.rho0)), along * m.sin.re),
            };
            work += measure.re * (radial.re * du + axial.re * dh);
            if let Some(repulsion) = &piece.repulsion {
                let h = piece.height(&m, &y, piece.ends(&p).2);
                let local = repulsion.local(m.lambda, m.mu).w * repulsion.factor(h)[0];
                stored += (measure * local).du[TANGENT];
                // What this energy does along the axis is among the tractions.
                work -= measure.re * repulsion.pull(&m, h).re * dh;
            }
        }
    }
    (work, stored)
}

/// The axial force of all other tractions on a piece, downwards.
fn other_force(view: &View, s: usize) -> Carried {
    let piece = &view.system.pieces[s];
    let repulsion = piece.repulsion.as_ref().map(|_| piece.repulsion_at());
    (LOADS_AT..LOADS_AT + piece.loads.len())
        .chain(repulsion)
        .fold(Carried::from(0.0), |sum, q| sum + view.reported(s, q))
}

/// The same force from the contact pressure, integrated over the face on pieces of unit length in eta at most.
fn integrated_force(view: &View, s: usize) -> f64 {
    let system = &view.system;
    let piece = &system.pieces[s];
    let p: Vec<f64> = piece.parameters().iter().map(|&g| view.global(g).re).collect();
    let (a, b) = piece.places(&p);
    let net = piece.pressure.value(&|g| view.global(g)).re;
    let (disc, n) = (view.disc, piece.states());
    let mut force = 0.0;
    for i in 0..disc.intervals(s) {
        let (x0, h) = (disc.meshes[s][i], disc.width(s, i));
        let span = h * piece.coordinate.at(x0 + 0.5 * h, a, b).1.abs();
        let parts = span.ceil().max(1.0);
        for part in 0..parts as usize {
            for (node, weight) in disc.gauss.fine_nodes.iter().zip(&disc.gauss.fine_weights) {
                let theta = (part as f64 + node) / parts;
                let y: Vec<f64> = view.interpolate(s, i, theta, n).iter().map(|v| v.re).collect();
                let (eta, stretch) = piece.coordinate.at(x0 + theta * h, a, b);
                let m = piece.local(&system.reference, &system.law, eta, &y);
                let p_c = piece.contact_pressure(&system.reference, &system.law, x0 + theta * h, &y, &p);
                force += 2.0 * PI * m.u() * m.lambda * m.cos * p_c * m.rho0 * stretch * weight * h / parts;
            }
        }
    }
    // Inside a tip's innermost point the patch is too small to resolve: its own balance.
    for (side, sign) in [(Side::Start, 1.0), (Side::End, -1.0)] {
        if matches!((piece.coordinate, side), (Coordinate::FromTip(_), Side::Start) | (Coordinate::ToTip(_), Side::End))
            && let Some(m) = view.end(s, side)
        {
            let u = m.u().re;
            force += sign * (PI * u * u * net - 2.0 * PI * (m.rho0 * m.response.w_l * m.sin).re);
        }
    }
    force
}

/// The axial position at each mesh point of a free piece; empty on a face, which knows it from the radius.
pub(super) fn heights(model: &Model, view: &View, s: usize) -> Vec<f64> {
    let system = &view.system;
    let piece = &system.pieces[s];
    if piece.kind.coupled() == 0 {
        return vec![];
    }
    let Some(start) = view.value(&model.heights[s]) else { return vec![] };
    let disc = view.disc;
    let (n, k) = (piece.states(), disc.gauss.stages());
    let p: Vec<f64> = piece.parameters().iter().map(|&g| view.global(g).re).collect();
    let mut out = vec![0.0; n + piece.kind.coupled()];
    let mut h = start.re;
    let mut list = vec![h];
    for i in 0..disc.intervals(s) {
        let (x0, width) = (disc.meshes[s][i], disc.width(s, i));
        for j in 0..k {
            let y: Vec<f64> = view.interpolate(s, i, disc.gauss.nodes[j], n).iter().map(|v| v.re).collect();
            piece.flow(&system.reference, &system.law, x0 + width * disc.gauss.nodes[j], &y, &p, &mut out);
            h += width * disc.gauss.weights[j] * out[n];
        }
        list.push(h);
    }
    list
}

/// The membrane at a mesh point, plain numbers.
struct Plain {
    phi: f64,
    rho0: f64,
    u: f64,
    sin: f64,
    w_l: f64,
    w_m: f64,
    /// Meridional tension with what its own repulsion adds.
    w_balanced: f64,
    /// Contact pressure; zero on free pieces.
    p_c: f64,
    /// Position below the apex of the face; zero on free pieces.
    drop: f64,
    /// Parameter of the generator of the face; zero on free pieces.
    along: f64,
}

fn mesh_points(view: &View, s: usize) -> Vec<(usize, Plain)> {
    let system = &view.system;
    let piece = &system.pieces[s];
    let p: Vec<f64> = piece.parameters().iter().map(|&g| view.global(g).re).collect();
    let (a, b) = piece.places(&p);
    let n = piece.states();
    (0..=view.disc.intervals(s))
        .map(|i| {
            let x = view.disc.meshes[s][i];
            let y: Vec<f64> = (0..n).map(|c| view.unknown(view.disc.y(s, i) + c).re).collect();
            let eta = piece.coordinate.at(x, a, b).0;
            let m = piece.local(&system.reference, &system.law, eta, &y);
            let r = m.response;
            let face = match &piece.kind {
                Kind::Free => None,
                Kind::Contact(face) => Some((face, face.parameter(y[1], m.rho0))),
            };
            (
                i,
                Plain {
                    phi: system.reference.phi(eta),
                    rho0: m.rho0.value(),
                    u: m.u(),
                    sin: m.sin,
                    w_l: r.w_l,
                    w_m: r.w_m,
                    w_balanced: piece
                        .repulsion
                        .as_ref()
                        .map_or(r.w_l, |own| own.added_to(&m, piece.height(&m, &y, piece.ends(&p).2)).response.w_l),
                    p_c: piece.contact_pressure(&system.reference, &system.law, x, &y, &p),
                    drop: face.map_or(0.0, |(face, t)| face.drop(t)),
                    along: face.map_or(0.0, |(_, t)| t),
                },
            )
        })
        .collect()
}
