//! The first state of a branch, without a guess from the user.
//!
//! The initial state is known in closed form, but a listed contact has size zero there, which is no state of the equations. So the
//! first state has a small contact: the bodies are flattened to planes, the membrane is the inflated sphere with a small flat on
//! it, and the radius of the first contact is prescribed instead of the control. From there the bodies rise to their shapes.

use super::rank;
use super::state::{self, Halt, Work};
use crate::bvp::{Discretization, Estimate, Gauss, Linearization, Problem, Residual, uniform};
use crate::model::Model;
use crate::physics::surface::{Face, Generator, Surface};
use crate::solution::Solution;
use crate::system::{Closing, Coordinate, Field, Formula, Kind, Piece, Place, Probe, Side, System};
use std::sync::Arc;

/// Stages of the collocation.
const STAGES: usize = 5;
/// Radii of a first contact, in radii of the inflated sphere, in the order in which they are tried.
pub(super) const FIRST_CONTACTS: [f64; 4] = [0.1, 0.05, 0.2, 0.02];
/// Radius of a first contact, in lengths along which a body is straight, at most.
pub(super) const SMALL: f64 = 0.3;
/// Radius, in radii of the inflated sphere, of a contact that is none.
const NO_CONTACT: f64 = 1e-9;
/// Refinement of the mesh of the closed-form state, so that it solves the discrete equations to rounding.
pub(super) const FINER: usize = 6;
/// The finest sample of the closed-form state that is reported.
const FINEST: usize = 64;
/// The smallest singular value of the conditions, relative to the largest, where branches cross. A place at which a radius is largest
/// is known to the square root of rounding only.
const CROSSING: f64 = 1e-7;
/// Intervals of a first mesh that shrink towards an edge of contact, and their ratio.
const GRADES: i32 = 8;
const GRADE: f64 = 0.4;
/// Stretch of the first state of a membrane that starts without load.
const FIRST_STRETCH: f64 = 1.02;

/// The formula that is one probe.
pub(super) fn single(system: &System, probe: Probe) -> Formula {
    let mut builder = crate::expr::Builder::new();
    let node = builder.input(0);
    builder.output(node);
    system.formula(builder.finish(), vec![probe])
}

/// The formula of the length in eta between two places.
fn width(system: &System, from: usize, to: usize) -> Formula {
    let mut builder = crate::expr::Builder::new();
    let (a, b) = (builder.input(0), builder.input(1));
    let node = builder.sub(b, a);
    builder.output(node);
    system.formula(builder.finish(), vec![Probe::Global(from), Probe::Global(to)])
}

/// True for a piece that starts or ends at a pole or tip.
pub(super) fn at_pole(piece: &Piece) -> bool {
    piece.from == Place::Pole || piece.to == Place::Pole
}

/// The initial state itself, sampled on a mesh `finer` times as fine as a first one: edges of contacts where the radius is `contact`,
/// in radii of the sphere.
pub(super) fn sample(model: &Model, stretch: f64, contact: f64, finer: usize) -> (Arc<Discretization>, Vec<f64>) {
    let system = &model.system;
    let sphere = model.initial.at(stretch);
    let meshes = system
        .pieces
        .iter()
        .map(|p| match p.coordinate {
            Coordinate::FromTip(_) | Coordinate::ToTip(_) => uniform(8 * finer),
            Coordinate::Between => uniform(8 * finer),
            Coordinate::FromPole(order) | Coordinate::ToPole(order) if order > 1.0 => uniform(2 * finer),
            _ => uniform(5 * finer),
        })
        .collect::<Vec<_>>();
    // Forces at a distance act near the edges of contacts.
    let meshes = (system.pieces.iter().zip(meshes))
        .map(|(p, mesh)| if p.loads.is_empty() { mesh } else { grades(p, mesh) })
        .collect();
    let disc = Discretization::new(system.layout().clone(), Arc::new(Gauss::new(STAGES)), meshes);
    let mut globals = model.initial_globals.clone();
    let eta_c = (0.5 * contact.asin()).tan().ln();
    for piece in &system.pieces {
        if let Kind::Contact(_) = piece.kind {
            match (piece.from, piece.to) {
                (Place::Unknown(a), Place::Unknown(b)) => {
                    // A band around the circle that touches.
                    globals[a] -= 0.5 * contact;
                    globals[b] += 0.5 * contact;
                }
                (_, Place::Unknown(g)) => globals[g] = eta_c,
                (Place::Unknown(g), _) => globals[g] = -eta_c,
                _ => {}
            }
        }
    }
    if let Some(p) = model.fluid_pressure {
        globals[p] = sphere.pressure + sphere.outside;
    }
    let reference = &system.reference;
    let exact = |s: usize, x: f64, y: &mut [f64]| {
        let piece = &system.pieces[s];
        let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
        let (a, b) = piece.places(&p);
        let eta = piece.coordinate.at(x.clamp(0.0, 1.0), a, b).0;
        y.fill(stretch.ln());
        match &piece.kind {
            Kind::Free => {
                let phi = reference.phi(eta);
                y[2] = model.initial.tau(phi);
                if piece.follows_height() {
                    y[3] = model.initial.middle - reference.radius() * stretch * model.initial.profile(phi)[1];
                }
            }
            Kind::Contact(face) if !at_pole(piece) => {
                let rho0 = reference.at(eta).rho0;
                if let Some(t) = face.surface.at_radius(stretch * rho0) {
                    y[1] = face.state(t, rho0);
                }
            }
            Kind::Contact(_) => {}
        }
    };
    let mut z = disc.sample(&globals, exact);
    if !system.pieces.iter().any(|p| matches!(p.kind, Kind::Contact(_))) {
        slopes(system, &disc, &globals, exact, &mut z);
    }
    // The quadratures of a sphere, so that the first residual is small.
    for (s, piece) in system.pieces.iter().enumerate() {
        if piece.kind.coupled() > 0 {
            let mut q = [0.0; 2];
            crate::bvp::quadratures_along(system, &disc, &|i| z[i], s, &mut q);
            let at = disc.q(s);
            z[at..at + 2].copy_from_slice(&q);
        }
    }
    (Arc::new(disc), z)
}

