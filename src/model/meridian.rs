//! The meridian, read with a finger along the drawing: ends, segments and joints become pieces, unknowns and conditions.

use super::binder::{JointName, Names, PieceName};
use super::ledger::Ledger;
use super::{Body, Initial, Presence, facing, token};
use crate::diagnostic::Diagnostic;
use crate::expr::{ExprError, nearest};
use crate::physics::surface::{Cone, Face, Facing, Plane, Surface};
use crate::spec::{self, Element, KinkLaw, Number, Problem, Shape};
use crate::system::{Coordinate, Field, Kind, Piece, Place, Pressure, Side, System, tip_length};
use std::f64::consts::PI;

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
    /// The bodies that the membrane touches along a face.
    pub bodies: Vec<Body>,
    /// The sharp edges over which it is bent.
    pub edges: Vec<super::Edge>,
    /// 2 where the model is half of the membrane.
    pub images: f64,
    /// Axial position of the start of each piece.
    pub heights: Vec<crate::system::Formula>,
}

/// Inclination below which a cone is a plane.
const FLAT: f64 = 1e-9;

/// A segment of the list.
struct Segment {
    at: usize,
    name: String,
    /// The body it lies on, and the face of that body where it has several.
    body: Option<(usize, Option<String>)>,
    outside: Option<Number>,
}

/// A joint of the list.
struct Joint<'a> {
    at: usize,
    kind: JointKind<'a>,
}

/// What joins two segments.
enum JointKind<'a> {
    /// A smooth contact edge.
    Smooth,
    /// A sharp rigid edge: its name, its body, its law.
    Kink(&'a str, usize, &'a KinkLaw),
    /// Exactly what is written.
    Written(&'a str, &'a [spec::Formula], &'a indexmap::IndexMap<String, spec::Equation>),
}

/// The list, read.
struct List<'a> {
    first: &'a Element,
    segments: Vec<Segment>,
    /// One between each two segments.
    joints: Vec<Joint<'a>>,
    last: &'a Element,
    last_at: usize,
    /// Names of segments and joints that are absent in this stage.
    absent: Vec<String>,
}

/// The body and the face that a name such as `cone` or `pipette.wall` means.
fn face_of(problem: &Problem, name: &str) -> Option<(usize, Option<String>)> {
    if let Some(body) = problem.bodies.get_index_of(name) {
        return Some((body, None));
    }
    let (body, face) = name.split_once('.')?;
    let index = problem.bodies.get_index_of(body)?;
    let faces: &[&str] = match problem.bodies[index].shape {
        Shape::Pipette { .. } => &["wall", "mouth"],
        _ => &[],
    };
    faces.contains(&face).then(|| (index, Some(face.to_owned())))
}

/// All names of bodies and faces.
fn faces(problem: &Problem) -> Vec<String> {
    let mut names = vec![];
    for (name, body) in &problem.bodies {
        match body.shape {
            Shape::Pipette { .. } => names.extend(["wall", "mouth"].map(|f| format!("{name}.{f}"))),
            _ => names.push(name.clone()),
        }
    }
    names
}

fn unknown_face(problem: &Problem, name: &str, pointer: String) -> Diagnostic {
    let known = faces(problem);
    let mut d = Diagnostic::error("unknown-name", format!("there is no body or face `{name}`"))
        .at(pointer, "no body has this name");
    if let Some(near) = nearest(name, known.iter().map(String::as_str)) {
        d = d.help(format!("did you mean `{near}`?"));
    }
    d.help(format!("bodies and faces: {}", known.join(", ")))
}

