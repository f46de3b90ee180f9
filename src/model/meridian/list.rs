//! The list of elements, read: segments, and what joins each two of them.

use super::rigid::{chain, edge_names, face_names};
use crate::diagnostic::Diagnostic;
use crate::expr::nearest;
use crate::model::Presence;
use crate::spec::{self, Element, KinkLaw, Number, Problem, Shape};

/// A segment of the list.
pub(super) struct Segment {
    pub(super) at: usize,
    pub(super) name: String,
    /// Which of the faces that meet smoothly it lies on, and how many there are.
    pub(super) part: (usize, usize),
    /// The body it lies on, and the face of that body.
    pub(super) body: Option<(usize, usize)>,
    pub(super) outside: Option<Number>,
}

/// A joint of the list.
pub(super) struct Joint<'a> {
    pub(super) at: usize,
    pub(super) kind: JointKind<'a>,
}

/// What joins two segments.
pub(super) enum JointKind<'a> {
    /// A smooth contact edge.
    Smooth,
    /// A sharp rigid edge: its name, its body, the edge of that body, its law.
    Kink(&'a str, usize, usize, &'a KinkLaw),
    /// The edge of an adhering contact, with its energy.
    Adhesive(&'a Number),
    /// Exactly what is written.
    Written(&'a str, &'a [spec::Formula], &'a indexmap::IndexMap<String, spec::Equation>),
}

/// The list, read.
pub(super) struct List<'a> {
    pub(super) first: &'a Element,
    pub(super) segments: Vec<Segment>,
    /// One between each two segments.
    pub(super) joints: Vec<Joint<'a>>,
    pub(super) last: &'a Element,
    pub(super) last_at: usize,
    /// Names of segments and joints that are absent in this stage.
    pub(super) absent: Vec<String>,
    /// Elements that are not there from the start, by their places in the list.
    pub(super) appearing: Vec<usize>,
}

/// The body and the face that a name such as `cone` or `pipette.wall` means.
fn face_of(problem: &Problem, name: &str) -> Option<(usize, usize)> {
    if let Some(body) = problem.bodies.get_index_of(name) {
        return face_names(&problem.bodies[body].shape).is_empty().then_some((body, 0));
    }
    part_of(problem, name, face_names)
}

/// The body and its part that a name such as `punch.edge` means.
fn part_of(problem: &Problem, name: &str, parts: impl Fn(&Shape) -> Vec<&str>) -> Option<(usize, usize)> {
    let (body, part) = name.split_once('.')?;
    let index = problem.bodies.get_index_of(body)?;
    Some((index, parts(&problem.bodies[index].shape).iter().position(|p| *p == part)?))
}

/// All names of faces, or of edges.
fn parts(problem: &Problem, edges: bool) -> Vec<String> {
    let mut names = vec![];
    for (name, body) in &problem.bodies {
        let own = if edges { edge_names(&body.shape) } else { face_names(&body.shape) };
        names.extend(own.iter().map(|p| format!("{name}.{p}")));
        if !edges && own.is_empty() {
            names.push(name.clone());
        }
    }
    names
}

fn unknown_part(problem: &Problem, name: &str, edges: bool, pointer: String) -> Diagnostic {
    let known = parts(problem, edges);
    let (what, all) = if edges { ("sharp edge", "edges") } else { ("body or face", "bodies and faces") };
    let mut d =
        Diagnostic::error("unknown-name", format!("there is no {what} `{name}`")).at(pointer, "nothing has this name");
    let body = name.split_once('.').and_then(|(body, _)| Some((body, problem.bodies.get(body)?)));
    if let Some((body, _)) = body.filter(|(_, said)| !edges && chain(&said.shape) > 1) {
        d = d.help(format!("a contact on `{body}` goes on along its side by itself: Contact(on: \"{body}\")"));
    } else if let Some(near) = nearest(name, known.iter().map(String::as_str)) {
        d = d.help(format!("did you mean `{near}`?"));
    }
    d.help(format!("{all}: {}", if known.is_empty() { "none".to_owned() } else { known.join(", ") }))
}

/// The complaint about an element that names no face or edge of any body.
pub fn unknown_name(problem: &Problem, element: &Element, at: usize) -> Option<Diagnostic> {
    match element {
        Element::Contact { on, .. } if face_of(problem, on.as_str()).is_none() => {
            Some(unknown_part(problem, on.as_str(), false, format!("/meridian/{at}/Contact/on")))
        }
        Element::Kink { at: edge, .. } if part_of(problem, edge.as_str(), edge_names).is_none() => {
            Some(unknown_part(problem, edge.as_str(), true, format!("/meridian/{at}/Kink/at")))
        }
        _ => None,
    }
}

