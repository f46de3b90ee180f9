//! The field of a charged membrane on itself, at a state: what the local energy of [`super::Repulsion`] misses.
//!
//! With q = C E the force of the whole field per reference area, the local energy D = (pi C/k)/(lambda mu) accounts for
//!
//! ```text
//! rho0 q_t = dD_l/d eta + rho0' D_l - D_m cos tau,       rho0 q_n = -D_l dtau/d eta - D_m sin tau
//! ```
//!
//! with an image in a plane D f(h) accounts for f times that, for D_l f' dh/d eta along the membrane, and for -D f' downwards,
//!
//! and the rest is what is left at each node at which the equations are collocated.

use super::repulsion::{Given, Image, Rest};
use super::{Coordinate, Kind, Place, System};
use crate::bvp::{Discretization, Gauss, Problem};
use crate::physics::screened::{Charged, Field, Ring, Sheet, near, on_surface};
use cpu_time::ThreadTime;
use rayon::prelude::*;
use std::sync::Arc;

/// Stages more than those of the state, for the shape between mesh points.
const FINER: usize = 3;

/// The state as polynomials of higher degree: y' is the flow along the polynomial that the collocation solves, twice over. The field
/// asks for the curvature everywhere, and the collocation knows it at its nodes only.
fn lifted(system: &System, disc: &Discretization, z: &[f64]) -> (Discretization, Vec<f64>) {
    let gauss = Arc::new(Gauss::new(disc.gauss.stages() + FINER));
    let fine = Discretization::new(disc.layout.clone(), gauss, disc.meshes.clone());
    let k = fine.gauss.stages();
    let globals = disc.globals(z);
    let mut out = vec![0.0; fine.unknowns()];
    out[fine.p()..].copy_from_slice(globals);
    let mut before = z.to_vec();
    for pass in 0..2 {
        let from = if pass == 0 { disc } else { &fine };
        for (s, piece) in system.pieces.iter().enumerate() {
            let n = piece.states();
            let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
            let points = (disc.intervals(s) + 1) * n;
            out[fine.y(s, 0)..fine.y(s, 0) + points].copy_from_slice(&z[disc.y(s, 0)..disc.y(s, 0) + points]);
            let mut y = [0.0; 4];
            for i in 0..disc.intervals(s) {
                for j in 0..k {
                    let theta = fine.gauss.nodes[j];
                    from.interpolate(&before, s, i, theta, &mut y[..n]);
                    let at = fine.k(s, i) + j * n;
                    system.flow(s, disc.meshes[s][i] + disc.width(s, i) * theta, &y[..n], &p, &mut out[at..at + n]);
                }
            }
        }
        before.clone_from(&out);
    }
    (fine, out)
}

/// A discrete state as a charged surface of revolution. On a face at a pole the radius grows with the square root of x, so x is squared
/// there.
struct Surface<'a> {
    system: &'a System,
    disc: &'a Discretization,
    z: &'a [f64],
    extents: Vec<Extent>,
}

/// What does not change along a piece.
struct Extent {
    a: f64,
    b: f64,
    apex: f64,
    breaks: Vec<f64>,
}

/// The nearest that a place comes to a pole.
const POLE: f64 = 1e-120;

impl<'a> Surface<'a> {
    fn new(system: &'a System, disc: &'a Discretization, z: &'a [f64]) -> Self {
        let globals = disc.globals(z);
        let extents = system
            .pieces
            .iter()
            .enumerate()
            .map(|(s, piece)| {
                let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
                let (a, b) = piece.places(&p);
                let apex = piece.apex_at(&|g| globals[g]);
                let breaks = disc.meshes[s].iter().map(|&x| outer(piece.coordinate, x)).collect();
                Extent { a, b, apex, breaks }
            })
            .collect();
        Surface { system, disc, z, extents }
    }
}

/// x as the surface sees it, and back.
fn outer(coordinate: Coordinate, x: f64) -> f64 {
    match coordinate {
        Coordinate::FromPole(2.0) => x.sqrt(),
        Coordinate::ToPole(2.0) => 1.0 - (1.0 - x).sqrt(),
        _ => x,
    }
}

fn inner(coordinate: Coordinate, x: f64) -> f64 {
    match coordinate {
        Coordinate::FromPole(2.0) => x * x,
        Coordinate::ToPole(2.0) => 1.0 - (1.0 - x).powi(2),
        _ => x,
    }
}

