//! Stages: which elements of the meridian are present, and what makes them appear and disappear.
//!
//! A contact with `appears` is absent until its event. A stage is a system of its own, with its own unknowns and conditions; a
//! [`Change`] is the event that leads from one to the next.

use super::names::Names;
use crate::diagnostic::Diagnostic;
use crate::spec::{self, Element, Problem};
use crate::system::{Formula, System};

/// Which of the elements of the meridian that may be absent are present: one bit for each, by its place in the list.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Presence(Vec<usize>);

impl Presence {
    /// True if an element, at its place in the list, is present.
    pub fn has(&self, element: &Element, at: usize) -> bool {
        match element {
            Element::Contact { appears: Some(_), .. } | Element::Kink { appears: Some(_), .. } => self.0.contains(&at),
            _ => true,
        }
    }

    /// The same with one element more, or less.
    pub fn toggled(&self, at: usize) -> Self {
        let mut list = self.0.clone();
        match list.iter().position(|&i| i == at) {
            Some(i) => {
                list.remove(i);
            }
            None => list.push(at),
        }
        list.sort_unstable();
        Presence(list)
    }
}

/// A change of the list of elements: what happens when a formula crosses zero.
#[derive(Clone, Debug)]
pub struct Change {
    /// `touch` or `lift_off`.
    pub kind: &'static str,
    /// The element.
    pub of: String,
    /// Its place in the list.
    pub at: usize,
    /// Negative before, positive after; or nothing where it is the least contact pressure of a piece.
    pub when: When,
    /// The same in words: the equation that holds then, or what vanishes.
    pub text: String,
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
}

/// What changes the list of elements, from this stage.
pub(super) fn changes(
    problem: &Problem,
    presence: &Presence,
    names: &mut Names,
    system: &System,
    errors: &mut Vec<Diagnostic>,
) -> Vec<Change> {
    let mut list = vec![];
    for (i, element) in problem.meridian.iter().flatten().enumerate() {
        let Element::Contact { on, name, appears: Some(appears), .. } = element else {
            if let Element::Kink { appears: Some(_), .. } = element {
                errors.push(
                    Diagnostic::error(
                        "not-supported",
                        "a kink that appears by an event cannot be solved by this version",
                    )
                    .at(format!("/meridian/{i}"), "not supported yet"),
                );
            }
            continue;
        };
        let of = name.as_ref().unwrap_or(on).as_str().to_owned();
        if presence.has(element, i) {
            let Some(piece) = names.pieces.iter().position(|p| p.name == of) else { continue };
            let whens = [
                (When::Length(piece), "the length of the contact vanishes"),
                (When::Pressure(piece), "the least contact pressure vanishes"),
            ];
            for (when, text) in whens {
                list.push(Change { kind: "lift_off", of: of.clone(), at: i, when, text: text.to_owned() });
            }
            continue;
        }
        let pointer = format!("/meridian/{i}/Contact/appears");
        let text = match appears {
            spec::Appears::When(equation) => equation.as_str().to_owned(),
            // A wall is touched where the free segment before or after it stands upright at its radius.
            spec::Appears::OnTouch => {
                let neighbour = |j: usize| match problem.meridian.as_ref()?.get(j)? {
                    Element::Free { name, .. } => Some(name.as_str().to_owned()),
                    _ => None,
                };
                match (i.checked_sub(1).and_then(neighbour), neighbour(i + 1)) {
                    (Some(before), None) => format!("{before}.end.tau = pi/2"),
                    (None, Some(after)) => format!("{after}.start.tau = pi/2"),
                    _ => {
                        errors.push(
                            Diagnostic::error("not-supported", "this contact needs to be told when it appears")
                                .at(pointer, "write When(\"..\")"),
                        );
                        continue;
                    }
                }
            }
        };
        if let Some(f) = names.equation(system, &text, &format!("{pointer}/When"), false, errors) {
            list.push(Change { kind: "touch", of, at: i, when: When::Formula(f), text });
        }
    }
    list
}
