//! Where the initial sphere stands among the bodies, and whether they just touch it there.

use super::list::{JointKind, List};
use super::rigid::Rigid;
use crate::diagnostic::Diagnostic;
use crate::model::names::Names;
use crate::model::{Initial, facing, token};
use crate::physics::reference::Reference;
use crate::physics::surface::{Face, Facing, Generator};
use crate::spec::Problem;
use std::f64::consts::PI;

/// Places of a generator that are looked at for one at which it touches a sphere.
const SEARCHED: usize = 400;

/// Where something touches the initial sphere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// The material angle.
    pub(super) phi: f64,
    /// Its position below the foremost point of its body on the axis.
    pub(super) drop: f64,
}

/// Where the part of a face between two parameters touches a sphere of radius `r`: at the pole, or along a circle on which the tangents
/// agree.
fn touch(face: &Face, range: [f64; 2], r: f64, at_pole: bool) -> Option<Touch> {
    let at = |t: f64, phi: f64| Touch { phi, drop: face.drop(t) };
    if at_pole {
        let pole = if face.facing == Facing::Down { 0.0 } else { PI };
        return (face.surface.axial() && range[0] == 0.0).then(|| at(0.0, pole));
    }
    let tau = |t: f64| face.tangent(face.frame(t).angle);
    let miss = |t: f64| face.surface.point(t)[0] - r * tau(t).sin();
    let last = range[1].min(range[0] + 10.0 * r);
    let place = |i: usize| range[0] + (last - range[0]) * i as f64 / SEARCHED as f64;
    for i in 1..=SEARCHED {
        let (mut a, mut b) = (place(i - 1), place(i));
        // On the axis itself the sphere is touched at its pole.
        let sign = |t: f64| miss(t) > 0.0;
        if (i == 1 && miss(a).abs() < 1e-12 * r) || !miss(b).is_finite() || sign(a) == sign(b) {
            continue;
        }
        for _ in 0..80 {
            let m = 0.5 * (a + b);
            if sign(m) == sign(a) { a = m } else { b = m }
        }
        let t = 0.5 * (a + b);
        if tau(t) > 0.0 && tau(t) < PI && miss(t).abs() < 1e-9 * r {
            return Some(at(t, tau(t)));
        }
    }
    None
}

/// True if a sphere of radius `r` that touches a face at its pole runs into the face beside it, or fits it exactly. As far as both go
/// outwards.
fn cuts(face: &Face, range: [f64; 2], r: f64) -> bool {
    let sign = if face.facing == Facing::Down { 1.0 } else { -1.0 };
    let last = range[1].min(range[0] + 2.0 * r);
    let mut reached = 0.0;
    for i in 1..=SEARCHED {
        let t = range[0] + (last - range[0]) * i as f64 / SEARCHED as f64;
        let sine = face.surface.point(t)[0] / r;
        if !(sine > reached && sine < 1.0) {
            return false;
        }
        reached = sine;
        // How far the sphere has receded from the plane in which it touches.
        let receded = r * sine * sine / (1.0 + (1.0 - sine * sine).sqrt());
        if receded - sign * face.drop(t) < 1e-6 * receded {
            return true;
        }
    }
    false
}

/// The touches of the initial sphere: of each contact (none for a free segment), and of each joint that is a kink.
pub(super) struct Touches {
    pub(super) contacts: Vec<Option<Touch>>,
    pub(super) edges: Vec<Option<Touch>>,
}

impl Touches {
    /// The material angle at which a joint starts: that of its edge, or of the contact on one of its sides; what touches nothing
    /// starts at the equator.
    pub(super) fn joint(&self, i: usize) -> f64 {
        let touch = self.edges[i].or(self.contacts[i]).or(self.contacts[i + 1]);
        touch.map_or(PI / 2.0, |t| t.phi)
    }
}