/// Reads the list of elements that are present.
fn read_list<'a>(problem: &'a Problem, presence: &Presence, errors: &mut Vec<Diagnostic>) -> Option<List<'a>> {
    let Some(elements) = &problem.meridian else {
        errors.push(
            Diagnostic::error("missing-meridian", "the file has no meridian")
                .at("", "no `meridian` in this problem")
                .help("list what the membrane meets from its top: meridian: [Pole, Contact(on: \"..\"), Free(name: \"..\"), .., Pole]"),
        );
        return None;
    };
    let before = errors.len();
    let pointer = |i: usize| format!("/meridian/{i}");
    let is_end = |e: &Element| {
        matches!(e, Element::Pole | Element::Mirror { .. } | Element::Clamped { .. } | Element::End { .. })
    };
    if elements.len() < 3 {
        errors.push(
            Diagnostic::error("short-meridian", "a meridian has two ends and at least one segment between them")
                .at("/meridian", format!("{} elements", elements.len())),
        );
        return None;
    }
    let last = elements.len() - 1;
    for i in [0, last] {
        if !is_end(&elements[i]) {
            errors.push(
                Diagnostic::error("no-end", "a meridian starts and ends with an end")
                    .at(pointer(i), "not an end")
                    .help("ends: Pole, Mirror(h: ..), Clamped(u: .., h: ..), End(conditions: ..)"),
            );
        }
    }
    let mut segments: Vec<Segment> = vec![];
    let mut between: Vec<Vec<Joint>> = vec![];
    let mut absent = vec![];
    for (i, element) in elements.iter().enumerate().take(last).skip(1) {
        if !presence.has(element, i) {
            if let Element::Contact { on, name, .. } = element {
                absent.push(name.as_ref().unwrap_or(on).as_str().to_owned());
            }
            if let Element::Kink { at, .. } = element {
                absent.push(at.as_str().to_owned());
            }
            continue;
        }
        let mut unsupported = |what: &str| {
            errors.push(
                Diagnostic::error("not-supported", format!("{what} cannot be solved by this version"))
                    .at(pointer(i), "not supported yet"),
            );
        };
        let mut joint = |kind: JointKind<'a>| match between.last_mut() {
            Some(joints) => joints.push(Joint { at: i, kind }),
            None => between.push(vec![Joint { at: i, kind }]),
        };
        match element {
            Element::Free { name, outside_pressure } => {
                segments.push(Segment {
                    at: i,
                    name: name.as_str().to_owned(),
                    body: None,
                    outside: outside_pressure.clone(),
                });
                between.push(vec![]);
            }
            Element::Contact { on, name, law, .. } => {
                if *law != spec::ContactLaw::Frictionless {
                    unsupported("contact without slip");
                }
                let face = face_of(problem, on.as_str()).filter(|f| f.1.as_deref() != Some("mouth"));
                if face.is_none() {
                    errors.push(unknown_face(problem, on.as_str(), format!("{}/Contact/on", pointer(i))));
                }
                let name = name.as_ref().unwrap_or(on).as_str().to_owned();
                segments.push(Segment { at: i, name, body: Some(face.unwrap_or((usize::MAX, None))), outside: None });
                between.push(vec![]);
            }
            Element::Smooth => joint(JointKind::Smooth),
            Element::Kink { at, law, .. } => {
                if matches!(law, KinkLaw::Capstan { .. }) {
                    unsupported("friction at an edge");
                }
                match face_of(problem, at.as_str()).filter(|f| f.1.as_deref() == Some("mouth")) {
                    Some((body, _)) => joint(JointKind::Kink(at.as_str(), body, law)),
                    None => errors.push(unknown_face(problem, at.as_str(), format!("{}/Kink/at", pointer(i)))),
                }
            }
            Element::AdhesiveEdge { .. } => unsupported("an adhesive edge"),
            Element::Joint { name, continuous, conditions } => {
                joint(JointKind::Written(name.as_str(), continuous, conditions));
            }
            _ => errors.push(
                Diagnostic::error("end-inside", "an end stands between the two ends of the meridian")
                    .at(pointer(i), "only the first and the last element are ends"),
            ),
        }
    }
    let mut joints: Vec<Joint> = vec![];
    for (k, pair) in segments.windows(2).enumerate() {
        let (a, b) = (&pair[0], &pair[1]);
        let mut here = std::mem::take(&mut between[k]);
        match (here.pop(), here.is_empty()) {
            (Some(joint), true) => joints.push(joint),
            (Some(joint), false) => errors.push(
                Diagnostic::error("two-joints", "two joints stand between two segments")
                    .at(pointer(joint.at), "the second one"),
            ),
            (None, _) if a.body.is_none() != b.body.is_none() => {
                joints.push(Joint { at: b.at, kind: JointKind::Smooth })
            }
            (None, _) => {
                let what = if a.body.is_none() { "two free segments" } else { "two contacts" };
                errors.push(
                    Diagnostic::error(
                        "no-joint",
                        format!("{what} follow each other, and nothing says what joins them"),
                    )
                    .at(pointer(b.at), "a kink or joint is left out before this element")
                    .at(pointer(a.at), "joined to this one"),
                );
            }
        }
    }
    for joint in between.last_mut().into_iter().flatten() {
        errors.push(
            Diagnostic::error("joint-at-end", "a joint joins two segments, and there is none on one side of this one")
                .at(pointer(joint.at), "next to an end"),
        );
    }
    for (i, a) in segments.iter().enumerate() {
        if let Some(b) = segments[..i].iter().find(|b| b.name == a.name) {
            errors.push(
                Diagnostic::error("declared-twice", format!("two segments are called `{}`", a.name))
                    .at(pointer(a.at), "again here")
                    .at(pointer(b.at), "here")
                    .help("give one of them a name of its own: Contact(on: .., name: \"..\")"),
            );
        }
    }
    if segments.is_empty() && errors.len() == before {
        errors.push(
            Diagnostic::error("short-meridian", "there is no segment between the ends").at("/meridian", "no segment"),
        );
    }
    let list = List { first: &elements[0], segments, joints, last: &elements[last], last_at: last, absent };
    (errors.len() == before).then_some(list)
}

