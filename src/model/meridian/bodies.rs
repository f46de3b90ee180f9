//! What holds the membrane: faces and edges of bodies, and whether they just touch the initial sphere.

use super::list::Segment;
use crate::diagnostic::Diagnostic;
use crate::model::names::Names;
use crate::model::{Initial, token};
use crate::physics::surface::{Cone, Facing, Plane, Surface};
use crate::spec::{Number, Problem, Shape};
use crate::system::{Kind, Place};
use std::f64::consts::PI;

/// Inclination below which a cone is a plane.
pub(super) const FLAT: f64 = 1e-9;

/// The surface of a body.
pub(super) fn surface(problem: &Problem, names: &Names, body: usize, errors: &mut Vec<Diagnostic>) -> Option<Surface> {
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

/// A sharp edge, where it touches the initial sphere.
pub(super) struct Edge {
    pub(super) body: usize,
    pub(super) facing: Facing,
    pub(super) radius: f64,
    pub(super) phi: f64,
}

/// The inner radius of a pipette, which must be smaller than the initial sphere.
pub(super) fn tube_radius(
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

/// Where the middle of the initial sphere stands, and whether the bodies just touch it there.
#[allow(clippy::too_many_arguments)]
pub(super) fn axial_place(
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
