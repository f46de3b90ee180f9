//! Stages: which elements of the meridian are present, and what makes them appear and disappear.
//!
//! A contact with `appears` is absent until its event. A stage is a system of its own, with its own unknowns and conditions; a
//! [`Change`] is the event that leads from one to the next.

use super::meridian::unknown_name;
use super::names::Names;
use super::{Body, bracket};
use crate::diagnostic::Diagnostic;
use crate::number::plain;
use crate::spec::{self, Element, Number, Problem};
use crate::system::{Field, Formula, Place, Side, System};
use std::f64::consts::PI;

/// A part of an element of the meridian: its place in the list, and, for a contact along several faces that meet smoothly, the face.
pub type Part = (usize, usize);

/// Which parts of the elements of the meridian that may be absent are present, and how edges with friction hold the membrane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Presence {
    parts: Vec<Part>,
    grips: Vec<(usize, Grip)>,
}

/// How a sharp edge with friction holds the membrane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Grip {
    /// It sticks where it touched first.
    #[default]
    First,
    /// It sticks at a material angle.
    At(f64),
    /// The membrane slides over it against the walk, so that ever later material lies on it.
    Forward,
    /// The membrane slides over it along the walk.
    Backward,
}

impl Presence {
    /// True if an element, at its place in the list, is present.
    pub fn has(&self, element: &Element, at: usize) -> bool {
        match element {
            Element::Contact { appears: Some(_), .. } | Element::Kink { appears: Some(_), .. } => {
                self.parts.contains(&(at, 0))
            }
            _ => true,
        }
    }

    /// True if the contact at a place in the list reaches a further face of its body.
    pub fn reaches(&self, at: usize, face: usize) -> bool {
        face == 0 || self.parts.contains(&(at, face))
    }

    /// The same with one part more, or less.
    pub fn toggled(&self, at: Part) -> Self {
        let mut parts = self.parts.clone();
        match parts.iter().position(|&i| i == at) {
            Some(i) => {
                parts.remove(i);
            }
            None => parts.push(at),
        }
        parts.sort_unstable();
        // An edge that comes or goes starts anew.
        let grips = self.grips.iter().copied().filter(|g| g.0 != at.0).collect();
        Presence { parts, grips }
    }

    /// How the edge at a place in the list holds the membrane, where it has friction.
    pub fn grip(&self, at: usize) -> Grip {
        self.grips.iter().find(|g| g.0 == at).map_or(Grip::First, |g| g.1)
    }

    /// The same with another grip of an edge.
    fn gripped(&self, at: usize, grip: Grip) -> Self {
        let others = self.grips.iter().copied().filter(|g| g.0 != at);
        Presence { parts: self.parts.clone(), grips: others.chain([(at, grip)]).collect() }
    }

    /// The elements after a change, in a state in which the joint that it concerns lies at a material angle.
    pub fn after(&self, change: &Change, phi: f64) -> Self {
        match change.to {
            To::Toggled => self.toggled(change.at),
            To::Slides(grip) => self.gripped(change.at.0, grip),
            To::Sticks => self.gripped(change.at.0, Grip::At(phi)),
        }
    }
}

/// A change of the list of elements: what happens when a formula crosses zero.
#[derive(Clone, Debug)]
pub struct Change {
    /// `touch`, `lift_off`, `slip` or `stick`.
    pub kind: &'static str,
    /// The element.
    pub of: String,
    /// The part of the list that it is.
    pub at: Part,
    /// What becomes of it.
    pub to: To,
    /// Negative before, positive after; or nothing where it is the least contact pressure of a piece.
    pub when: When,
    /// The same in words: the equation that holds then, or what vanishes.
    pub text: String,
}

/// What becomes of a part of the list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum To {
    /// It comes or goes.
    Toggled,
    /// An edge with friction lets the membrane slide.
    Slides(Grip),
    /// It holds the membrane where it is.
    Sticks,
}