/// The surface of a body.
fn surface(problem: &Problem, names: &Names, body: usize, errors: &mut Vec<Diagnostic>) -> Option<Surface> {
    let (name, said) = problem.bodies.get_index(body)?;
    let pointer = format!("/bodies/{}/shape", token(name));
    match &said.shape {
        Shape::Plane => Some(Plane.into()),
        Shape::Cone { inclination, tip_radius, hollow } if tip_radius.is_none() && !hollow => {
            let at = format!("{pointer}/Cone/inclination");
            let angle = names.constant(inclination, &at, errors)?;
            if !(0.0..PI / 2.0).contains(&angle) || angle > 89.5_f64.to_radians() {
                let mut d = Diagnostic::error(
                    "inclination",
                    format!(
                        "the inclination of a cone must lie between 0 and 89.5 degrees, not {:.6} degrees",
                        angle.to_degrees()
                    ),
                )
                .at(at, "measured from the horizontal; 0 is flat");
                // The commonest slip: a bare number of degrees.
                if let Number::Formula(text) = inclination
                    && let Some(Number::Value(v)) = problem.parameters.get(text.trim())
                    && *v >= 2.0
                {
                    d = d.at(format!("/parameters/{}", token(text.trim())), format!("{v} radians; write \"{v}[deg]\""));
                } else if let Number::Value(v) = inclination
                    && *v >= 2.0
                {
                    d = d.help(format!("{v} radians; write \"{v}[deg]\""));
                }
                errors.push(d);
                return None;
            }
            if angle < FLAT { Some(Plane.into()) } else { Some(Cone { inclination: angle }.into()) }
        }
        _ => {
            errors.push(
                Diagnostic::error("not-supported", "this shape cannot be solved by this version")
                    .at(pointer, "not supported yet")
                    .help("supported: Plane, Cone(inclination: ..) with a sharp tip"),
            );
            None
        }
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
    let List { first, segments, joints, last, last_at, absent } = read_list(problem, presence, errors)?;
    let pointer = |i: usize| format!("/meridian/{i}");
    let before = errors.len();
    let mirror = match (first, last) {
        (Element::Pole, Element::Pole) => None,
        (Element::Pole, Element::Mirror { h }) => Some(h),
        _ => {
            errors.push(
                Diagnostic::error("not-supported", "these ends cannot be solved by this version")
                    .at("/meridian", "supported: a pole first, a pole or a mirror last"),
            );
            return None;
        }
    };
    let images = if mirror.is_some() { 2.0 } else { 1.0 };

    // What holds each segment, and on which side it is met.
    let count = segments.len();
    let mut kinds: Vec<Kind> = vec![];
    for (i, s) in segments.iter().enumerate() {
        let Some((body, part)) = &s.body else {
            kinds.push(Kind::Free);
            continue;
        };
        let (body_name, said) = problem.bodies.get_index(*body)?;
        if part.is_some() {
            if let Some(radius) = tube_radius(problem, &names, initial, *body, errors) {
                kinds.push(Kind::Wall { radius });
            }
            continue;
        }
        let face = surface(problem, &names, *body, errors).map(|surface| Face {
            surface,
            facing: facing(said.facing),
            rise: 1.0,
        });
        let at_start = i == 0;
        let at_end = i + 1 == count && mirror.is_none();
        if !at_start && !at_end {
            errors.push(
                Diagnostic::error(
                    "not-supported",
                    "contact with this body away from the poles cannot be solved by this version",
                )
                .at(pointer(s.at), "not next to a pole"),
            );
        }
        if at_start && at_end {
            errors.push(
                Diagnostic::error("all-contact", "the whole membrane would lie on one body")
                    .at(pointer(s.at), "no free part"),
            );
        }
        let wanted = if at_start { Facing::Down } else { Facing::Up };
        if (at_start != at_end) && face.as_ref().is_some_and(|f| f.facing != wanted) {
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
        kinds.extend(face.map(Kind::Contact));
    }
    // Edges, with the material place at which each touches the initial sphere.
    let mut edges: Vec<Option<Edge>> = vec![];
    for joint in &joints {
        let JointKind::Kink(_, body, _) = joint.kind else {
            edges.push(None);
            continue;
        };
        let facing = facing(problem.bodies[body].facing);
        let radius = tube_radius(problem, &names, initial, body, errors)?;
        let sine = (radius / initial.radius).asin();
        let phi = if facing == Facing::Down { sine } else { PI - sine };
        edges.push(Some(Edge { body, facing, radius, phi }));
    }
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
    for s in &segments {
        let origin = format!("segment {}", s.name);
        let states: &[&str] = match &s.body {
            None => &["u", "h", "tau", "lambda"],
            Some((_, None)) => &["u", "lambda"],
            Some(_) => &["h", "lambda"],
        };
        for state in states {
            ledger.unknown(format!("{}: {state}", s.name), format!("state of {}", s.name), origin.clone());
        }
    }
    let mut joint_names = vec![];
    for (i, (pair, joint)) in segments.windows(2).zip(&joints).enumerate() {
        let (name, origin) = match &joint.kind {
            JointKind::Smooth => (format!("{}/{}", pair[0].name, pair[1].name), "joint (Smooth)"),
            JointKind::Kink(name, ..) => ((*name).to_owned(), "joint (Kink)"),
            JointKind::Written(name, ..) => ((*name).to_owned(), "joint (Joint)"),
        };
        ledger.unknown(format!("place of {name}"), "where two segments meet".into(), origin.into());
        globals.push(format!("place of {name}"));
        let start = edges[i].as_ref().map(|e| (0.5 * e.phi).tan().ln());
        // A joint that touches nothing starts at the equator.
        initial_globals.push(start.unwrap_or(0.0));
        if !matches!(joint.kind, JointKind::Smooth) {
            let body = edges[i].as_ref().map(|e| e.body);
            joint_names.push(JointName { name, body, before: i, after: i + 1 });
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
        piece_names.push(PieceName { name: s.name.clone(), body: s.body.as_ref().map(|b| b.0), h0 });
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
        let to = match (i + 1 == count, mirror.is_some()) {
            (false, _) => Place::Unknown(i),
            (true, true) => Place::Fixed(0.0),
            (true, false) => Place::Pole,
        };
        let (order, inclination) = match kind {
            Kind::Contact(face) => (2.0, face.tip_inclination()),
            _ => (1.0, 0.0),
        };
        let tip = inclination > FLAT;
        let length = tip_length(&initial.law, inclination);
        let coordinate = match (from, to) {
            (Place::Pole, Place::Pole) => Coordinate::PoleToPole,
            (Place::Pole, _) if tip => Coordinate::FromTip(length),
            (Place::Pole, _) => Coordinate::FromPole(order),
            (_, Place::Pole) if tip => Coordinate::ToTip(length),
            (_, Place::Pole) => Coordinate::ToPole(order),
            _ => Coordinate::Between,
        };
        // Behind a wall stands what stands outside the free segment that it continues smoothly.
        let behind = match (kind, i.checked_sub(1)) {
            (Kind::Wall { .. }, Some(j)) if matches!(joints[j].kind, JointKind::Smooth) => &segments[j],
            (Kind::Wall { .. }, _) if i + 1 < count => &segments[i + 1],
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
        });
    }
    let mut names = names.with_pieces(piece_names, joint_names, absent, pieces.clone(), images);
    let middle = axial_place(problem, &names, initial, &segments, &kinds, &edges, mirror, &mut initial_globals, errors);
    names.extent = Some((middle - initial.radius, middle + initial.radius));
    super::tractions::apply(problem, &mut names, &mut pieces, errors);
    names.set_shapes(&pieces);
    let mut system = System::new(initial.reference.clone(), initial.law.clone(), pieces, globals.len());

    // Conditions, in walking order.
    let mut condition = |system: &mut System,
                         ledger: &mut Ledger,
                         names: &mut Names<'a>,
                         name: String,
                         text: String,
                         origin: String,
                         make: &Make<'_>| {
        if let Some(f) = names.build(system, true, make) {
            system.conditions.push(f);
        }
        ledger.condition(name, text, origin);
    };
    for i in 0..count {
        let piece = system.pieces[i].clone();
        let name = segments[i].name.clone();
        if i == 0 {
            pole(&mut system, &mut ledger, &mut names, &mut condition, i, Side::Start, &piece);
        } else {
            let a = segments[i - 1].name.clone();
            match &joints[i - 1].kind {
                JointKind::Smooth => {
                    let joint = format!("{a}/{name}");
                    let origin = "joint (Smooth)".to_owned();
                    for (what, field) in [("u", Field::Mu), ("tau", Field::Tau), ("lambda", Field::Lambda)] {
                        condition(
                            &mut system,
                            &mut ledger,
                            &mut names,
                            format!("{joint}: {what} continuous"),
                            format!("{a}.end.{what} = {name}.start.{what}"),
                            origin.clone(),
                            &|b, x| {
                                let (l, r) = (x.end(b, i - 1, Side::End, field), x.end(b, i, Side::Start, field));
                                Ok(b.sub(l, r))
                            },
                        );
                    }
                    condition(
                        &mut system,
                        &mut ledger,
                        &mut names,
                        format!("{joint}: h continuous"),
                        format!("{a}.end.h = {name}.start.h"),
                        origin,
                        &|b, x| {
                            let (l, r) = (x.h(b, i - 1, Side::End)?, x.h(b, i, Side::Start)?);
                            Ok(b.sub(l, r))
                        },
                    );
                }
                JointKind::Kink(edge_name, body, law) => {
                    let edge = edges[i - 1].as_ref().expect("a kink has an edge");
                    // What the faces do not satisfy already: both sides at the edge's u and h.
                    for (piece, side, end, which) in [
                        (i - 1, Side::End, format!("{a}.end"), "before"),
                        (i, Side::Start, format!("{name}.start"), "after"),
                    ] {
                        if !matches!(kinds[piece], Kind::Wall { .. }) {
                            let radius = edge.radius;
                            condition(
                                &mut system,
                                &mut ledger,
                                &mut names,
                                format!("{edge_name}: u {which}"),
                                format!("{end}.u = {radius}"),
                                "joint (Kink)".into(),
                                &|b, x| {
                                    let (u, r) = (x.end(b, piece, side, Field::U), b.constant(radius));
                                    Ok(b.sub(u, r))
                                },
                            );
                        }
                        condition(
                            &mut system,
                            &mut ledger,
                            &mut names,
                            format!("{edge_name}: h {which}"),
                            format!("{end}.h = {edge_name}.h"),
                            "joint (Kink)".into(),
                            &|b, x| {
                                let (h, at) = (x.h(b, piece, side)?, x.body_h(b, *body)?);
                                Ok(b.sub(h, at))
                            },
                        );
                    }
                    let at = pointer(joints[i - 1].at);
                    let mut written = |name: String,
                                       text: &str,
                                       at: String,
                                       origin: &str,
                                       names: &mut Names<'a>,
                                       errors: &mut Vec<Diagnostic>| {
                        if let Some(f) = names.equation(&system, text, &at, true, errors) {
                            system.conditions.push(f);
                            ledger.condition(name, text.to_owned(), origin.to_owned());
                        }
                    };
                    match law {
                        KinkLaw::Frictionless => {
                            let side =
                                |s: &str| format!("{edge_name}.{s}.lambda*{edge_name}.{s}.w_l - {edge_name}.{s}.w");
                            let text = format!("{} = {}", side("before"), side("after"));
                            let name = format!("{edge_name}: frictionless, lambda w_l - w continuous");
                            written(name, &text, at, "joint (Kink, Frictionless)", &mut names, errors);
                        }
                        KinkLaw::Stuck => {
                            let text = format!("{edge_name}.phi = {:?}", edge.phi);
                            let name = format!("{edge_name}: stuck where it first touched");
                            written(name, &text, at, "joint (Kink, Stuck)", &mut names, errors);
                        }
                        KinkLaw::StuckAt(place) => {
                            // The place is an equation in the local phi or S at the edge.
                            let text = local_to_edge(place.as_str(), edge_name);
                            let name = format!("{edge_name}: stuck");
                            written(
                                name,
                                &text,
                                format!("{at}/Kink/law/StuckAt"),
                                "joint (Kink, StuckAt)",
                                &mut names,
                                errors,
                            );
                        }
                        KinkLaw::Conditions(list) => {
                            for (name, text) in list {
                                let at = format!("{at}/Kink/law/Conditions/{}", token(name));
                                written(
                                    name.clone(),
                                    text.as_str(),
                                    at,
                                    "joint (Kink, Conditions)",
                                    &mut names,
                                    errors,
                                );
                            }
                        }
                        KinkLaw::Capstan { .. } => {}
                    }
                }
                JointKind::Written(joint, continuous, conditions) => {
                    let at = pointer(joints[i - 1].at);
                    let mut write = |name: String, text: String, at: String, names: &mut Names<'a>| {
                        if let Some(f) = names.equation(&system, &text, &at, true, errors) {
                            system.conditions.push(f);
                            ledger.condition(name, text, "joint (Joint)".into());
                        }
                    };
                    for (k, field) in continuous.iter().enumerate() {
                        let field = field.as_str();
                        let text = format!("{joint}.before.{field} = {joint}.after.{field}");
                        write(
                            format!("{joint}: {field} continuous"),
                            text,
                            format!("{at}/Joint/continuous/{k}"),
                            &mut names,
                        );
                    }
                    for (name, text) in conditions.iter() {
                        let at = format!("{at}/Joint/conditions/{}", token(name));
                        write(name.clone(), text.as_str().to_owned(), at, &mut names);
                    }
                }
            }
        }
        if i + 1 == count {
            match mirror {
                None => pole(&mut system, &mut ledger, &mut names, &mut condition, i, Side::End, &piece),
                Some(h) => {
                    let origin = "end (Mirror)".to_owned();
                    condition(
                        &mut system,
                        &mut ledger,
                        &mut names,
                        format!("{name}.end: tau = pi/2"),
                        format!("{name}.end.tau = pi/2"),
                        origin.clone(),
                        &|b, x| {
                            let tau = x.end(b, i, Side::End, Field::Tau);
                            let right = b.constant(PI / 2.0);
                            Ok(b.sub(tau, right))
                        },
                    );
                    let text = format!("{name}.end.h = {}", super::bracket(h));
                    let at = format!("{}/Mirror/h", pointer(last_at));
                    let value = names.constant(h, &at, errors).unwrap_or(0.0);
                    condition(&mut system, &mut ledger, &mut names, format!("{name}.end: h"), text, origin, &|b, x| {
                        let h = x.h(b, i, Side::End)?;
                        let v = b.constant(value);
                        Ok(b.sub(h, v))
                    });
                }
            }
        }
    }
    let mut bodies: Vec<Body> = vec![];
    let mut heights = vec![];
    for (i, (s, kind)) in segments.iter().zip(&kinds).enumerate() {
        heights.push(names.build(&system, false, |b, x| x.h(b, i, Side::Start))?);
        let (Some((body, _)), Kind::Contact(face)) = (&s.body, kind) else { continue };
        let (name, _) = problem.bodies.get_index(*body)?;
        match bodies.iter_mut().find(|b| &b.name == name) {
            Some(b) => b.pieces.push(i),
            None => {
                let zero = names.build(&system, false, |b, _| Ok(b.constant(0.0)))?;
                bodies.push(Body { name: name.clone(), face: face.clone(), h: zero, pieces: vec![i] });
            }
        }
    }
    let mut edge_list = vec![];
    for (i, (joint, edge)) in joints.iter().zip(&edges).enumerate() {
        if let (JointKind::Kink(name, ..), Some(edge)) = (&joint.kind, edge) {
            edge_list.push(super::Edge {
                name: (*name).to_owned(),
                before: i,
                radius: edge.radius,
                facing: edge.facing,
            });
        }
    }
    let initial = Initial { middle, ..initial.clone() };
    Some(Walk { names, initial, system, ledger, globals, initial_globals, bodies, edges: edge_list, images, heights })
}

