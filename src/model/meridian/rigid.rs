//! Rigid bodies: the faces and edges that the shape of a body has.

use crate::diagnostic::Diagnostic;
use crate::model::names::Names;
use crate::model::{facing, token};
use crate::physics::surface::{
    Arc, Cone, Curve, Cylinder, Face, Facing, Generator, Line, Paraboloid, Plane, Sphere, Surface,
};
use crate::spec::{self, Number, Problem, Shape};
use std::f64::consts::PI;

/// Inclination below which a cone is a plane.
pub(super) const FLAT: f64 = 1e-9;

/// The faces and edges of a body, from the axis outwards.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// The faces.
    pub faces: Vec<RigidFace>,
    /// The sharp edges.
    pub edges: Vec<RigidEdge>,
}

/// A face of a body.
#[derive(Clone, Debug)]
pub struct RigidFace {
    /// Its name in formulas: that of the body, or `body.face`.
    pub name: String,
    /// The surface and its side.
    pub face: Face,
    /// The part of the generator that belongs to it.
    pub range: [f64; 2],
}

impl RigidFace {
    /// How far the point at parameter `t` of the generator is beyond the end of the face (length); nothing on the face.
    pub fn overhang(&self, t: f64) -> Option<f64> {
        let end = t.clamp(self.range[0], self.range[1]);
        let [here, there] = [t, end].map(|t| self.face.surface.point(t));
        (t != end).then(|| (here[0] - there[0]).hypot(here[1] - there[1]))
    }

    /// Distance of a point at radius `u`, `drop` below the foremost point on the axis, from the face.
    fn distance(&self, u: f64, drop: f64) -> f64 {
        let far = |t: f64| (self.face.surface.point(t)[0] - u).hypot(self.face.drop(t) - drop);
        let [first, end] = self.range;
        let last = end.min(first + 10.0 * (u + drop.abs()));
        let step = (last - first) / PLACES as f64;
        let place = |i: usize| first + step * i as f64;
        let best = (0..=PLACES).min_by(|a, b| far(place(*a)).total_cmp(&far(place(*b)))).unwrap_or(0);
        let (mut a, mut b) = (place(best.saturating_sub(1)), place((best + 1).min(PLACES)));
        for _ in 0..100 {
            let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            if far(p) < far(q) { b = q } else { a = p }
        }
        far(0.5 * (a + b))
    }
}

/// Places of a face among which the nearest one is looked for.
const PLACES: usize = 100;

/// A sharp edge between two faces of a body.
#[derive(Clone, Debug)]
pub struct RigidEdge {
    /// Its name in formulas, `body.edge`.
    pub name: String,
    /// Radius, and depth behind the foremost point on the axis.
    pub at: [f64; 2],
    /// The faces that meet in it, each with its parameter there.
    pub on: [(usize, f64); 2],
}

/// Names of the faces of a shape; none where the body is one face.
pub(super) fn face_names(shape: &Shape) -> Vec<&str> {
    match shape {
        Shape::Punch { .. } => vec!["face", "side"],
        Shape::Pipette { .. } => vec!["wall", "rim"],
        Shape::Faces { faces, .. } => faces.iter().map(|f| said(f).0).collect(),
        _ => vec![],
    }
}

/// How many faces that meet smoothly a shape has, where one name means all of them. A contact reaches them one after the other.
pub(super) fn chain(shape: &Shape) -> usize {
    match shape {
        Shape::Cone { tip_radius: Some(_), .. } => 2,
        _ => 1,
    }
}

/// Names of the sharp edges of a shape.
pub(super) fn edge_names(shape: &Shape) -> Vec<&str> {
    match shape {
        Shape::Punch { .. } => vec!["edge"],
        Shape::Pipette { .. } => vec!["mouth"],
        Shape::Faces { faces, .. } => faces[..faces.len().max(1) - 1].iter().filter_map(|f| said(f).1).collect(),
        _ => vec![],
    }
}

