//! The meridian, read with a finger along the drawing: ends, segments and joints become pieces, unknowns and conditions.
//!
//! [`list`] reads the elements, [`bodies`] finds what holds them and whether it just touches the initial sphere, [`walk`] makes
//! the pieces and the unknowns, and [`conditions`] writes what holds at the ends and joints, in walking order.

mod bodies;
mod conditions;
mod list;
mod rigid;

pub use list::unknown_name;
pub use rigid::Rigid;

use super::ledger::Ledger;
use super::names::{JointName, Names, PieceName, Standing};
use super::{Adhesion, Body, Initial, Presence, token};
use crate::diagnostic::Diagnostic;
use crate::physics::reference::Reference;
use crate::physics::surface::{Facing, Surface};
use crate::spec::{Element, KinkLaw, Number, Problem};
use crate::system::{Coordinate, Kind, Piece, Place, Pressure, Side, System, tip_length};
use bodies::{axial_place, touches};
use conditions::{Bend, Conditions};
use list::{JointKind, List, read_list};
use rigid::{FLAT, rigid};

/// The meridian, understood.
pub struct Walk<'a> {
    /// Names, now with pieces and globals.
    pub names: Names<'a>,
    /// The initial state, with what surrounds it.
    pub initial: Initial,
    /// The system with the conditions of ends and joints.
    pub system: System,
    /// The ledger so far.
    pub ledger: Ledger,
    /// Name of each global.
    pub globals: Vec<String>,
    /// Initial value of each global.
    pub initial_globals: Vec<f64>,
    /// The rigid bodies.
    pub bodies: Vec<Body>,
    /// The sharp edges over which it is bent.
    pub edges: Vec<super::Edge>,
    /// The edges at which it adheres.
    pub adhesions: Vec<Adhesion>,
    /// 2 where the model is half of the membrane.
    pub images: f64,
    /// Axial position of the start of each piece.
    pub heights: Vec<crate::system::Formula>,
}

/// How the meridian ends.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Pole,
    Mirror,
    Clamp,
}

/// Finds what is wrong with the list and the bodies, whatever the initial state is.
pub fn examine(problem: &Problem, presence: &Presence, names: &Names, errors: &mut Vec<Diagnostic>) {
    read_list(problem, presence, errors);
    for body in 0..problem.bodies.len() {
        rigid(problem, names, body, errors);
    }
}