/// A sharp edge, where it touches the initial sphere.
struct Edge {
    body: usize,
    facing: Facing,
    radius: f64,
    phi: f64,
}

/// The inner radius of a pipette, which must be smaller than the initial sphere.
fn tube_radius(
    problem: &Problem,
    names: &Names,
    initial: &Initial,
    body: usize,
    errors: &mut Vec<Diagnostic>,
) -> Option<f64> {
    let (name, said) = problem.bodies.get_index(body)?;
    let Shape::Pipette { radius } = &said.shape else { return None };
    let pointer = format!("/bodies/{}/shape/Pipette/radius", token(name));
    let r = names.constant(radius, &pointer, errors)?;
    if r > 0.0 && r < initial.radius {
        return Some(r);
    }
    errors.push(
        Diagnostic::error(
            "pipette-radius",
            format!(
                "the radius of the pipette, {r}, must lie between 0 and that of the initial sphere, {}",
                initial.radius
            ),
        )
        .at(pointer, format!("is {r}")),
    );
    None
}

/// `phi = ..` or `S = ..` at an edge: the local name becomes that of the edge.
fn local_to_edge(text: &str, edge: &str) -> String {
    let trimmed = text.trim_start();
    for field in ["phi", "S"] {
        if let Some(rest) = trimmed.strip_prefix(field)
            && rest.trim_start().starts_with('=')
        {
            return format!("{edge}.{field}{rest}");
        }
    }
    text.to_owned()
}