/// Name of a face, and that of the edge at its end.
fn said(face: &spec::Face) -> (&str, Option<&str>) {
    let (spec::Face::Line { name, edge, .. }
    | spec::Face::Arc { name, edge, .. }
    | spec::Face::Curve { name, edge, .. }) = face;
    (name.as_str(), edge.as_ref().map(|e| e.as_str()))
}

impl Rigid {
    /// How deep a point at radius `u`, `drop` below the foremost point on the axis, lies inside the solid (length); negative
    /// outside, nothing where no face stands there.
    pub fn penetration(&self, u: f64, drop: f64) -> Option<f64> {
        let within = |f: &&RigidFace| match f.face.surface {
            Surface::Cylinder(_) => self.faces.len() == 1 || f.face.is_tube(),
            _ => f.face.surface.at_radius(u).is_some_and(|t| f.range[0] <= t && t <= f.range[1]),
        };
        // In front of the rim of a pipette there is no wall: both must say inside.
        let depths = self.faces.iter().filter(within).filter_map(|f| f.face.penetration(u, drop));
        let depth = depths.reduce(f64::min)?;
        // A point inside may be nearer to another face than to the one in front of it.
        Some(if depth > 0.0 { self.faces.iter().fold(depth, |d, f| d.min(f.distance(u, drop))) } else { depth })
    }

    /// The directions (outwards, downwards) into the solid on both sides of an edge.
    pub fn into_solid(&self, edge: &RigidEdge) -> [(String, [f64; 2]); 2] {
        edge.on.map(|(face, t)| {
            let f = &self.faces[face];
            let (sin, cos) = f.face.tangent(f.face.frame(t).angle).sin_cos();
            (f.name.clone(), [sin, -cos])
        })
    }
}

/// Reads a number that must be positive.
fn positive(names: &Names, n: &Number, at: &str, what: &str, errors: &mut Vec<Diagnostic>) -> Option<f64> {
    let v = names.constant(n, at, errors)?;
    if v > 0.0 {
        return Some(v);
    }
    errors.push(
        Diagnostic::error("not-positive", format!("{what} must be positive, not {v}"))
            .at(at.to_owned(), format!("is {v}")),
    );
    None
}

/// The inclination of a cone, between 0 and 89.5 degrees.
fn inclination(
    problem: &Problem,
    names: &Names,
    said: &Number,
    at: String,
    errors: &mut Vec<Diagnostic>,
) -> Option<f64> {
    let angle = names.constant(said, &at, errors)?;
    if (0.0..PI / 2.0).contains(&angle) && angle <= 89.5_f64.to_radians() {
        return Some(angle);
    }
    let mut d = Diagnostic::error(
        "inclination",
        format!("the inclination of a cone must lie between 0 and 89.5 degrees, not {:.6} degrees", angle.to_degrees()),
    )
    .at(at, "measured from the horizontal; 0 is flat");
    // The commonest slip: a bare number of degrees.
    if let Number::Formula(text) = said
        && let Some(Number::Value(v)) = problem.parameters.get(text.trim())
        && *v >= 2.0
    {
        d = d.at(format!("/parameters/{}", token(text.trim())), format!("{v} radians; write \"{v}[deg]\""));
    } else if let Number::Value(v) = said
        && *v >= 2.0
    {
        d = d.help(format!("{v} radians; write \"{v}[deg]\""));
    }
    errors.push(d);
    None
}