/// Reads the list of elements that are present.
pub(super) fn read_list<'a>(
    problem: &'a Problem,
    presence: &Presence,
    errors: &mut Vec<Diagnostic>,
) -> Option<List<'a>> {
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
    let inner = usize::from(is_end(&elements[0]))..last + usize::from(!is_end(&elements[last]));
    for i in [0, last] {
        if !is_end(&elements[i]) {
            errors.push(
                Diagnostic::error("no-end", "a meridian starts and ends with an end")
                    .at(pointer(i), "not an end")
                    .help("ends: Pole, Mirror(h: ..), Clamped(u: .., h: ..)"),
            );
        }
    }
    let mut segments: Vec<Segment> = vec![];
    let mut between: Vec<Vec<Joint>> = vec![];
    let mut absent = vec![];
    for (i, element) in elements.iter().enumerate().take(inner.end).skip(inner.start) {
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
                    part: (0, 1),
                    body: None,
                    outside: outside_pressure.clone(),
                });
                between.push(vec![]);
            }
            Element::Contact { on, name, law, .. } => {
                if *law != spec::ContactLaw::Frictionless {
                    unsupported("contact without slip");
                }
                let face = face_of(problem, on.as_str());
                if face.is_none() {
                    errors.push(unknown_part(problem, on.as_str(), false, format!("{}/Contact/on", pointer(i))));
                }
                let name = name.as_ref().unwrap_or(on).as_str().to_owned();
                let (body, face) = face.unwrap_or((usize::MAX, 0));
                let said = problem.bodies.get_index(body).map(|b| b.1);
                let chain = said.map_or(1, |b| chain(&b.shape));
                let mut parts: Vec<usize> = (0..chain).filter(|&part| presence.reaches(i, part)).collect();
                if said.is_some_and(|b| b.facing == spec::Facing::Up) {
                    parts.reverse(); // walked inwards
                }
                for part in parts {
                    let name = if part == 0 { name.clone() } else { format!("{name}.side") };
                    let body = Some((body, face + part));
                    segments.push(Segment { at: i, name, part: (part, chain), body, outside: None });
                    between.push(vec![]);
                }
                absent.extend((0..chain).filter(|&part| !presence.reaches(i, part)).map(|_| format!("{name}.side")));
            }
            Element::Smooth => joint(JointKind::Smooth),
            Element::Kink { at, law, .. } => match part_of(problem, at.as_str(), edge_names) {
                Some((body, edge)) => joint(JointKind::Kink(at.as_str(), body, edge, law)),
                None => errors.push(unknown_part(problem, at.as_str(), true, format!("{}/Kink/at", pointer(i)))),
            },
            Element::AdhesiveEdge { energy } => joint(JointKind::Adhesive(energy)),
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
            (Some(joint), true)
                if matches!(joint.kind, JointKind::Adhesive(_)) && a.body.is_none() == b.body.is_none() =>
            {
                errors.push(
                    Diagnostic::error("adhesive-edge", "an adhesive edge joins a free segment and a contact")
                        .at(pointer(joint.at), "between two segments of one kind"),
                );
            }
            (Some(joint), true) => joints.push(joint),
            (Some(joint), false) => errors.push(
                Diagnostic::error("two-joints", "two joints stand between two segments")
                    .at(pointer(joint.at), "the second one"),
            ),
            // Between a contact and a free segment, and between faces of one body.
            (None, _)
                if a.body.map(|b| b.0) != b.body.map(|b| b.0) && (a.body.is_none() || b.body.is_none())
                    || a.body.is_some() && a.body.map(|b| b.0) == b.body.map(|b| b.0) =>
            {
                joints.push(Joint { at: b.at, kind: JointKind::Smooth })
            }
            (None, _) => {
                let (what, between) = if a.body.is_none() {
                    ("two free segments", "a contact")
                } else {
                    ("two contacts", "a free segment")
                };
                errors.push(
                    Diagnostic::error(
                        "no-joint",
                        format!("{what} follow each other, and nothing says what joins them"),
                    )
                    .at(pointer(b.at), format!("{between}, a kink or a joint is left out before this element"))
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
    let appears =
        |e: &Element| matches!(e, Element::Contact { appears: Some(_), .. } | Element::Kink { appears: Some(_), .. });
    let appearing = (0..elements.len()).filter(|&i| appears(&elements[i])).collect();
    let list = List { first: &elements[0], segments, joints, last: &elements[last], last_at: last, absent, appearing };
    (errors.len() == before).then_some(list)
}