type AddCondition<'c, 'a> = dyn FnMut(&mut System, &mut Ledger, &mut Names<'a>, String, String, String, &Make<'_>) + 'c;

/// The conditions of a pole.
fn pole<'a>(
    system: &mut System,
    ledger: &mut Ledger,
    names: &mut Names<'a>,
    condition: &mut AddCondition<'_, 'a>,
    i: usize,
    side: Side,
    piece: &Piece,
) {
    let name = &piece.name;
    let end = if side == Side::Start { "start" } else { "end" };
    let tip = matches!(piece.coordinate, Coordinate::FromTip(_) | Coordinate::ToTip(_));
    if tip {
        condition(
            system,
            ledger,
            names,
            format!("{name}.{end}: u = 0 (tip)"),
            format!("d ln(mu/lambda)/d eta = 0 at {name}.{end}, the state that reaches the tip"),
            "end (Pole)".into(),
            &|b, x| Ok(x.end(b, i, side, Field::TipDrift)),
        );
        return;
    }
    condition(
        system,
        ledger,
        names,
        format!("{name}.{end}: u = 0"),
        format!("{name}.{end}.lambda = {name}.{end}.mu, the regular state of u = 0"),
        "end (Pole)".into(),
        &|b, x| {
            let (l, r) = (x.end(b, i, side, Field::Lambda), x.end(b, i, side, Field::Mu));
            Ok(b.sub(l, r))
        },
    );
    if matches!(piece.kind, Kind::Free) {
        let (value, text) = if side == Side::Start { (0.0, "0") } else { (PI, "pi") };
        condition(
            system,
            ledger,
            names,
            format!("{name}.{end}: tau = {text}"),
            format!("{name}.{end}.tau = {text}"),
            "end (Pole)".into(),
            &|b, x| {
                let tau = x.end(b, i, side, Field::Tau);
                let v = b.constant(value);
                Ok(b.sub(tau, v))
            },
        );
    }
}