/// The faces and edges of a body of the file.
pub(super) fn rigid(problem: &Problem, names: &Names, body: usize, errors: &mut Vec<Diagnostic>) -> Option<Rigid> {
    let (name, said) = problem.bodies.get_index(body)?;
    let pointer = format!("/bodies/{}/shape", token(name));
    let facing = facing(said.facing);
    let one = |surface: Surface, hollow: bool| {
        let range = [0.0, surface.end()];
        let face = Face::new(surface, facing, hollow);
        Some(Rigid { faces: vec![RigidFace { name: name.clone(), face, range }], edges: vec![] })
    };
    match &said.shape {
        Shape::Plane => one(Plane.into(), false),
        Shape::Cone { inclination: angle, tip_radius, hollow } => {
            let angle = inclination(problem, names, angle, format!("{pointer}/Cone/inclination"), errors);
            let radius = match tip_radius {
                Some(n) => {
                    Some(positive(names, n, &format!("{pointer}/Cone/tip_radius"), "the radius of the tip", errors)?)
                }
                None => None,
            };
            let angle = angle?;
            match radius {
                _ if angle < FLAT => one(Plane.into(), *hollow),
                None => one(Cone { inclination: angle }.into(), *hollow),
                Some(radius) => {
                    // A sphere, and the cone that it touches along a circle.
                    let tip = Sphere { radius };
                    let rim = tip.point(radius * angle);
                    let faces: [(String, Surface, [f64; 2]); 2] = [
                        (name.clone(), tip.into(), [0.0, radius * angle]),
                        (format!("{name}.side"), Line::ray(rim, angle).into(), UNBOUNDED),
                    ];
                    let faces = faces.map(|(name, surface, range)| RigidFace {
                        name,
                        face: Face::new(surface, facing, *hollow),
                        range,
                    });
                    Some(Rigid { faces: faces.into(), edges: vec![] })
                }
            }
        }
        Shape::Sphere { radius, hollow } => {
            let radius =
                positive(names, radius, &format!("{pointer}/Sphere/radius"), "the radius of the sphere", errors)?;
            one(Sphere { radius }.into(), *hollow)
        }
        Shape::Paraboloid { radius, hollow } => {
            let at = format!("{pointer}/Paraboloid/radius");
            let radius = positive(names, radius, &at, "the radius of the paraboloid", errors)?;
            one(Paraboloid { radius }.into(), *hollow)
        }
        Shape::Cylinder { radius, hollow } => {
            let at = format!("{pointer}/Cylinder/radius");
            let radius = positive(names, radius, &at, "the radius of the cylinder", errors)?;
            one(Cylinder { radius }.into(), *hollow)
        }
        Shape::Profile(depth) => {
            let at = format!("{pointer}/Profile");
            let curve = Curve::profile(names.curve("u", &[(depth, at.clone())], errors)?);
            let first = curve.point(0.0_f64)[1];
            if first != 0.0 {
                errors.push(
                    Diagnostic::error("profile-start", format!("the depth of a profile is 0 on the axis, not {first}"))
                        .at(at, format!("is {first} at u = 0"))
                        .help("the place of the body is said by `h`; subtract the value at u = 0"),
                );
                return None;
            }
            one(curve.into(), false)
        }
        Shape::Punch { radius } => {
            let at = format!("{pointer}/Punch/radius");
            let radius = positive(names, radius, &at, "the radius of the punch", errors)?;
            Some(pair(
                name,
                facing,
                [("face", Plane.into(), [0.0, radius]), ("side", Cylinder { radius }.into(), UNBOUNDED)],
                false,
                "edge",
                [radius, 0.0],
                [radius, 0.0],
            ))
        }
        Shape::Pipette { radius } => {
            let at = format!("{pointer}/Pipette/radius");
            let radius = positive(names, radius, &at, "the radius of the pipette", errors)?;
            Some(pair(
                name,
                facing,
                [("wall", Cylinder { radius }.into(), UNBOUNDED), ("rim", Plane.into(), [radius, f64::INFINITY])],
                true,
                "mouth",
                [radius, 0.0],
                [0.0, radius],
            ))
        }
        Shape::Faces { from, faces } => drawn(names, name, facing, from, faces, &pointer, errors),
    }
}

const UNBOUNDED: [f64; 2] = [0.0, f64::INFINITY];

/// A body of two faces that meet in one edge; `hollow` holds for its cylinder.
fn pair(
    body: &str,
    facing: Facing,
    faces: [(&str, Surface, [f64; 2]); 2],
    hollow: bool,
    edge: &str,
    at: [f64; 2],
    on: [f64; 2],
) -> Rigid {
    let faces = faces.into_iter().map(|(name, surface, range)| {
        let hollow = hollow && matches!(surface, Surface::Cylinder(_));
        RigidFace { name: format!("{body}.{name}"), face: Face::new(surface, facing, hollow), range }
    });
    let edge = RigidEdge { name: format!("{body}.{edge}"), at, on: [(0, on[0]), (1, on[1])] };
    Rigid { faces: faces.collect(), edges: vec![edge] }
}