/// Finds where contacts and kinks that are there from the start touch the initial sphere. Those that appear later are not asked for.
pub(super) fn touches(
    problem: &Problem,
    list: &List,
    rigid: &[Option<Rigid>],
    mirrored: bool,
    initial: &Initial,
    errors: &mut Vec<Diagnostic>,
) -> Option<Touches> {
    let radius = initial.radius;
    let sphere = matches!(initial.reference, Reference::Sphere { .. });
    let before = errors.len();
    let later = |at: usize| list.appearing.contains(&at);
    let count = list.segments.len();
    let mut contacts = vec![];
    for (i, s) in list.segments.iter().enumerate() {
        let Some((body, face)) = s.body.filter(|_| !later(s.at) && s.part.0 == 0) else {
            contacts.push(None);
            continue;
        };
        let f = &rigid[body].as_ref()?.faces[face];
        let at_pole = i == 0 || (i + 1 == count && !mirrored);
        let found = (sphere || at_pole).then(|| touch(&f.face, f.range, radius, at_pole)).flatten();
        if found.is_none() {
            let why = if at_pole {
                "it has no point on the axis"
            } else {
                "nowhere are its tangent and that of the sphere the same"
            };
            errors.push(
                Diagnostic::error("no-first-touch", format!("`{}` cannot touch the initial sphere: {why}", f.name))
                    .at(format!("/meridian/{}", s.at), "a contact without `appears` just touches the initial sphere")
                    .help("say when it appears: Contact(on: .., appears: OnTouch)"),
            );
        }
        if found.is_some() && sphere && at_pole && cuts(&f.face, f.range, radius) {
            errors.push(
                Diagnostic::error(
                    "no-first-touch",
                    format!(
                        "`{}` cannot touch the initial sphere at its pole only: it leaves no room beside it",
                        f.name
                    ),
                )
                .at(format!("/meridian/{}", s.at), "a contact without `appears` just touches the initial sphere")
                .help(format!(
                    "that sphere has the radius {radius}; a hollow must be wider, and a tip foremost on the axis"
                )),
            );
        }
        contacts.push(found);
    }
    let mut edges = vec![];
    for joint in &list.joints {
        let JointKind::Kink(name, body, edge, _) = joint.kind else {
            edges.push(None);
            continue;
        };
        let edge = &rigid[body].as_ref()?.edges[edge];
        if !sphere && !later(joint.at) {
            errors.push(
                Diagnostic::error("no-first-touch", format!("a flat disc does not touch the edge `{name}` at first"))
                    .at(format!("/meridian/{}", joint.at), "a kink without `appears` just touches the initial shape")
                    .help("say when it appears: Kink(at: .., appears: OnTouch)"),
            );
        }
        let (said, face) = (&problem.bodies[body], facing(problem.bodies[body].facing));
        let sine = edge.at[0] / radius;
        if !(sine < 1.0) && !later(joint.at) {
            let at = format!("/bodies/{}/shape", token(problem.bodies.get_index(body)?.0));
            let at = if matches!(said.shape, crate::spec::Shape::Pipette { .. }) { at + "/Pipette/radius" } else { at };
            errors.push(
                Diagnostic::error(
                    "pipette-radius",
                    format!(
                        "the radius of the edge `{name}`, {}, must be smaller than that of the initial sphere, {radius}",
                        edge.at[0]
                    ),
                )
                .at(at, format!("is {}", edge.at[0])),
            );
        }
        let drop = if face == Facing::Down { -edge.at[1] } else { edge.at[1] };
        let phi = if face == Facing::Down { sine.asin() } else { PI - sine.asin() };
        edges.push(Some(Touch { phi: if phi.is_finite() { phi } else { PI / 2.0 }, drop }));
    }
    (errors.len() == before).then_some(Touches { contacts, edges })
}

/// Where the middle of the initial sphere stands, and whether the bodies just touch it there.
#[allow(clippy::too_many_arguments)]
pub(super) fn axial_place(
    problem: &Problem,
    names: &Names,
    initial: &Initial,
    list: &List,
    touches: &Touches,
    held: Option<f64>,
    initial_globals: &mut [f64],
    errors: &mut Vec<Diagnostic>,
) -> f64 {
    let r = initial.radius;
    // Where the middle of the sphere stands when each just touches: faces first.
    struct Says {
        middle: f64,
        h: f64,
        pointer: String,
        facing: Facing,
        at: usize,
    }
    let above = |phi: f64| r * initial.profile(phi)[1];
    let says = |body: usize, touch: &Touch, at: usize, errors: &mut Vec<Diagnostic>| -> Option<Says> {
        let (name, body) = problem.bodies.get_index(body)?;
        let pointer = format!("/bodies/{}/h", token(name));
        let h = names.at_start(&body.h, &pointer, errors)?;
        Some(Says { middle: h + touch.drop + above(touch.phi), h, pointer, facing: facing(body.facing), at })
    };
    let mut contacts = vec![];
    for (s, touch) in list.segments.iter().zip(&touches.contacts) {
        if let (Some((body, _)), Some(touch)) = (s.body, touch) {
            contacts.extend(says(body, touch, s.at, errors));
        }
    }
    let mut rings = vec![];
    for (joint, touch) in list.joints.iter().zip(&touches.edges) {
        if let (JointKind::Kink(_, body, ..), Some(touch), false) =
            (&joint.kind, touch, list.appearing.contains(&joint.at))
        {
            rings.extend(says(*body, touch, joint.at, errors));
        }
    }
    let middle = match held {
        Some(h) => h,
        None => match contacts.iter().find(|c| c.facing == Facing::Up) {
            Some(up) => up.middle,
            None => contacts.first().or(rings.first()).map_or(0.0, |c| c.middle),
        },
    };
    for c in contacts.iter().chain(rings.iter().skip(usize::from(contacts.is_empty() && held.is_none()))) {
        // A body that looks down leaves a gap where the sphere stands below where it would touch.
        let below = middle - c.middle;
        let gap = if c.facing == Facing::Down { below } else { -below };
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
                .at(c.pointer.clone(), format!("h = {} in the initial state; {} would touch", c.h, c.h + below))
                .at(format!("/meridian/{}", c.at), "the contact"),
            );
        }
    }
    // Axial position of the start of each piece on that sphere.
    for (i, p) in names.pieces.iter().enumerate() {
        if let Some(g) = p.h0 {
            let phi = i.checked_sub(1).map_or(0.0, |joint| touches.joint(joint));
            initial_globals[g] = middle - above(phi);
        }
    }
    middle
}