/// Puts a formula together.
type Make<'m> =
    dyn Fn(&mut crate::expr::Builder, &mut super::binder::Binder) -> Result<crate::expr::Node, Vec<ExprError>> + 'm;

/// Where the middle of the initial sphere stands, and whether the bodies just touch it there.
#[allow(clippy::too_many_arguments)]
fn axial_place(
    problem: &Problem,
    names: &Names,
    initial: &Initial,
    segments: &[Segment],
    kinds: &[Kind],
    edges: &[Option<Edge>],
    mirror: Option<&Number>,
    initial_globals: &mut [f64],
    errors: &mut Vec<Diagnostic>,
) -> f64 {
    let r = initial.radius;
    let apex = |body: usize, errors: &mut Vec<Diagnostic>| -> Option<(f64, String)> {
        let (name, body) = problem.bodies.get_index(body)?;
        let pointer = format!("/bodies/{}/h", token(name));
        Some((names.at_start(&body.h, &pointer, errors)?, pointer))
    };
    // Where the middle of the sphere stands when it just touches: what each body says, faces first.
    let mut apexes: Vec<(f64, String, Facing, usize)> = vec![];
    for (s, kind) in segments.iter().zip(kinds) {
        if let (Kind::Contact(face), Some((body, _))) = (kind, &s.body)
            && let Some((h, pointer)) = apex(*body, errors)
        {
            apexes.push((h, pointer, face.facing, s.at));
        }
    }
    let mut rings = vec![];
    for edge in edges.iter().flatten() {
        if let Some((h, _)) = apex(edge.body, errors) {
            let away = (r * r - edge.radius * edge.radius).sqrt();
            rings.push(if edge.facing == Facing::Down { h + away } else { h - away });
        }
    }
    let middle = match mirror {
        Some(h) => names.constant(h, "/meridian", errors).unwrap_or(0.0),
        None => match apexes.iter().find(|a| a.2 == Facing::Up) {
            Some(up) => up.0 - r,
            None => apexes.first().map(|down| down.0 + r).or(rings.first().copied()).unwrap_or(0.0),
        },
    };
    for (h, pointer, facing, at) in &apexes {
        let touch = match facing {
            Facing::Down => middle - r,
            Facing::Up => middle + r,
        };
        let gap = match facing {
            Facing::Down => touch - h,
            Facing::Up => h - touch,
        };
        if gap.abs() > 1e-9 * r || gap.is_nan() {
            let what = if gap > 0.0 { "leaves a gap of" } else { "penetrates by" };
            errors.push(
                Diagnostic::error(
                    "no-first-touch",
                    format!(
                        "a listed contact must just touch the initial shape, but this body {what} {:.6}",
                        gap.abs()
                    ),
                )
                .at(pointer.clone(), format!("h = {h} in the initial state; {touch} would touch"))
                .at(format!("/meridian/{at}"), "the contact"),
            );
        }
    }
    // Axial position of the start of each piece on that sphere.
    let reference = &initial.reference;
    for (p, shape) in names.pieces.iter().zip(names.shapes()) {
        if let Some(g) = p.h0 {
            let phi = match shape.from {
                Place::Pole => 0.0,
                Place::Fixed(eta) => reference.phi(eta),
                Place::Unknown(place) => reference.phi(initial_globals[place]),
            };
            initial_globals[g] = middle
                - r * if matches!(shape.from, Place::Unknown(_)) && edges.iter().all(Option::is_none) {
                    1.0
                } else {
                    phi.cos()
                };
        }
    }
    middle
}