/// A profile drawn face by face.
fn drawn(
    names: &Names,
    body: &str,
    facing: Facing,
    from: &(Number, Number),
    faces: &[spec::Face],
    pointer: &str,
    errors: &mut Vec<Diagnostic>,
) -> Option<Rigid> {
    let before = errors.len();
    let point = |p: &(Number, Number), at: &str, errors: &mut Vec<Diagnostic>| -> Option<[f64; 2]> {
        let u = names.constant(&p.0, &format!("{at}/0"), errors);
        let d = names.constant(&p.1, &format!("{at}/1"), errors);
        Some([u?, d?])
    };
    let mut here = point(from, &format!("{pointer}/Faces/from"), errors)?;
    let mut list = vec![];
    let mut edges = vec![];
    for (i, said_face) in faces.iter().enumerate() {
        let at = format!("{pointer}/Faces/faces/{i}");
        let surface: Option<Surface> = match said_face {
            spec::Face::Line { to, .. } => point(to, &format!("{at}/Line/to"), errors).map(|to| {
                let line = Line::new(here, to);
                here = to;
                line.into()
            }),
            spec::Face::Arc { through, to, .. } => {
                let through = point(through, &format!("{at}/Arc/through"), errors);
                let to = point(to, &format!("{at}/Arc/to"), errors);
                through.zip(to).and_then(|(through, to)| {
                    let arc = Arc::new(here, through, to);
                    here = to;
                    if arc.is_none() {
                        errors.push(
                            Diagnostic::error("straight-arc", "the three points of this arc lie on a line")
                                .at(format!("{at}/Arc/through"), "between both ends, on the line")
                                .help("write Line(name: .., to: ..)"),
                        );
                    }
                    arc.map(Surface::from)
                })
            }
            spec::Face::Curve { u, d, t, .. } => {
                let first = names.constant(&t.0, &format!("{at}/Curve/t/0"), errors);
                let last = names.constant(&t.1, &format!("{at}/Curve/t/1"), errors);
                let formulas = [(u, format!("{at}/Curve/u")), (d, format!("{at}/Curve/d"))];
                let tape = names.curve("t", &formulas, errors);
                match (first, last, tape) {
                    (Some(first), Some(last), Some(tape)) => {
                        let curve = Curve::new(tape, first, last);
                        let [start, end] = [0.0, curve.end()].map(|t| curve.point(t));
                        let gap = (start[0] - here[0]).hypot(start[1] - here[1]);
                        if !(gap <= 1e-9 * (1.0 + here[0].abs() + here[1].abs())) {
                            errors.push(
                                Diagnostic::error("open-profile", "this face does not start where the last one ended")
                                    .at(format!("{at}/Curve/t"), format!("starts at ({}, {})", start[0], start[1]))
                                    .help(format!("the last one ended at ({}, {})", here[0], here[1])),
                            );
                        }
                        here = end;
                        Some(curve.into())
                    }
                    _ => None,
                }
            }
        };
        let Some(surface) = surface else { continue };
        if !(surface.end() > 0.0) {
            errors.push(
                Diagnostic::error("empty-face", "this face has no length").at(at.clone(), "ends where it starts"),
            );
        }
        let (name, edge) = said(said_face);
        let range = [0.0, surface.end()];
        if let (Some(edge), true) = (edge, i + 1 < faces.len()) {
            let on = [(list.len(), range[1]), (list.len() + 1, 0.0)];
            edges.push(RigidEdge { name: format!("{body}.{edge}"), at: here, on });
        }
        list.push(RigidFace { name: format!("{body}.{name}"), face: Face::new(surface, facing, false), range });
    }
    (errors.len() == before && !list.is_empty()).then_some(Rigid { faces: list, edges })
}
