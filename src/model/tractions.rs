//! Tractions besides pressure: what each is, and on which pieces it acts.

use super::names::Names;
use super::{bracket, token};
use crate::diagnostic::Diagnostic;
use crate::expr::nearest;
use crate::spec::{Area, Name, Number, Problem, Traction};
use crate::system::{Component, Load, MOST_LOADS, Piece, Repulsion};
use std::f64::consts::PI;
use std::sync::Arc;

/// Puts the tractions of a file on its pieces.
pub(super) fn apply(problem: &Problem, names: &mut Names, pieces: &mut [Piece], errors: &mut Vec<Diagnostic>) {
    for (name, traction) in &problem.tractions {
        let pointer = format!("/tractions/{}", token(name));
        let (on, word) = match traction {
            Traction::Applied { on, .. } => (on, "Applied"),
            Traction::ChargedPlane { on, .. } => (on, "ChargedPlane"),
            Traction::SelfRepulsion { on, .. } => (on, "SelfRepulsion"),
        };
        let pointer = format!("{pointer}/{word}");
        let chosen = chosen(pieces, on.as_deref(), &pointer, errors);
        match traction {
            Traction::Applied { normal, tangential, radial, axial, per, .. } => {
                let given = [
                    (normal, Component::Normal, "normal"),
                    (tangential, Component::Tangential, "tangential"),
                    (radial, Component::Radial, "radial"),
                    (axial, Component::Axial, "axial"),
                ];
                let components: Vec<(String, Component, String)> = given
                    .into_iter()
                    .filter_map(|(number, component, key)| Some((bracket(number.as_ref()?), component, key.to_owned())))
                    .collect();
                let current = *per == Area::CurrentArea;
                add(name, &components, current, &chosen, &pointer, names, pieces, errors);
            }
            Traction::ChargedPlane { h, charge_ratio, coupling, debye_length, .. } => {
                let Some((_, k)) = charges(names, coupling, debye_length, &pointer, errors) else { continue };
                let down = match plane_below(names, h, &pointer, errors) {
                    Some(below) => {
                        if below {
                            1.0
                        } else {
                            -1.0
                        }
                    }
                    None => continue,
                };
                let text = format!(
                    "{down}*2*pi*{}*{}*exp(-{down}*({} - h)*({k:e}))",
                    bracket(coupling),
                    bracket(charge_ratio),
                    bracket(h)
                );
                let components = [(text, Component::Axial, "charge_ratio".to_owned())];
                add(name, &components, false, &chosen, &pointer, names, pieces, errors);
            }
            Traction::SelfRepulsion { coupling, debye_length, .. } => {
                if on.is_some() {
                    errors.push(
                        Diagnostic::error("not-supported", "the whole membrane carries the charge that repels itself")
                            .at(format!("{pointer}/on"), "leave this out"),
                    );
                }
                let Some((coupling, k)) = charges(names, coupling, debye_length, &pointer, errors) else { continue };
                for piece in pieces.iter_mut() {
                    if piece.repulsion.is_some() {
                        errors.push(
                            Diagnostic::error("declared-twice", "the membrane repels itself twice")
                                .at(pointer.clone(), "the second one"),
                        );
                        break;
                    }
                    piece.repulsion = Some(Repulsion { coupling, k, rest: None });
                }
            }
        }
    }
    // Where the face under a piece stands, and the end of the membrane that the forces come to.
    for (s, piece) in pieces.iter_mut().enumerate() {
        piece.level = names.extent().map_or(0.0, |extent| extent.1);
        if let (Some(body), true) = (names.pieces[s].body, act_on(problem, &piece.name)) {
            let (name, said) = problem.bodies.get_index(body).expect("a body of the file");
            piece.apex = names.globals(&said.h, &format!("/bodies/{}/h", token(name)), errors);
        }
    }
}

/// True if a traction of the file acts on a segment.
pub(super) fn act_on(problem: &Problem, segment: &str) -> bool {
    problem.tractions.values().any(|t| match t {
        Traction::Applied { on, .. } | Traction::ChargedPlane { on, .. } => {
            on.as_ref().is_none_or(|on| on.iter().any(|n| n.as_str() == segment))
        }
        Traction::SelfRepulsion { .. } => true,
    })
}

/// The screened repulsion of the file, if there is one: coupling and inverse screening length.
pub(super) fn repulsion(problem: &Problem, names: &Names) -> Option<(f64, f64)> {
    problem.tractions.values().find_map(|t| match t {
        // What is wrong with it is said where it is applied.
        Traction::SelfRepulsion { coupling, debye_length, .. } => {
            charges(names, coupling, debye_length, "", &mut vec![])
        }
        _ => None,
    })
}