/// How x as the surface sees it lies on the reference meridian.
fn seen(coordinate: Coordinate) -> Coordinate {
    match coordinate {
        Coordinate::FromPole(_) => Coordinate::FromPole(1.0),
        Coordinate::ToPole(_) => Coordinate::ToPole(1.0),
        other => other,
    }
}

impl Charged for Surface<'_> {
    fn pieces(&self) -> usize {
        self.extents.len()
    }

    fn breaks(&self, piece: usize) -> &[f64] {
        &self.extents[piece].breaks
    }

    fn at(&self, s: usize, x: f64) -> Ring {
        let (piece, extent) = (&self.system.pieces[s], &self.extents[s]);
        let x = x.clamp(POLE, 1.0 - f64::EPSILON);
        let (interval, theta) = self.disc.locate(s, inner(piece.coordinate, x));
        let mut y = [0.0; 4];
        let n = piece.states();
        self.disc.interpolate(self.z, s, interval, theta, &mut y[..n]);
        let (eta, stretch) = seen(piece.coordinate).at(x, extent.a, extent.b);
        let m = piece.spot(&self.system.reference, eta, &y[..n]);
        let z = match &piece.kind {
            Kind::Free => y[3],
            Kind::Contact(face) => extent.apex + face.drop(face.parameter(y[1], m.rho0)),
        };
        let along = m.rho0 * stretch;
        Ring { u: m.u, z, du: along * m.lambda * m.cos, dz: along * m.lambda * m.sin, charge: along * m.rho0 }
    }
}

/// No field.
const NOTHING: Field = Field { radial: 0.0, axial: 0.0, potential: 0.0, error: 0.0 };
/// k times a distance beyond which no field is left.
const LOST: f64 = 45.0;

/// The field of the image of a surface at a place of it: that of the surface at the image of the place, mirrored.
fn mirrored(sheet: &Sheet, k: f64, piece: usize, x: f64, image: &Image) -> Field {
    let spot = sheet.at(piece, x);
    let nearest = if image.side > 0.0 { sheet.span[1] } else { sheet.span[0] };
    if k * image.side * (2.0 * image.plane - spot.z - nearest) > LOST {
        return NOTHING;
    }
    let field = near(sheet, k, spot.u, 2.0 * image.plane - spot.z);
    Field {
        radial: image.sign * field.radial,
        axial: -image.sign * field.axial,
        potential: image.sign * field.potential,
        error: field.error,
    }
}