/// What is watched.
#[derive(Clone, Debug)]
pub enum When {
    /// A formula that crosses zero.
    Formula(Formula),
    /// The length of a piece in eta, which vanishes when its contact is undone.
    Length(usize),
    /// The least contact pressure on a piece.
    Pressure(usize),
    /// A formula that is positive as soon as an edge cannot hold the membrane any more.
    Exceeded(Formula),
    /// The motion of a place, a global, along the branch: 1 where it must grow, -1 where it must fall.
    Motion(usize, f64),
}

/// What changes the list of elements, from this stage.
pub(super) fn changes(
    problem: &Problem,
    presence: &Presence,
    names: &mut Names,
    system: &System,
    bodies: &[Body],
    errors: &mut Vec<Diagnostic>,
) -> Vec<Change> {
    let mut list = vec![];
    let elements: Vec<(usize, &Element)> = problem.meridian.iter().flatten().enumerate().collect();
    for &(i, element) in &elements {
        if let Element::Contact { on, name, .. } = element
            && presence.has(element, i)
        {
            list.extend(seams(names, system, bodies, name.as_ref().unwrap_or(on).as_str(), i));
        }
        if let Element::Kink { at, law: spec::KinkLaw::Capstan { friction }, .. } = element
            && presence.has(element, i)
        {
            list.extend(friction_events(names, system, presence.grip(i), at.as_str(), friction, i, errors));
        }
        let (of, appears, kink) = match element {
            Element::Contact { on, name, appears: Some(appears), .. } => (name.as_ref().unwrap_or(on), appears, false),
            Element::Kink { at, appears: Some(appears), .. } => (at, appears, true),
            _ => continue,
        };
        let of = of.as_str().to_owned();
        if presence.has(element, i) {
            let whens = if kink {
                let Some(joint) = names.joints.iter().find(|j| j.name == of) else { continue };
                let (before, after) = (joint.before, joint.after);
                let straight = names.build(system, false, |b, x| {
                    let (l, r) = (x.end(b, before, Side::End, Field::Tau), x.end(b, after, Side::Start, Field::Tau));
                    Ok(b.sub(r, l))
                });
                let text = format!("{of}.after.tau = {of}.before.tau");
                straight.map(|f| (When::Formula(f), text)).into_iter().collect()
            } else {
                let Some(piece) = names.pieces.iter().position(|p| p.name == of) else { continue };
                vec![
                    (When::Length(piece), "the length of the contact vanishes".to_owned()),
                    (When::Pressure(piece), "the least contact pressure vanishes".to_owned()),
                ]
            };
            for (when, text) in whens {
                list.push(Change { kind: "lift_off", of: of.clone(), at: (i, 0), to: To::Toggled, when, text });
            }
            continue;
        }
        let pointer = format!("/meridian/{i}/{}/appears", if kink { "Kink" } else { "Contact" });
        let touch = match appears {
            spec::Appears::When(equation) => {
                let text = equation.as_str().to_owned();
                names
                    .equation(system, &text, &format!("{pointer}/When"), false, errors)
                    .map(|f| (When::Formula(f), text))
            }
            spec::Appears::OnTouch => {
                // A face behind an edge that is not there yet cannot be met before it.
                let waits =
                    |j: usize| matches!(elements.get(j), Some((j, e @ Element::Kink { .. })) if !presence.has(e, *j));
                if !kink && (waits(i + 1) || i.checked_sub(1).is_some_and(waits)) {
                    continue;
                }
                // The elements between which it will stand.
                let near = |j: &&(usize, &Element)| presence.has(j.1, j.0);
                let sides = [elements[..i].iter().rev().find(near), elements[i + 1..].iter().find(near)];
                let sides = sides.map(|s| s.map(|s| s.1));
                let found = if kink {
                    edge_reached(names, system, bodies, &of, sides)
                } else {
                    face_met(names, system, bodies, element, sides)
                };
                if found.is_none() {
                    errors.push(unknown_name(problem, element, i).unwrap_or_else(|| {
                        Diagnostic::error("not-supported", "this element needs to be told when it appears")
                            .at(pointer, "write When(\"..\")")
                            .help("found by itself: a body that the pole of a free segment meets, a face next to a sharp edge over which the membrane is bent, and an edge at the end of a face on which it lies")
                            .help("such an edge stands in the list: Kink(at: \"body.edge\", .., appears: OnTouch)")
                    }));
                }
                found
            }
        };
        if let Some((when, text)) = touch {
            list.push(Change { kind: "touch", of, at: (i, 0), to: To::Toggled, when, text });
        }
    }
    list
}