/// A mesh with intervals that shrink towards the places where the piece meets another one.
pub(super) fn grades(piece: &Piece, mut mesh: Vec<f64>) -> Vec<f64> {
    let joint = |place| matches!(place, Place::Unknown(_));
    let step = mesh[1];
    for level in 1..=GRADES {
        let near = step * GRADE.powi(level);
        if joint(piece.from) {
            mesh.push(near);
        }
        if joint(piece.to) {
            mesh.push(1.0 - near);
        }
    }
    mesh.sort_by(f64::total_cmp);
    mesh
}

/// Stage derivatives as the equations give them, for a sample that is a solution.
fn slopes(
    system: &System,
    disc: &Discretization,
    globals: &[f64],
    exact: impl Fn(usize, f64, &mut [f64]),
    z: &mut [f64],
) {
    let k = disc.gauss.stages();
    for (s, piece) in system.pieces.iter().enumerate() {
        let n = piece.states();
        let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
        let (mut y, mut slope) = (vec![0.0; n], vec![0.0; n]);
        for i in 0..disc.intervals(s) {
            for j in 0..k {
                let x = disc.meshes[s][i] + disc.width(s, i) * disc.gauss.nodes[j];
                exact(s, x, &mut y);
                system.flow(s, x, &y, &p, &mut slope);
                if slope.iter().all(|v| v.is_finite()) {
                    let at = disc.k(s, i) + j * n;
                    z[at..at + n].copy_from_slice(&slope);
                }
            }
        }
    }
}

/// The initial state itself, in closed form: contacts of no size. Where there is none it is a state of the branch, and what is summed
/// along it (axial positions, lengths, areas, volumes) is read from ever finer samples, until the last two agree within what they claim;
/// by how much they differ goes into the error.
pub(super) fn initial(model: &Model) -> Solution {
    let read = |finer| {
        let (disc, z) = sample(model, model.initial.stretch, NO_CONTACT, finer);
        let nothing = vec![0.0; disc.unknowns()];
        Solution::read(model, &model.system, &disc, &z, &nothing, &Estimate::none(&disc), &nothing)
    };
    let mut solution = read(1);
    let mut finer = 1;
    while !model.touches() && finer < FINEST {
        finer *= 2;
        let coarse = std::mem::replace(&mut solution, read(finer));
        let mut settled = true;
        for (fine, coarse) in solution.quantities.iter_mut().zip(&coarse.quantities) {
            if let (Some(fine), Some(coarse)) = (fine, coarse) {
                let change = (fine.value - coarse.value).abs();
                settled &= change <= fine.error;
                fine.discretisation += change;
                fine.error += change;
            }
        }
        if settled {
            break;
        }
    }
    solution
}

/// The first state: a small contact, or a small inflation where there is no contact.
///
/// # Errors
/// [`Halt`] of the last attempt.
pub(super) fn first(model: &Model, work: &mut Work) -> Result<Solution, Halt> {
    let mut result = first_with(model, FIRST_CONTACTS[0], work);
    for contact in &FIRST_CONTACTS[1..] {
        if result.is_ok() || !model.touches() {
            break;
        }
        result = first_with(model, *contact, work).or(result);
    }
    result
}

/// Moves the closing condition and the sample on to the first step of the branch, where the initial state is one in which branches
/// cross: a thread around the equator may stay there as it is pulled tight, or slide off. Of the directions in which the states
/// there go on, the least one is that of the branch along which nothing else changes.
fn beside(model: &Model, system: &mut System, disc: &mut Arc<Discretization>, z: &mut Vec<f64>) {
    let (fine, exact) = sample(model, model.initial.stretch, 0.0, FINER);
    let Some(scales) = rank::singular(system, &fine, &exact, CROSSING) else { return };
    (*disc, *z) = (fine, exact);
    let Ok(factors) = Linearization::new(system, disc, z) else { return };
    let Closing::Value { target, .. } = &mut system.closing else { return };
    let targets = model.branch.steps.targets(*target);
    let Some(next) = targets.iter().find(|t| *t != target) else { return };
    let mut along = Residual::zero(disc);
    *along.conditions.last_mut().expect("a closing condition") = *target - next;
    let mut delta = vec![0.0; z.len()];
    factors.solve_least(disc, &along, &scales, CROSSING, &mut delta);
    z.iter_mut().zip(&delta).for_each(|(z, d)| *z += d);
    *target = *next;
}