/// What the local energy misses on each piece, at the Gauss nodes of a state, and the processor time that this took on other threads,
/// seconds; nothing where there is no repulsion.
pub fn rests(system: &System, disc: &Discretization, z: &[f64]) -> Option<(Vec<Rest>, f64)> {
    let repulsion = system.pieces.first()?.repulsion.as_ref()?;
    let (fine, smooth) = lifted(system, disc, z);
    let surface = Surface::new(system, &fine, &smooth);
    let sheet = Sheet::new(&surface);
    let (k, globals) = (disc.gauss.stages(), disc.globals(z));
    let all: Vec<(usize, usize, usize)> = (0..system.pieces.len())
        .flat_map(|s| (0..disc.intervals(s)).flat_map(move |i| (0..k).map(move |j| (s, i, j))))
        .collect();
    let here = std::thread::current().id();
    let values: Vec<(Node, f64)> = all
        .par_iter()
        .map(|&(s, i, j)| {
            let begun = ThreadTime::now();
            let piece = &system.pieces[s];
            let x = disc.meshes[s][i] + disc.width(s, i) * disc.gauss.nodes[j];
            let place = outer(piece.coordinate, x);
            let mut field = NOTHING;
            if repulsion.own > 0.0 {
                field = on_surface(&sheet, repulsion.k, s, place);
            }
            let mirrored = repulsion.image.map_or(NOTHING, |image| mirrored(&sheet, repulsion.k, s, place, &image));
            let n = piece.states();
            let mut y = [0.0; 4];
            disc.interpolate(z, s, i, disc.gauss.nodes[j], &mut y[..n]);
            let slopes = &z[disc.k(s, i) + j * n..disc.k(s, i) + (j + 1) * n];
            let (eta, stretch) = piece.coordinate.at(x, surface.extents[s].a, surface.extents[s].b);
            let m = piece.local(&system.reference, &system.law, eta, &y[..n]);
            let d = repulsion.local(m.lambda, m.mu);
            // Slopes by eta; stage derivatives are by x.
            let [by_l, by_m] = [slopes[0] * m.lambda / stretch, m.lambda * m.cos - m.mu * m.slope0];
            let turning = match &piece.kind {
                Kind::Free => slopes[2] / stretch,
                Kind::Contact(face) => {
                    let frame = face.frame(face.parameter(y[1], m.rho0));
                    face.bend(&frame) * face.sense / frame.speed * m.rho0 * m.lambda
                }
            };
            let p: Vec<f64> = piece.parameters().iter().map(|&g| globals[g]).collect();
            let h = piece.height(&m, &y[..n], piece.ends(&p).2);
            let [f, slope] = repulsion.factor(h);
            let t = f * (d.w_ll * by_l + d.w_lm * by_m + m.slope0 * d.w_l - d.w_m * m.cos) / m.rho0
                + slope * d.w_l * m.lambda * m.sin;
            let normal = f * (-d.w_l * turning - d.w_m * m.sin) / m.rho0;
            let c = repulsion.coupling;
            let radial = c * (field.radial + mirrored.radial) - (t * m.cos + normal * m.sin);
            let axial = c * (field.axial + mirrored.axial) - (t * m.sin - normal * m.cos) - repulsion.pull(&m, h);
            // How much of a traction arrives in ln(lambda) and tau.
            let r = &m.response;
            let effect = m.rho0 * stretch * disc.width(s, i) / r.w_l.abs().min(m.lambda * r.w_ll.abs());
            let energies = [field, mirrored].map(|field| 0.5 * c * field.potential);
            let given = [radial / m.rho0, axial, energies[0], c * mirrored.axial, energies[1]];
            let node = (given, [c * (field.error + mirrored.error), effect, m.rho0]);
            let elsewhere = if std::thread::current().id() == here { 0.0 } else { begun.elapsed().as_secs_f64() };
            (node, elsewhere)
        })
        .collect();
    let elsewhere = values.iter().map(|v| v.1).sum();
    let mut rest = values.into_iter().map(|v| v.0);
    let pieces = (0..system.pieces.len()).map(|s| {
        let (values, others): (Vec<_>, Vec<_>) = rest.by_ref().take(disc.intervals(s) * k).unzip();
        let error = others.iter().fold(0.0, |a, o| f64::max(a, o[0]));
        let unresolved = (values.chunks(k).zip(others.chunks(k)))
            .enumerate()
            .map(|(i, (v, o))| {
                let largest = |i: usize| o.iter().fold(0.0, |a, o| f64::max(a, o[i]));
                let unknown = |place| matches!(place, Place::Unknown(_));
                let edge = (i == 0 && unknown(system.pieces[s].from))
                    || (i + 1 == disc.intervals(s) && unknown(system.pieces[s].to));
                Rest::hidden(&disc.gauss, v, largest(2), edge) * largest(1)
            })
            .collect();
        let radii = others.iter().map(|o| o[2]).collect();
        let (gauss, mesh) = (disc.gauss.clone(), disc.meshes[s].clone());
        Rest { gauss, mesh, values, radii, error, unresolved, contraction: None }
    });
    Some((pieces.collect(), elsewhere))
}

/// What is found at a node: the values of a [`Rest`]; the error, how much of a traction arrives in the states, the reference radius.
type Node = (Given, [f64; 3]);

/// Gives a system the field that continues that of two states of a branch: on by `t` times the way from the first to the second.
pub fn continue_field(system: &mut System, [first, second]: [&System; 2], t: f64) {
    for (s, piece) in system.pieces.iter_mut().enumerate() {
        let rest = |of: &System| of.pieces.get(s).and_then(|piece| piece.repulsion.as_ref()?.rest.clone());
        let (Some(repulsion), Some(to)) = (&mut piece.repulsion, rest(second)) else { continue };
        let Some(from) = rest(first).filter(|_| t != 0.0) else {
            repulsion.rest = Some(to);
            continue;
        };
        let mut next = Rest::clone(&to);
        for ((x, value), v) in to.places().zip(&to.values).zip(&mut next.values) {
            let old = from.at(x);
            (0..v.len()).for_each(|c| v[c] = value[c] + t * (value[c] - old[c]));
        }
        repulsion.rest = Some(Arc::new(next));
    }
}

/// How a field differs from the one before it.
#[derive(Clone, Copy, Debug)]
pub struct Renewed {
    /// The largest change of a traction.
    pub change: f64,
    /// How much bringing it up to date again and again would change it.
    pub left: f64,
    /// Its own error.
    pub grain: f64,
}

/// Part of the contraction found on the way to states before that is believed at least.
const REMEMBERED: f64 = 0.5;