/// When an edge with friction lets the membrane slide, or holds it again.
fn friction_events(
    names: &mut Names,
    system: &System,
    grip: Grip,
    of: &str,
    friction: &Number,
    at: usize,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Change> {
    let Some(joint) = names.joints.iter().find(|j| j.name == of).cloned() else { return vec![] };
    let change = |kind, to, when, text: String| Change { kind, of: of.to_owned(), at: (at, 0), to, when, text };
    if let Grip::Forward | Grip::Backward = grip {
        let Place::Unknown(place) = system.pieces[joint.before].to else { return vec![] };
        let sense = if grip == Grip::Forward { 1.0 } else { -1.0 };
        let text = format!("{of}.phi is stationary");
        return vec![change("stick", To::Sticks, When::Motion(place, sense), text)];
    }
    let mut list = vec![];
    for grip in [Grip::Forward, Grip::Backward] {
        let text = pull(of, friction, grip);
        let pointer = format!("/meridian/{at}/Kink/law/Capstan/friction");
        if let Some(f) = names.equation(system, &text, &pointer, false, errors) {
            list.push(change("slip", To::Slides(grip), When::Exceeded(f), text));
        }
    }
    list
}

/// The pull at which the membrane slides over an edge (Euler, Eytelwein): ln(w_l ahead/w_l behind) = friction times the angle by which
/// it is bent.
pub(super) fn pull(of: &str, friction: &Number, grip: Grip) -> String {
    let (ahead, behind) = if grip == Grip::Forward { ("before", "after") } else { ("after", "before") };
    format!("ln({of}.{ahead}.w_l/{of}.{behind}.w_l) = {}*({of}.before.tau - {of}.after.tau)", bracket(friction))
}

/// What happens to a contact along faces that meet smoothly: it reaches the next one, or leaves the last one.
fn seams(names: &mut Names, system: &System, bodies: &[Body], of: &str, at: usize) -> Vec<Change> {
    let group: Vec<usize> = (0..names.pieces.len()).filter(|&p| names.pieces[p].element == at).collect();
    let Some(body) = bodies.iter().find(|b| group.iter().any(|p| b.pieces.contains(p))) else { return vec![] };
    let Some(outer) = group.iter().copied().max_by_key(|&p| names.pieces[p].part) else { return vec![] };
    let (part, chained) = (names.pieces[outer].part, names.pieces[outer].chain);
    let face = &body.rigid.faces[part];
    let mut list = vec![];
    if part + 1 < chained {
        let side = if face.face.sense > 0.0 { Side::End } else { Side::Start };
        let next = &body.rigid.faces[part + 1].name;
        let end = face.range[1];
        let f = names.build(system, false, |b, x| {
            let (here, there) = (x.end(b, outer, side, Field::Along), b.constant(end));
            Ok(b.sub(here, there))
        });
        let text = format!("{of} reaches the end of its face");
        list.extend(f.map(|f| Change {
            kind: "touch",
            of: next.clone(),
            at: (at, part + 1),
            to: To::Toggled,
            when: When::Formula(f),
            text,
        }));
    }
    if part > 0 {
        let text = "the length of the contact vanishes".to_owned();
        list.push(Change {
            kind: "lift_off",
            of: face.name.clone(),
            at: (at, part),
            to: To::Toggled,
            when: When::Length(outer),
            text,
        });
    }
    list
}

/// A contact reaches the edge at the end of its face.
fn edge_reached(
    names: &mut Names,
    system: &System,
    bodies: &[Body],
    of: &str,
    sides: [Option<&Element>; 2],
) -> Option<(When, String)> {
    for (side, element) in [(Side::End, sides[0]), (Side::Start, sides[1])] {
        let Some(Element::Contact { on, name, .. }) = element else { continue };
        let name = name.as_ref().unwrap_or(on).as_str();
        let piece = names.pieces.iter().position(|p| p.name == name)?;
        let rigid = bodies.iter().find(|b| b.pieces.contains(&piece)).map(|b| &b.rigid)?;
        let edge = rigid.edges.iter().find(|e| e.name == of)?;
        let face = rigid.faces.iter().position(|f| f.name == on.as_str())?;
        let (_, t) = *edge.on.iter().find(|o| o.0 == face)?;
        let end = if side == Side::End { "end" } else { "start" };
        let text = format!("{name}.{end}.u = {}", edge.at[0]);
        let f = names.build(system, false, |b, x| {
            let (here, there) = (x.end(b, piece, side, Field::Along), b.constant(t));
            Ok(b.sub(here, there))
        })?;
        return Some((When::Formula(f), text));
    }
    None
}

/// A free segment that leaves an edge lies along the face behind it.
fn face_met(
    names: &mut Names,
    system: &System,
    bodies: &[Body],
    element: &Element,
    sides: [Option<&Element>; 2],
) -> Option<(When, String)> {
    let Element::Contact { on, .. } = element else { return None };
    // At a pole the membrane first touches the foremost point of the body.
    let pole = match sides {
        [Some(Element::Pole), Some(Element::Free { name, .. })] => Some((name, Side::Start, "start")),
        [Some(Element::Free { name, .. }), Some(Element::Pole)] => Some((name, Side::End, "end")),
        _ => None,
    };
    if let Some((free, side, end)) = pole {
        let piece = names.pieces.iter().position(|p| p.name == free.as_str())?;
        let at = bodies.iter().position(|b| b.rigid.faces[0].name == on.as_str())?;
        // Positive as soon as the pole would stand inside the body.
        let f = names.build(system, false, |b, x| {
            let (here, there) = (x.h(b, piece, side)?, x.body_h(b, at)?);
            Ok(if side == Side::Start { b.sub(there, here) } else { b.sub(here, there) })
        })?;
        return Some((When::Exceeded(f), format!("{}.{end}.h = {}.h", free.as_str(), bodies[at].name)));
    }
    let (free, at, side, end) = match sides {
        [Some(Element::Free { name, .. }), Some(Element::Kink { at, .. })] => (name, at, Side::End, "end"),
        [Some(Element::Kink { at, .. }), Some(Element::Free { name, .. })] => (name, at, Side::Start, "start"),
        _ => return None,
    };
    let piece = names.pieces.iter().position(|p| p.name == free.as_str())?;
    let body = bodies.iter().find(|b| b.rigid.faces.iter().any(|f| f.name == on.as_str()))?;
    let edge = body.rigid.edges.iter().find(|e| e.name == at.as_str())?;
    let (face, t) = *edge.on.iter().find(|o| body.rigid.faces[o.0].name == on.as_str())?;
    let face = &body.rigid.faces[face].face;
    let tau = face.tangent(face.frame(t).angle);
    let f = names.build(system, false, |b, x| {
        let (here, there) = (x.end(b, piece, side, Field::Tau), b.constant(tau));
        Ok(b.sub(here, there))
    })?;
    let said = if tau == PI / 2.0 { "pi/2".to_owned() } else { plain(tau) };
    Some((When::Formula(f), format!("{}.{end}.tau = {said}", free.as_str())))
}