/// The first state with a first contact of a radius.
fn first_with(model: &Model, radius: f64, work: &mut Work) -> Result<Solution, Halt> {
    let mut system = model.system.clone();
    let contacts = || (0..system.pieces.len()).filter(|&s| matches!(system.pieces[s].kind, Kind::Contact(_)));
    // A contact at a pole says best how far the bodies are pressed on.
    let contact = contacts().find(|&s| at_pole(&system.pieces[s])).or(contacts().next());
    let Some(contact) = contact else {
        let stretch = if model.initial.stretch == 1.0 { FIRST_STRETCH } else { model.initial.stretch };
        let (mut disc, mut z) = sample(model, stretch, radius, 1);
        let index = disc.slot_index();
        system.closing = if model.initial.stretch == 1.0 {
            // The loads that hold this inflation are unknown: the stretch is prescribed.
            Closing::Value { of: single(&system, Probe::End(0, Side::Start, Field::Lambda)), target: stretch }
        } else {
            // The control where the sample has it: nothing is prescribed that the sample does not nearly satisfy.
            let of =
                model.quantities.iter().find(|q| q.name == model.branch.control).expect("the control is a quantity");
            let target = of.formula.value(&model.system, &|slot| z[index[slot]]);
            Closing::Value { of: of.formula.clone(), target }
        };
        if model.initial.stretch != 1.0 {
            beside(model, &mut system, &mut disc, &mut z);
        }
        return state::solve(model, &mut system, &mut disc, &mut z, &[], work);
    };
    // On a curved body the first contact is small against its curvature.
    let raised = system.pieces.iter().filter(|p| at_pole(p)).filter_map(|p| match &p.kind {
        Kind::Contact(face) => Some(face.clone()),
        Kind::Free => None,
    });
    let raised: Vec<Face> = raised.collect();
    let straight = raised.iter().fold(f64::INFINITY, |l, face| l.min(face.surface.straight()));
    let radius = radius.min(SMALL * straight / model.initial.radius);
    let (mut disc, mut z) = sample(model, model.initial.stretch, radius, 1);
    let steepest = raised.iter().fold(0.0_f64, |a, face| a.max(face.tip_inclination()));
    system.closing = match (system.pieces[contact].from, system.pieces[contact].to) {
        (Place::Unknown(a), Place::Unknown(b)) => Closing::Value { of: width(&system, a, b), target: radius },
        (_, to) => {
            let side = if matches!(to, Place::Unknown(_)) { Side::End } else { Side::Start };
            Closing::Value {
                of: single(&system, Probe::End(contact, side, Field::U)),
                target: radius * steepest.cos() * model.initial.radius,
            }
        }
    };
    let newton = state::newton(1e-6);
    let raise = |system: &mut System, rise: f64| {
        for (piece, own) in system.pieces.iter_mut().zip(&model.system.pieces) {
            if let (Kind::Contact(face), Kind::Contact(own), true) = (&mut piece.kind, &own.kind, at_pole(own)) {
                face.depth = rise * own.depth;
            }
            piece.reach = rise;
        }
    };
    let fail = |failure| Halt::Newton { failure, worst: vec!["while the first contact was sought".into()] };
    raise(&mut system, 0.0);
    newton.solve(&system, &disc, &mut z, &mut None, &mut work.effort).map_err(fail)?;
    // Rise of the bodies and reach of the loads: as large a step as Newton takes, and the mesh follows.
    let (mut done, mut step) = (0.0, 1.0_f64);
    let flat = raised.iter().all(|face| matches!(face.surface, Surface::Plane(_)));
    if !flat || system.pieces.iter().any(|piece| !piece.loads.is_empty()) {
        while done < 1.0 {
            let next = (done + step).min(1.0);
            raise(&mut system, next);
            let mut trial = z.clone();
            let mut kept = None;
            match newton.solve(&system, &disc, &mut trial, &mut kept, &mut work.effort) {
                Ok(()) => {
                    z = trial;
                    done = next;
                    step *= 1.5;
                    if let Some(factors) = kept {
                        let estimate = Estimate::new(&system, &disc, &z, &factors);
                        let meshes = crate::bvp::equidistribute(&disc, &estimate, 1.0, 2);
                        let better = Discretization::new(disc.layout.clone(), disc.gauss.clone(), meshes);
                        z = disc.transfer(&z, &better);
                        disc = Arc::new(better);
                    }
                }
                Err(f) => {
                    step *= 0.5;
                    if step < 1e-3 {
                        return Err(fail(f));
                    }
                }
            }
        }
    }
    raise(&mut system, 1.0);
    state::solve(model, &mut system, &mut disc, &mut z, &[], work)
}
