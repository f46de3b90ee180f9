//! Tractions besides pressure: what each is, and on which pieces it acts.

use super::names::Names;
use super::{bracket, token};
use crate::diagnostic::Diagnostic;
use crate::expr::nearest;
use crate::spec::{Area, Element, Name, Number, Problem, Substrate, Traction};
use crate::system::{Component, Image, Load, MOST_LOADS, Piece, Repulsion};
use std::f64::consts::PI;
use std::sync::Arc;

/// The least distance from a plane with images, in radii of the initial membrane: the image of what lies on the plane itself coincides
/// with it.
const LEAST_GAP: f64 = 1e-6;

/// Puts the tractions of a file on its pieces.
pub(super) fn apply(problem: &Problem, names: &mut Names, pieces: &mut [Piece], errors: &mut Vec<Diagnostic>) {
    let (mut own, mut images): (Option<Charge>, Option<(Charge, Image)>) = (None, None);
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
            Traction::ChargedPlane { h, charge_ratio, coupling, debye_length, substrate, .. } => {
                let Some((c, k)) = charges(names, coupling, debye_length, &pointer, errors) else { continue };
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
                opposite(problem, charge_ratio, *substrate, &pointer, names, errors);
                let times = match substrate {
                    Substrate::Transparent => 2,
                    Substrate::Insulating | Substrate::Conducting => {
                        let sign = if *substrate == Substrate::Insulating { 1.0 } else { -1.0 };
                        if let Some(plane) = plane_of_images(problem, names, h, on.is_some(), &pointer, errors) {
                            let image = Image { sign, plane, side: down };
                            images = Some((Charge { coupling: c, k, pointer: pointer.clone() }, image));
                        }
                        // Of its own charge no field goes into the solid.
                        4
                    }
                };
                let text = format!(
                    "{down}*{times}*pi*{}*{}*exp(-{down}*({} - h)*({k:e}))",
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
                if own.is_some() {
                    errors.push(
                        Diagnostic::error("declared-twice", "the membrane repels itself twice")
                            .at(pointer.clone(), "the second one"),
                    );
                }
                own = Some(Charge { coupling, k, pointer });
            }
        }
    }
    charge(problem, own, images, pieces, errors);
    // Where the face under a piece stands, and the end of the membrane that the forces come to.
    for (s, piece) in pieces.iter_mut().enumerate() {
        piece.level = names.extent().map_or(0.0, |extent| extent.1);
        if let (Some(body), true) = (names.pieces[s].body, act_on(problem, &piece.name)) {
            let (name, said) = problem.bodies.get_index(body).expect("a body of the file");
            piece.apex = names.globals(&said.h, &format!("/bodies/{}/h", token(name)), errors);
        }
    }
}

/// The charge of the membrane: coupling and inverse screening length, and where the file says so.
struct Charge {
    coupling: f64,
    k: f64,
    pointer: String,
}

/// Charges the pieces: the whole membrane carries the charge that repels itself, and its images.
fn charge(
    problem: &Problem,
    own: Option<Charge>,
    images: Option<(Charge, Image)>,
    pieces: &mut [Piece],
    errors: &mut Vec<Diagnostic>,
) {
    let repels = if own.is_some() { 1.0 } else { 0.0 };
    if let (Some(own), Some((plane, _))) = (&own, &images)
        && ((own.coupling, own.k) != (plane.coupling, plane.k))
    {
        errors.push(
            Diagnostic::error("charge", "one membrane in one electrolyte has one coupling and one screening length")
                .at(plane.pointer.clone(), format!("here {} and {}", plane.coupling, 1.0 / plane.k))
                .at(own.pointer.clone(), format!("here {} and {}", own.coupling, 1.0 / own.k)),
        );
        return;
    }
    let image = images.as_ref().map(|i| i.1);
    let Some(charge) = own.or(images.map(|i| i.0)) else { return };
    if let Some(Element::Mirror { .. }) = problem.meridian.iter().flatten().last() {
        errors.push(
            Diagnostic::error(
                "not-supported",
                "a charged membrane with a mirror plane cannot be solved by this version",
            )
            .at(charge.pointer, "its other half would act on it as well")
            .help("model the whole membrane, from pole to pole"),
        );
        return;
    }
    for piece in pieces {
        piece.repulsion = Some(Repulsion { coupling: charge.coupling, k: charge.k, own: repels, image, rest: None });
    }
}

