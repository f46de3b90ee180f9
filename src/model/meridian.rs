//! The meridian, read with a finger along the drawing: ends, segments and joints become pieces, unknowns and conditions.

use super::binder::{Names, PieceName};
use super::ledger::Ledger;
use super::{Body, Initial, facing, token};
use crate::diagnostic::Diagnostic;
use crate::expr::{ExprError, nearest};
use crate::physics::surface::{Cone, Face, Facing, Plane, Surface};
use crate::spec::{self, Element, Number, Problem, Shape};
use crate::system::{Coordinate, Field, Kind, Piece, Place, Pressure, Side, System, tip_length};
use std::f64::consts::PI;

/// The meridian, understood.
pub struct Walk<'a> {
    /// Names, now with pieces and globals.
    pub names: Names<'a>,
    /// The system with the conditions of ends and joints.
    pub system: System,
    /// The ledger so far.
    pub ledger: Ledger,
    /// Name of each global.
    pub globals: Vec<String>,
    /// Initial value of each global.
    pub initial_globals: Vec<f64>,
    /// The bodies that the membrane touches.
    pub bodies: Vec<Body>,
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
    body: Option<usize>,
    outside: Option<Number>,
}

/// Reads the list of elements: ends, segments in order. Joints other than the implied ones are not solved yet.
fn read_list<'a>(
    problem: &'a Problem,
    errors: &mut Vec<Diagnostic>,
) -> Option<(&'a Element, Vec<Segment>, &'a Element, usize)> {
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
    for (i, element) in elements.iter().enumerate().take(last).skip(1) {
        let mut unsupported = |what: &str| {
            errors.push(
                Diagnostic::error("not-supported", format!("{what} cannot be solved by this version"))
                    .at(pointer(i), "not supported yet"),
            );
        };
        match element {
            Element::Free { name, outside_pressure } => {
                segments.push(Segment {
                    at: i,
                    name: name.as_str().to_owned(),
                    body: None,
                    outside: outside_pressure.clone(),
                });
            }
            Element::Contact { on, name, law, appears } => {
                if *law != spec::ContactLaw::Frictionless {
                    unsupported("contact without slip");
                }
                if appears.is_some() {
                    unsupported("a contact that appears by an event");
                }
                let body = problem.bodies.get_index_of(on.as_str());
                if body.is_none() {
                    let known: Vec<&str> = problem.bodies.keys().map(String::as_str).collect();
                    let mut d =
                        Diagnostic::error("unknown-name", format!("there is no body or face `{}`", on.as_str()))
                            .at(format!("{}/Contact/on", pointer(i)), "no body has this name");
                    if let Some(near) = nearest(on.as_str(), known.iter().copied()) {
                        d = d.help(format!("did you mean `{near}`?"));
                    }
                    errors.push(d.help(format!("bodies: {}", known.join(", "))));
                }
                let name = name.as_ref().unwrap_or(on).as_str().to_owned();
                segments.push(Segment { at: i, name, body: Some(body.unwrap_or(usize::MAX)), outside: None });
            }
            Element::Smooth => {}
            Element::Kink { .. } => unsupported("a kink"),
            Element::AdhesiveEdge { .. } => unsupported("an adhesive edge"),
            Element::Joint { .. } => unsupported("a joint with conditions of its own"),
            _ => errors.push(
                Diagnostic::error("end-inside", "an end stands between the two ends of the meridian")
                    .at(pointer(i), "only the first and the last element are ends"),
            ),
        }
    }
    for pair in segments.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        if a.body.is_none() == b.body.is_none() {
            let what = if a.body.is_none() { "two free segments" } else { "two contacts" };
            errors.push(
                Diagnostic::error("no-joint", format!("{what} follow each other, and nothing says what joins them"))
                    .at(pointer(b.at), "a kink or joint is left out before this element")
                    .at(pointer(a.at), "joined to this one"),
            );
        }
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
    (errors.len() == before).then(|| (&elements[0], segments, &elements[last], last))
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
    mut names: Names<'a>,
    initial: &Initial,
    errors: &mut Vec<Diagnostic>,
) -> Option<Walk<'a>> {
    names.initial_values(errors);
    let (first, segments, last, last_at) = read_list(problem, errors)?;
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

    // Faces, and on which side they are met.
    let count = segments.len();
    let mut faces: Vec<Option<Face>> = vec![];
    for (i, s) in segments.iter().enumerate() {
        let Some(body) = s.body else {
            faces.push(None);
            continue;
        };
        let (body_name, said) = problem.bodies.get_index(body)?;
        let face = surface(problem, &names, body, errors).map(|surface| Face {
            surface,
            facing: facing(said.facing),
            rise: 1.0,
        });
        let at_start = i == 0;
        let at_end = i + 1 == count && mirror.is_none();
        if !at_start && !at_end {
            errors.push(
                Diagnostic::error("not-supported", "a contact away from the poles cannot be solved by this version")
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
        faces.push(face);
    }
    if errors.len() > before {
        return None;
    }

    // Globals: a place for each joint, a height for each free segment, the pressure, the declared unknowns.
    let mut globals: Vec<String> = vec![];
    let mut initial_globals: Vec<f64> = vec![];
    let mut ledger = Ledger::default();
    for s in &segments {
        let origin = format!("segment {}", s.name);
        let states: &[&str] = if s.body.is_some() { &["u", "lambda"] } else { &["u", "h", "tau", "lambda"] };
        for state in states {
            ledger.unknown(format!("{}: {state}", s.name), format!("state of {}", s.name), origin.clone());
        }
    }
    for pair in segments.windows(2) {
        let name = format!("place of {}/{}", pair[0].name, pair[1].name);
        ledger.unknown(name.clone(), "where two segments meet".into(), "joint (Smooth)".into());
        globals.push(name);
        initial_globals.push(0.0);
    }
    let places = globals.len();
    let mut piece_names = vec![];
    for s in &segments {
        let h0 = s.body.is_none().then(|| {
            globals.push(format!("{}.start.h", s.name));
            initial_globals.push(0.0);
            globals.len() - 1
        });
        piece_names.push(PieceName { name: s.name.clone(), body: s.body, h0 });
    }
    if problem.fluid.is_some() {
        names.fluid_pressure = Some(globals.len());
        ledger.unknown("p_f".into(), "pressure of the fluid".into(), "fluid".into());
        globals.push("p_f".into());
        initial_globals.push(initial.pressure);
    }
    for name in problem.unknowns.keys() {
        names.unknowns.insert(name.clone(), globals.len());
        ledger.unknown(name.clone(), "declared unknown".into(), "unknowns".into());
        initial_globals.push(names.initial_value(name, initial).unwrap_or(0.0));
        globals.push(name.clone());
    }

    let mut pieces = vec![];
    for (i, (s, face)) in segments.iter().zip(&faces).enumerate() {
        let from = if i == 0 { Place::Pole } else { Place::Unknown(i - 1) };
        let to = match (i + 1 == count, mirror.is_some()) {
            (false, _) => Place::Unknown(i),
            (true, true) => Place::Fixed(0.0),
            (true, false) => Place::Pole,
        };
        let order = if face.is_some() { 2.0 } else { 1.0 };
        let inclination = face.as_ref().map_or(0.0, Face::tip_inclination);
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
        let outside = s
            .outside
            .as_ref()
            .filter(|n| !n.is_zero())
            .and_then(|n| names.globals(n, &format!("{}/Free/outside_pressure", pointer(s.at)), errors));
        pieces.push(Piece {
            name: s.name.clone(),
            kind: face.clone().map_or(Kind::Free, Kind::Contact),
            coordinate,
            from,
            to,
            pressure: Pressure { fluid: names.fluid_pressure, outside },
        });
    }
    debug_assert!(places < count.max(1));
    let mut names = names.with_pieces(piece_names, pieces.clone(), images);
    axial_place(problem, &names, initial, &segments, &faces, mirror, &mut initial_globals, errors);
    let mut system = System::new(initial.reference.clone(), initial.law.clone(), pieces, globals.len());

    // Conditions, in walking order.
    let mut condition = |system: &mut System,
                         ledger: &mut Ledger,
                         names: &mut Names<'a>,
                         name: String,
                         text: String,
                         origin: String,
                         make: &dyn Fn(
        &mut crate::expr::Builder,
        &mut super::binder::Binder,
    ) -> Result<crate::expr::Node, Vec<ExprError>>| {
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
    for (i, (s, face)) in segments.iter().zip(&faces).enumerate() {
        heights.push(names.build(&system, false, |b, x| x.h(b, i, Side::Start))?);
        let (Some(body), Some(face)) = (s.body, face) else { continue };
        let (name, _) = problem.bodies.get_index(body)?;
        match bodies.iter_mut().find(|b| &b.name == name) {
            Some(b) => b.pieces.push(i),
            None => {
                let zero = names.build(&system, false, |b, _| Ok(b.constant(0.0)))?;
                bodies.push(Body { name: name.clone(), face: face.clone(), h: zero, pieces: vec![i] });
            }
        }
    }
    Some(Walk { names, system, ledger, globals, initial_globals, bodies, images, heights })
}

type AddCondition<'c, 'a> = dyn FnMut(
        &mut System,
        &mut Ledger,
        &mut Names<'a>,
        String,
        String,
        String,
        &dyn Fn(&mut crate::expr::Builder, &mut super::binder::Binder) -> Result<crate::expr::Node, Vec<ExprError>>,
    ) + 'c;

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

/// Where the initial sphere stands, and whether the bodies just touch it there.
#[allow(clippy::too_many_arguments)]
fn axial_place(
    problem: &Problem,
    names: &Names,
    initial: &Initial,
    segments: &[Segment],
    faces: &[Option<Face>],
    mirror: Option<&Number>,
    initial_globals: &mut [f64],
    errors: &mut Vec<Diagnostic>,
) {
    let r = initial.radius;
    let apex = |s: &Segment, errors: &mut Vec<Diagnostic>| -> Option<(f64, String)> {
        let (name, body) = problem.bodies.get_index(s.body?)?;
        let pointer = format!("/bodies/{}/h", token(name));
        Some((names.at_start(&body.h, &pointer, errors)?, pointer))
    };
    let mut apexes: Vec<(f64, String, Facing, usize)> = vec![];
    for (s, face) in segments.iter().zip(faces) {
        if let (Some(face), Some((h, pointer))) = (face, apex(s, errors)) {
            apexes.push((h, pointer, face.facing, s.at));
        }
    }
    let middle = match mirror {
        Some(h) => names.constant(h, "/meridian", errors).unwrap_or(0.0),
        None => match apexes.iter().find(|a| a.2 == Facing::Up) {
            Some(up) => up.0 - r,
            None => apexes.first().map_or(0.0, |down| down.0 + r),
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
    for p in &names.pieces {
        if let Some(g) = p.h0 {
            initial_globals[g] = middle - r;
        }
    }
}