/// Walks the meridian.
pub fn walk<'a>(
    problem: &'a Problem,
    presence: &Presence,
    mut names: Names<'a>,
    initial: &Initial,
    errors: &mut Vec<Diagnostic>,
) -> Option<Walk<'a>> {
    names.initial_values(errors);
    let list = read_list(problem, presence, errors)?;
    let List { first, segments, joints, last, last_at, .. } = &list;
    let pointer = |i: usize| format!("/meridian/{i}");
    let before = errors.len();
    let disc = matches!(initial.reference, Reference::Disc { .. });
    let mut held = |h: &Number, key: &str| names.constant(h, &format!("{}/{key}/h", pointer(*last_at)), errors);
    // Where the membrane ends, and the axial position at which it is held there.
    let (end, height) = match (first, last) {
        (Element::Pole, Element::Pole) if !disc => (End::Pole, None),
        (Element::Pole, Element::Mirror { h }) if !disc => (End::Mirror, held(h, "Mirror")),
        (Element::Pole, Element::Clamped { h, .. }) if disc => (End::Clamp, held(h, "Clamped")),
        _ => {
            errors.push(Diagnostic::error("not-supported", "these ends cannot be solved by this version").at(
                "/meridian",
                if disc {
                    "of a disc: a pole first, a clamp last"
                } else {
                    "supported: a pole first, a pole or a mirror last"
                },
            ));
            return None;
        }
    };
    let images = if end == End::Mirror { 2.0 } else { 1.0 };
    let open = end != End::Pole;
    let bodies: Vec<Option<Rigid>> = (0..problem.bodies.len()).map(|b| rigid(problem, &names, b, errors)).collect();

    // What holds each segment, and on which side it is met.
    let count = segments.len();
    let mut kinds: Vec<Kind> = vec![];
    for (i, s) in segments.iter().enumerate() {
        let Some((body, face)) = s.body else {
            kinds.push(Kind::Free);
            continue;
        };
        let (body_name, _) = problem.bodies.get_index(body)?;
        let Some(rigid) = &bodies[body] else { continue };
        let face = &rigid.faces[face].face;
        let at_start = i == 0;
        let at_end = i + 1 == count && !open;
        if at_start && at_end {
            errors.push(
                Diagnostic::error("all-contact", "the whole membrane would lie on one body")
                    .at(pointer(s.at), "no free part"),
            );
        }
        let wanted = if at_start { Facing::Down } else { Facing::Up };
        if at_start != at_end && face.facing != wanted {
            let (word, place) = if at_start { ("Down", "first") } else { ("Up", "last") };
            errors.push(
                Diagnostic::error(
                    "wrong-side",
                    format!("`{body_name}` is met {place} on the walk from the top, but faces the other way"),
                )
                .at(format!("/bodies/{}/facing", token(body_name)), format!("should face {word}"))
                .at(pointer(s.at), "met here"),
            );
        }
        kinds.push(Kind::Contact(face.clone()));
    }
    if errors.len() > before {
        return None;
    }
    // The material places at which edges and contacts touch the initial sphere.
    let touches = touches(problem, &list, &bodies, open, initial, errors)?;
    if errors.len() > before {
        return None;
    }

    // The pressure outside the initial sphere, the same all around it.
    let mut outside: Option<f64> = None;
    for s in segments.iter().filter(|s| s.body.is_none()) {
        let at = format!("{}/Free/outside_pressure", pointer(s.at));
        let Some(p) = names.at_start(s.outside.as_ref().unwrap_or(&Number::Value(0.0)), &at, errors) else { continue };
        if outside.is_some_and(|q| (p - q).abs() > 1e-12 * p.abs().max(q.abs())) {
            errors.push(
                Diagnostic::error(
                    "uneven-start",
                    "the pressure outside differs between free segments in the initial state",
                )
                .at(at, format!("{p} here, {} before", outside.unwrap_or(0.0)))
                .help("the initial state is a sphere: unknown pressures start where they are equal"),
            );
        }
        outside = outside.or(Some(p));
    }
    let initial = &names.surrounded(outside.unwrap_or(0.0))?;

    // Globals: a place for each joint, a height for each free segment, the pressure, the declared unknowns.
    let mut globals: Vec<String> = vec![];
    let mut initial_globals: Vec<f64> = vec![];
    let mut ledger = Ledger::default();
    for (s, kind) in segments.iter().zip(&kinds) {
        let origin = format!("segment {}", s.name);
        let states: &[&str] = match kind {
            Kind::Free => &["u", "h", "tau", "lambda"],
            Kind::Contact(face) if matches!(face.surface, Surface::Cylinder(_)) => &["h", "lambda"],
            Kind::Contact(_) => &["u", "lambda"],
        };
        for state in states {
            ledger.unknown(format!("{}: {state}", s.name), format!("state of {}", s.name), origin.clone());
        }
    }
    let mut joint_names = vec![];
    for (i, (pair, joint)) in segments.windows(2).zip(joints).enumerate() {
        let (name, origin) = match &joint.kind {
            JointKind::Smooth => (format!("{}/{}", pair[0].name, pair[1].name), "joint (Smooth)"),
            JointKind::Kink(name, ..) => ((*name).to_owned(), "joint (Kink)"),
            JointKind::Adhesive(_) => (format!("{}/{}", pair[0].name, pair[1].name), "joint (AdhesiveEdge)"),
            JointKind::Written(name, ..) => ((*name).to_owned(), "joint (Joint)"),
        };
        ledger.unknown(format!("place of {name}"), "where two segments meet".into(), origin.into());
        globals.push(format!("place of {name}"));
        let start = initial.reference.eta(touches.joint(i));
        // At a pole the size of a first contact says more.
        initial_globals.push(if start.abs() < 30.0 { start } else { 0.0 });
        if !matches!(joint.kind, JointKind::Smooth) {
            // An adhesive edge pulls at the body that its contact lies on.
            let lies_on = pair[0].body.as_ref().or(pair[1].body.as_ref()).map(|b| b.0);
            let adheres = matches!(joint.kind, JointKind::Adhesive(_));
            let body = match joint.kind {
                JointKind::Kink(_, body, ..) => Some(body),
                _ if adheres => lies_on,
                _ => None,
            };
            let behind = touches.edges[i].map_or(0.0, |t| t.drop);
            joint_names.push(JointName { name, body, behind, before: i, after: i + 1 });
        }
    }
    let mut piece_names = vec![];
    for (s, kind) in segments.iter().zip(&kinds) {
        // Where tractions act on a free segment h is a state of it.
        let state = matches!(kind, Kind::Free) && super::tractions::act_on(problem, &s.name);
        let h0 = (kind.coupled() > 0 && !state).then(|| {
            globals.push(format!("{}.start.h", s.name));
            initial_globals.push(0.0);
            globals.len() - 1
        });
        let (part, chain) = s.part;
        piece_names.push(PieceName { name: s.name.clone(), body: s.body.map(|b| b.0), element: s.at, part, chain, h0 });
    }
    if problem.fluid.is_some() {
        names.fluid_pressure = Some(globals.len());
        ledger.unknown("p_f".into(), "pressure of the fluid".into(), "fluid".into());
        globals.push("p_f".into());
        initial_globals.push(initial.pressure + initial.outside);
    }
    for name in problem.unknowns.keys() {
        names.unknowns.insert(name.clone(), globals.len());
        ledger.unknown(name.clone(), "declared unknown".into(), "unknowns".into());
        initial_globals.push(names.initial_value(name, initial).unwrap_or(0.0));
        globals.push(name.clone());
    }

    let mut pieces = vec![];
    for (i, (s, kind)) in segments.iter().zip(&kinds).enumerate() {
        let from = if i == 0 { Place::Pole } else { Place::Unknown(i - 1) };
        let to = match (i + 1 == count, open) {
            (false, _) => Place::Unknown(i),
            (true, true) => Place::Fixed(0.0),
            (true, false) => Place::Pole,
        };
        let (order, inclination) = match kind {
            Kind::Contact(face) => (2.0, face.tip_inclination()),
            _ => (1.0, 0.0),
        };
        let tip = inclination.abs() > FLAT;
        let length = tip_length(&initial.law, inclination.abs());
        let coordinate = match (from, to) {
            (Place::Pole, Place::Pole) => Coordinate::PoleToPole,
            (Place::Pole, _) if tip => Coordinate::FromTip(length),
            (Place::Pole, _) => Coordinate::FromPole(order),
            (_, Place::Pole) if tip => Coordinate::ToTip(length),
            (_, Place::Pole) => Coordinate::ToPole(order),
            _ => Coordinate::Between,
        };
        // Behind a contact between two other segments stands what stands outside the free one that it continues smoothly.
        let behind = match (kind, i.checked_sub(1)) {
            (Kind::Contact(_), Some(j)) if i + 1 < count || open => {
                if matches!(joints[j].kind, JointKind::Smooth) || i + 1 == count {
                    &segments[j]
                } else {
                    &segments[i + 1]
                }
            }
            _ => s,
        };
        let outside = behind
            .outside
            .as_ref()
            .filter(|n| !n.is_zero())
            .and_then(|n| names.globals(n, &format!("{}/Free/outside_pressure", pointer(behind.at)), errors));
        pieces.push(Piece {
            name: s.name.clone(),
            kind: kind.clone(),
            coordinate,
            from,
            to,
            pressure: Pressure { fluid: names.fluid_pressure, outside },
            loads: vec![],
            reach: 1.0,
            level: 0.0,
            apex: None,
            repulsion: None,
            integrals: vec![],
        });
    }
    let mut names = names.with_pieces(piece_names, joint_names, list.absent.clone(), pieces.clone(), images);
    let middle = axial_place(problem, &names, initial, &list, &touches, height, &mut initial_globals, errors);
    names.standing = Some(Standing { middle, joints: (0..count - 1).map(|i| touches.joint(i)).collect() });
    super::tractions::apply(problem, &mut names, &mut pieces, errors);
    names.set_shapes(&pieces);
    let mut system = System::new(initial.reference.clone(), initial.law.clone(), pieces, globals.len());

    let mut adhesions = vec![];
    let mut conditions = Conditions { system: &mut system, ledger: &mut ledger, names: &mut names, errors };
    for i in 0..count {
        match i.checked_sub(1) {
            None => conditions.pole(i, Side::Start),
            Some(before) => {
                let at = pointer(joints[before].at);
                match &joints[before].kind {
                    JointKind::Smooth => match (segments[before].body, segments[before + 1].body) {
                        (Some((one, a)), Some((other, b))) => {
                            let rigid = bodies[one].as_ref().filter(|_| one == other);
                            conditions.seam(before, rigid, [a, b], &at);
                        }
                        _ => conditions.smooth(before),
                    },
                    JointKind::Kink(name, body, edge, law) => {
                        let sides = [before, before + 1].map(|i| segments[i].body);
                        let rigid = bodies[*body].as_ref()?;
                        let (phi, grip) = (touches.joint(before), presence.grip(joints[before].at));
                        conditions.kink(
                            before,
                            &Bend { name, body: *body, edge: &rigid.edges[*edge], sides, phi, grip },
                            law,
                            &at,
                        );
                    }
                    JointKind::Adhesive(energy) => {
                        let free_first = segments[before].body.is_none();
                        adhesions.extend(conditions.adhesive(before, free_first, energy, &at));
                    }
                    JointKind::Written(name, continuous, list) => conditions.joint(name, continuous, list, &at),
                }
            }
        }
        if i + 1 == count {
            match (end, last) {
                (End::Mirror, Element::Mirror { h }) => conditions.mirror(i, h, height),
                (End::Clamp, Element::Clamped { u, h }) => {
                    let at = format!("{}/Clamped", pointer(*last_at));
                    conditions.clamp(i, [u, h], height, &at);
                }
                _ => conditions.pole(i, Side::End),
            }
        }
    }
    let mut standing: Vec<Body> = vec![];
    for ((name, _), rigid) in problem.bodies.iter().zip(&bodies) {
        let h = names.build(&system, false, |b, _| Ok(b.constant(0.0)))?;
        standing.push(Body { name: name.clone(), rigid: rigid.clone()?, h, pieces: vec![], faces: vec![] });
    }
    let mut heights = vec![];
    for (i, s) in segments.iter().enumerate() {
        heights.push(names.build(&system, false, |b, x| x.h(b, i, Side::Start))?);
        if let Some((body, face)) = s.body {
            standing[body].pieces.push(i);
            standing[body].faces.push(face);
        }
    }
    let mut edges = vec![];
    for (i, joint) in joints.iter().enumerate() {
        if let JointKind::Kink(name, body, edge, law) = joint.kind {
            let rigid = bodies[body].as_ref()?;
            let faces = rigid.into_solid(&rigid.edges[edge]);
            let grip = match law {
                KinkLaw::Capstan { friction } => {
                    let at = format!("{}/Kink/law/Capstan/friction", pointer(joint.at));
                    let mu = names.constant(friction, &at, errors)?;
                    if mu < 0.0 {
                        errors.push(
                            Diagnostic::error("negative-friction", format!("friction must not be negative, not {mu}"))
                                .at(at, format!("is {mu}")),
                        );
                    }
                    Some((mu, presence.grip(joint.at)))
                }
                _ => None,
            };
            edges.push(super::Edge { name: name.to_owned(), before: i, faces, grip });
        }
    }
    let initial = Initial { middle, ..initial.clone() };
    Some(Walk {
        names,
        initial,
        system,
        ledger,
        globals,
        initial_globals,
        bodies: standing,
        edges,
        adhesions,
        images,
        heights,
    })
}