/// Puts newly computed tractions on the pieces; `before` is the change by the last renewal, of the same kind on the same mesh. The
/// changes fall geometrically, which tells what is left of them. If that is `enough` it is counted among the errors of the tractions.
pub fn renew(system: &mut System, rests: Vec<Rest>, before: Option<f64>, enough: f64) -> Renewed {
    let (mut change, mut known) = (0.0_f64, None);
    for (piece, rest) in system.pieces.iter().zip(&rests) {
        let old = piece.repulsion.as_ref().and_then(|r| r.rest.as_ref());
        known = known.or(old.and_then(|old| old.contraction));
        for (at, (x, value)) in rest.places().zip(&rest.values).enumerate() {
            let old = old.map_or(Given::default(), |old| old.at(x));
            let moved = ((value[0] - old[0]) * rest.radii[at]).hypot(value[1] - old[1]);
            change = if moved > change || moved.is_nan() { moved } else { change };
        }
    }
    // Below its own error a field changes without a rule.
    let grain = rests.iter().fold(0.0, |a, rest| f64::max(a, rest.error));
    let contraction = match before {
        Some(before) if change > grain => Some((change / before).max(REMEMBERED * known.unwrap_or(0.0))),
        _ => known,
    };
    let left = match contraction {
        Some(c) if change > grain => {
            if c < 1.0 {
                change * c / (1.0 - c)
            } else {
                f64::INFINITY
            }
        }
        _ => change,
    };
    let settled = left <= enough;
    for (piece, mut rest) in system.pieces.iter_mut().zip(rests) {
        let Some(repulsion) = &mut piece.repulsion else { continue };
        rest.contraction = contraction;
        if settled {
            rest.error += left;
        }
        repulsion.rest = Some(Arc::new(rest));
    }
    Renewed { change, left, grain }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A sphere around the origin with a uniform charge of 1 per area, in one piece, x the angle from the top pole over pi.
    struct Ball(f64);

    impl Charged for Ball {
        fn pieces(&self) -> usize {
            1
        }
        fn breaks(&self, _: usize) -> &[f64] {
            &[0.0, 0.25, 0.5, 0.75, 1.0]
        }
        fn at(&self, _: usize, x: f64) -> Ring {
            let (sin, cos) = ((PI * x.min(1.0 - x)).sin(), (PI * x).cos());
            let r = self.0;
            let [du, dz] = [cos, sin].map(|v| PI * r * v);
            Ring { u: r * sin, z: -r * cos, du, dz, charge: r * sin * PI * r }
        }
    }

    /// Outside, a charged sphere acts like a point that carries its charge times sinh(k r)/(k r).
    #[test]
    fn the_image_of_a_sphere_is_a_point() {
        let r = 1.2;
        let sheet = Sheet::new(&Ball(r));
        for k in [1.0_f64, 10.0, 100.0] {
            for gap in [1e-4, 0.003, 0.3] {
                // z grows downwards
                let plane = r + gap;
                let exact = |x: f64, plane: f64, sign: f64| {
                    let (u, z) = (r * (PI * x).sin(), -r * (PI * x).cos() - 2.0 * plane);
                    let l = u.hypot(z);
                    // 4 pi r^2 sinh(k r)/(k r) exp(-k l), without overflow
                    let q = 2.0 * PI * r / k * ((k * (r - l)).exp() - (-k * (r + l)).exp());
                    let e = q * (1.0 + k * l) / l.powi(3);
                    [sign * e * u, sign * e * z, sign * q / l]
                };
                for x in [0.0, 0.4, 0.9, 0.999, 1.0] {
                    for sign in [1.0, -1.0] {
                        let f = mirrored(&sheet, k, 0, x, &Image { sign, plane, side: 1.0 });
                        let miss = |e: [f64; 3]| {
                            let field = (f.radial - e[0]).hypot(f.axial - e[1]);
                            field.max(k * (f.potential - e[2]).abs())
                        };
                        let exact_here = miss(exact(x, plane, sign));
                        assert!(
                            exact_here < 1e-9 && exact_here <= f.error + 1e-15,
                            "{k} {gap} {x}: {exact_here:e} {f:?}"
                        );
                        if x > 0.9 && gap < 0.1 {
                            assert!(miss(exact(x, plane, -sign)) > 1e-3, "charges of the other sign");
                            assert!(miss(exact(x, plane + 0.5 * gap, sign)) > 1e-5, "another plane");
                        }
                    }
                }
            }
        }
    }
}