/// The coupling and the inverse screening length, both constants and positive.
fn charges(
    names: &Names,
    coupling: &Number,
    debye_length: &Number,
    pointer: &str,
    errors: &mut Vec<Diagnostic>,
) -> Option<(f64, f64)> {
    let mut positive = |number: &Number, key: &str, zero: bool| {
        let at = format!("{pointer}/{key}");
        let v = names.constant(number, &at, errors)?;
        if v > 0.0 || (zero && v == 0.0) {
            return Some(v);
        }
        let help = match key {
            "coupling" => "C = sigma_0^2 R/(4 pi eps G) is a square: it cannot be negative",
            _ => "the screening length must be positive",
        };
        errors.push(Diagnostic::error("charge", format!("`{key}` is {v}")).at(at, "not possible").help(help));
        None
    };
    let (coupling, length) = (positive(coupling, "coupling", true), positive(debye_length, "debye_length", false));
    Some((coupling?, 1.0 / length?))
}

/// True if a charged plane stands below the initial membrane. It must not cut it.
fn plane_below(names: &Names, h: &Number, pointer: &str, errors: &mut Vec<Diagnostic>) -> Option<bool> {
    let at = format!("{pointer}/h");
    let h = names.at_start(h, &at, errors)?;
    let (top, bottom) = names.extent()?;
    let slack = 1e-9 * (bottom - top);
    if h >= bottom - slack {
        return Some(true);
    }
    if h <= top + slack {
        return Some(false);
    }
    errors.push(
        Diagnostic::error("charged-plane", format!("the charged plane at h = {h} cuts the initial membrane"))
            .at(at, format!("the membrane stands between h = {top} and {bottom}")),
    );
    None
}

/// Indices of the pieces that are named.
fn chosen(pieces: &[Piece], on: Option<&[Name]>, pointer: &str, errors: &mut Vec<Diagnostic>) -> Vec<usize> {
    let Some(on) = on else { return (0..pieces.len()).collect() };
    let known: Vec<&str> = pieces.iter().map(|p| p.name.as_str()).collect();
    let mut list = vec![];
    for (i, name) in on.iter().enumerate() {
        match known.iter().position(|k| *k == name.as_str()) {
            Some(at) => list.push(at),
            None => {
                let mut d = Diagnostic::error("unknown-name", format!("there is no segment `{}`", name.as_str()))
                    .at(format!("{pointer}/on/{i}"), "no segment has this name");
                if let Some(near) = nearest(name.as_str(), known.iter().copied()) {
                    d = d.help(format!("did you mean `{near}`?"));
                }
                errors.push(d.help(format!("segments: {}", known.join(", "))));
            }
        }
    }
    list
}

/// Adds a load to pieces.
#[allow(clippy::too_many_arguments)]
fn add(
    name: &str,
    components: &[(String, Component, String)],
    current: bool,
    chosen: &[usize],
    pointer: &str,
    names: &mut Names,
    pieces: &mut [Piece],
    errors: &mut Vec<Diagnostic>,
) {
    if components.is_empty() {
        errors.push(
            Diagnostic::error("no-component", "a traction needs a component")
                .at(pointer, "none of normal, tangential, radial, axial is given"),
        );
        return;
    }
    let texts: Vec<(&str, String)> =
        components.iter().map(|(text, _, key)| (text.as_str(), format!("{pointer}/{key}"))).collect();
    let Some((tape, variables)) = names.field(&texts, errors) else { return };
    let load = Arc::new(Load {
        name: name.to_owned(),
        tape,
        variables,
        components: components.iter().map(|c| c.1).collect(),
        current,
    });
    for &s in chosen {
        if pieces[s].loads.len() == MOST_LOADS {
            errors.push(
                Diagnostic::error("too-many-tractions", format!("more than {MOST_LOADS} tractions on one segment"))
                    .at(pointer, "one too many"),
            );
            return;
        }
        pieces[s].loads.push(load.clone());
    }
}

/// Outward normal traction, per current area, of a sphere of radius `r` that carries the charge of a sphere of radius `reference`, under
/// its own repulsion with coupling `c` (Yukawa field of a sphere: E = 2 pi sigma/x (1 - (1 + x) exp(-2 x)), x = k r).
pub(super) fn sphere_repulsion(c: f64, k: f64, reference: f64, r: f64) -> f64 {
    let (x, sigma) = (k * r, (reference / r).powi(2));
    c * sigma * sigma * 2.0 * PI / x * (-(-2.0 * x).exp_m1() - x * (-2.0 * x).exp())
}