/// The axial position of a plane with images: it stands still, alone, apart from the membrane, and acts on all of it.
fn plane_of_images(
    problem: &Problem,
    names: &Names,
    h: &Number,
    on: bool,
    pointer: &str,
    errors: &mut Vec<Diagnostic>,
) -> Option<f64> {
    let mut refuse = |at: String, what: &str, label: &str| {
        errors.push(Diagnostic::error("not-supported", what.to_owned()).at(at, label.to_owned()));
    };
    if on {
        refuse(format!("{pointer}/on"), "the whole membrane has an image", "leave this out");
    }
    let planes = problem.tractions.values().filter(|t| matches!(t, Traction::ChargedPlane { .. })).count();
    if planes > 1 {
        refuse(
            format!("{pointer}/substrate"),
            "two planes make images of images",
            "only next to no other charged plane",
        );
    }
    let at = format!("{pointer}/h");
    let plane = names.constant(h, &at, errors)?;
    let (top, bottom) = names.extent()?;
    let gap = (plane - bottom).max(top - plane);
    if gap < LEAST_GAP * 0.5 * (bottom - top) {
        errors.push(
            Diagnostic::error("image-in-contact", "where the membrane touches the plane its image coincides with it")
                .at(at, format!("{gap} from the membrane"))
                .help(format!("a distance of {LEAST_GAP} radii or more; `Transparent` goes down to 0")),
        );
        return None;
    }
    Some(plane)
}

/// Charges of equal sign repel each other: where nothing else brings the membrane to the plane, no state is in contact with it.
fn opposite(
    problem: &Problem,
    ratio: &Number,
    substrate: Substrate,
    pointer: &str,
    names: &Names,
    errors: &mut Vec<Diagnostic>,
) {
    let held = |t: &Traction| matches!(t, Traction::Applied { .. });
    let touches = problem.meridian.iter().flatten().any(|e| matches!(e, Element::Contact { .. }));
    if substrate == Substrate::Conducting || !touches || problem.tractions.values().any(held) {
        return;
    }
    // Its values, and where the file says them.
    let mut said: Vec<(&Number, String)> = vec![];
    match &problem.branch {
        Some(branch) if matches!(ratio, Number::Formula(f) if f.as_str() == branch.control.as_str()) => {
            said.extend(branch.from.iter().map(|n| (n, "/branch/from".to_owned())));
            said.extend(branch.to.iter().map(|n| (n, "/branch/to".to_owned())));
            said.extend(branch.at.iter().flatten().enumerate().map(|(i, n)| (n, format!("/branch/at/{i}"))));
        }
        _ => said.push((ratio, format!("{pointer}/charge_ratio"))),
    }
    let values = said.into_iter().filter_map(|(n, at)| Some((names.constant(n, "", &mut vec![])?, at)));
    for (value, at) in values.filter(|(value, _)| *value < 0.0) {
        errors.push(
            Diagnostic::error("equal-charges", format!("at a charge ratio of {value} membrane and plane repel each other"))
                .at(at, "charges of equal sign")
                .help("`charge_ratio` is the charge of the plane over that of the membrane, with opposite sign: positive where they attract"),
        );
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

/// Where the file says that the membrane repels itself.
pub(super) fn place_of_repulsion(problem: &Problem) -> String {
    let found = problem.tractions.iter().find(|t| matches!(t.1, Traction::SelfRepulsion { .. }));
    found.map_or("/tractions".to_owned(), |(name, _)| format!("/tractions/{}/SelfRepulsion/coupling", token(name)))
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
            .at(at, format!("the membrane stands between h = {top} and {bottom}"))
            .help("it stands behind the plane that the membrane rests on, at a distance of 0 or more"),
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
