//! Tests: closed forms, independent values, balance of forces, brute force, and a rule that must fail.

use std::f64::consts::PI;

use serde_json::Value;

use super::*;

mod small;

type Curve = Box<dyn Fn(f64) -> [f64; 4]>;

/// Pieces given by (u, z, u', z') of a parameter, with a charge per area or per parameter.
struct Shape {
    pieces: Vec<(Curve, [f64; 2], Vec<f64>)>,
    charge: Box<dyn Fn(f64, [f64; 4]) -> f64>,
}

impl Charged for Shape {
    fn pieces(&self) -> usize {
        self.pieces.len()
    }
    fn breaks(&self, piece: usize) -> &[f64] {
        &self.pieces[piece].2
    }
    fn at(&self, piece: usize, x: f64) -> Ring {
        let (curve, [from, to], _) = &self.pieces[piece];
        let phi = from + (to - from) * x;
        let p = curve(phi);
        let charge = (self.charge)(phi, p) * (to - from);
        Ring { u: p[0], z: p[1], du: p[2] * (to - from), dz: p[3] * (to - from), charge }
    }
}

fn breaks(n: usize) -> Vec<f64> {
    (0..=n).map(|i| i as f64 / n as f64).collect()
}

/// Half axes a (radial), b; one piece in phi from the top pole, `n` stretches.
fn spheroid(a: f64, b: f64, n: usize) -> (Curve, [f64; 2], Vec<f64>) {
    // the sine of the angle from the nearer pole, so that u vanishes at both
    let sine = |phi: f64| if phi > 0.5 * PI { (PI - phi).sin() } else { phi.sin() };
    (Box::new(move |phi| [a * sine(phi), b * phi.cos(), a * phi.cos(), -b * sine(phi)]), [0.0, PI], breaks(n))
}

fn uniform(_: f64, p: [f64; 4]) -> f64 {
    p[0] * p[2].hypot(p[3])
}

fn sphere(r: f64, n: usize) -> Shape {
    Shape { pieces: vec![spheroid(r, r, n)], charge: Box::new(uniform) }
}

/// Two flat discs and half a torus, in three pieces of different scale in x.
fn disc(n: usize) -> Shape {
    let third = PI / 3.0;
    let torus = move |phi: f64| {
        let a = 3.0 * (phi - third);
        [0.6 + 0.4 * a.sin(), 0.4 * a.cos(), 1.2 * a.cos(), -1.2 * a.sin()]
    };
    let slope = 0.6 / third;
    Shape {
        pieces: vec![
            (Box::new(move |phi| [slope * phi, 0.4, slope, 0.0]), [0.0, third], breaks(n)),
            (Box::new(torus), [third, 2.0 * third], breaks(n)),
            (Box::new(move |phi| [slope * (PI - phi), -0.4, -slope, 0.0]), [2.0 * third, PI], breaks(n)),
        ],
        charge: Box::new(uniform),
    }
}

/// The piece and its x of a parameter phi.
fn locate(shape: &Shape, phi: f64) -> (usize, f64) {
    let piece = shape.pieces.iter().position(|(_, range, _)| phi <= range[1]).unwrap();
    let [from, to] = shape.pieces[piece].1;
    (piece, (phi - from) / (to - from))
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn reference() -> Value {
    let text = include_str!("../../../tests/data/reference/electrostatic.json");
    serde_json::from_str::<Value>(text).unwrap()["quadrature_tests"].clone()
}

/// Largest |E| along the meridian.
fn largest(shape: &Shape, k: f64) -> f64 {
    let mut most = 0.0_f64;
    for piece in 0..shape.pieces() {
        for i in 0..20 {
            let f = on_surface(&Sheet::new(shape), k, piece, (i as f64 + 0.5) / 20.0);
            most = most.max(f.radial.hypot(f.axial));
        }
    }
    most
}

fn compare(name: &str, shape: &Shape) {
    for entry in reference()[name].as_array().unwrap() {
        let k = entry["k"].as_f64().unwrap();
        let [phi, radial, axial, potential] =
            ["phi_over_pi", "E_r", "E_z", "potential"].map(|key| numbers(&entry[key]));
        let most = largest(shape, k);
        for i in 0..phi.len() {
            let (piece, x) = locate(shape, phi[i] * PI);
            let f = on_surface(&Sheet::new(shape), k, piece, x);
            let miss = (f.radial - radial[i]).abs().max((f.axial - axial[i]).abs()) / most;
            let other = (f.potential - potential[i]).abs() / potential[i];
            println!("{name} {k} {} miss {miss:.1e} potential {other:.1e} error {:.1e}", phi[i], f.error / most);
            assert!(miss < 1e-9 && other < 1e-9 && f.error < 1e-9 * most);
            // the reference itself is accurate to 1e-10
            assert!(miss < f.error / most + 1.2e-10);
        }
    }
}

#[test]
fn spheroids_agree_with_independent_values() {
    for n in [1, 7, 40] {
        let attached = Shape { pieces: vec![spheroid(1.5, 0.8, n)], charge: Box::new(|phi: f64, _| phi.sin()) };
        compare("spheroid_attached", &attached);
        let graded = |phi: f64, p| (1.0 + 0.3 * phi.cos()) * uniform(phi, p);
        compare("spheroid_density", &Shape { pieces: vec![spheroid(1.5, 0.8, n)], charge: Box::new(graded) });
    }
}

#[test]
fn jumps_of_curvature_agree_with_independent_values() {
    compare("rounded_disc", &disc(1));
    compare("rounded_disc", &disc(9));
}

#[test]
fn spheres_have_the_closed_form() {
    for r in [1.0, 1.2] {
        for n in [1, 30] {
            let shape = sphere(r, n);
            for kr in [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0] {
                let (k, scale) = (kr / r, 2.0 * PI / kr);
                let normal = scale * (1.0 - (1.0 + kr) * (-2.0 * kr).exp());
                let potential = scale * r * (1.0 - (-2.0 * kr).exp());
                let places =
                    [0.0, 1e-13, 1e-9, 1e-7, 1e-5, 1e-3, 0.03, 0.1 - 1e-12, 0.1, 0.1 + 1e-8, 0.37, 0.5, 0.8, 0.999];
                for x in places.into_iter().chain([1.0 - 1e-6, 1.0]) {
                    let f = on_surface(&Sheet::new(&shape), k, 0, x);
                    let ring = shape.at(0, x);
                    let miss = (f.radial - normal * ring.u / r).hypot(f.axial - normal * ring.z / r);
                    let other = (f.potential - potential).abs() * k;
                    println!("{r} {n} {kr} {x}: {:.1e} {:.1e} {:.1e}", miss / normal, other, f.error / normal);
                    assert!(miss < 1e-9 * normal && other < 1e-9, "{kr} {x} {miss:e}");
                    assert!(miss < f.error && other < f.error, "{kr} {x} {miss:e} {other:e} {f:?}");
                    // a radius has absolute accuracy only: the estimate grows towards the pole
                    assert!(f.error < 2e-9 * normal + 2e-16 / ring.u, "{kr} {x} {f:?}");
                }
            }
        }
    }
}

/// A small sphere at the top, a frustum, a large sphere at the bottom: tangent continuous, two jumps of curvature, no symmetry.
fn pear(n: usize) -> Shape {
    // both spheres end where the normal has this angle from the axis
    let (small, joint, length) = (0.6, 1.2_f64, 0.9);
    let (s, c) = joint.sin_cos();
    let (u, z) = (small * s, small * c);
    let large = (u + length * c) / s;
    let centre = z - length * s - large * c;
    let bottom = spheroid(large, large, 1).0;
    let lower = move |p: f64| {
        let r = bottom(p);
        [r[0], centre + r[1], r[2], r[3]]
    };
    Shape {
        pieces: vec![
            (spheroid(small, small, 1).0, [0.0, joint], breaks(n)),
            (Box::new(move |t| [u + t * c, z - t * s, c, -s]), [0.0, length], breaks(n)),
            (Box::new(lower), [joint, PI], breaks(n)),
        ],
        charge: Box::new(uniform),
    }
}

#[test]
fn joints_are_tangent() {
    for shape in [pear(3), disc(2)] {
        for piece in 1..3 {
            let (a, b) = (shape.at(piece - 1, 1.0), shape.at(piece, 0.0));
            let (g, h) = (a.du.hypot(a.dz), b.du.hypot(b.dz));
            assert!((a.u - b.u).hypot(a.z - b.z) < 1e-15);
            assert!((a.du / g - b.du / h).hypot(a.dz / g - b.dz / h) < 1e-14 && (g / h - 1.0).abs() > 0.1);
        }
    }
}

/// Panels of [from, to] graded towards `from`, the first of length `first`.
fn graded(from: f64, to: f64, first: f64) -> Vec<[f64; 2]> {
    let (mut panels, mut at, mut step) = (Vec::new(), from, first);
    while (to - at) * (to - from) > 0.0 {
        let end = if 1.5 * step < (to - at).abs() { at + step * (to - from).signum() } else { to };
        panels.push([at, end]);
        (at, step) = (end, step.max((end - from).abs()));
    }
    panels
}

/// Gauss sum over panels.
fn sum<const N: usize>(panels: &[[f64; 2]], mut f: impl FnMut(f64) -> [f64; N]) -> [f64; N] {
    let rule = &rules::RULES.plain[2];
    let mut total = [0.0; N];
    for [a, b] in panels {
        for (x, w) in rule.x.iter().zip(&rule.w) {
            let value = f(a + (b - a) * x);
            for c in 0..N {
                total[c] += w * (b - a).abs() * value[c];
            }
        }
    }
    total
}

/// Radial and axial field and potential at (`u`, `z`) by brute force, from panels of the pieces and of the angle.
fn brute(shape: &Shape, k: f64, [u, z]: [f64; 2], panels: &[(usize, Vec<[f64; 2]>)], smallest: f64) -> [f64; 3] {
    let turn = graded(0.0, PI, smallest);
    let mut total = [0.0; 3];
    for (piece, panels) in panels {
        let part = sum(panels, |x| {
            let r = shape.at(*piece, x);
            sum(&turn, |theta| {
                let half = (0.5 * theta).sin();
                let l = ((u - r.u).powi(2) + (z - r.z).powi(2) + 4.0 * u * r.u * half * half).sqrt();
                let force = 2.0 * r.charge * (1.0 + k * l) * (-k * l).exp() / (l * l * l);
                let across = u - r.u + 2.0 * r.u * half * half;
                [force * across, force * (z - r.z), 2.0 * r.charge * (-k * l).exp() / l]
            })
        });
        for c in 0..3 {
            total[c] += part[c];
        }
    }
    total
}

#[test]
fn points_off_the_surface_agree_with_brute_force() {
    let (shape, k) = (pear(4), 100.0);
    for (piece, x) in [(0, 0.3), (1, 0.02), (2, 0.5)] {
        let r = shape.at(piece, x);
        let g = r.du.hypot(r.dz);
        for distance in [0.002, -0.002, 0.05] {
            let (u, z) = (r.u - distance * r.dz / g, r.z + distance * r.du / g);
            let mut panels = vec![(piece, graded(x, 1.0, 3e-4)), (piece, graded(x, 0.0, 3e-4))];
            panels.extend((0..3).filter(|p| *p != piece).map(|p| {
                let (from, to) = if p < piece { (1.0, 0.0) } else { (0.0, 1.0) };
                (p, graded(from, to, 1e-2))
            }));
            let exact = brute(&shape, k, [u, z], &panels, 1e-3);
            let f = near(&Sheet::new(&shape), k, u, z);
            let miss = (f.radial - exact[0]).hypot(f.axial - exact[1]);
            println!("{piece} {distance}: {miss:.1e} {:.1e}", f.error);
            assert!(miss < 1e-10 && (f.potential - exact[2]).abs() * k < 1e-10, "{f:?} {exact:?}");
            assert!(miss < f.error + 1e-13 && f.error < 1e-9, "{miss:e} {f:?}");
        }
    }
}

/// Spheres: inside and outside, at all distances, also near the axis.
#[test]
fn points_off_a_sphere_have_the_closed_form() {
    let r = 1.2;
    for k in [1.0, 30.0, 1000.0] {
        let shape = sphere(r, 20);
        for distance in [1e-4_f64, -1e-4, 1e-3, -0.01, 0.3] {
            let a: f64 = r + distance;
            for angle in [0.0, 1e-6, 0.02, 1.3] {
                let f = near(&Sheet::new(&shape), k, a * f64::sin(angle), a * f64::cos(angle));
                // Phi = 4 pi sigma r sinh(k min) exp(-k max)/(k a), without overflow
                let (low, high) = (r.min(a), r.max(a));
                let factor = 2.0 * PI * r / (k * a);
                let (plus, minus) = ((k * (low - high)).exp(), (-k * (low + high)).exp());
                let potential = factor * (plus - minus);
                let slope = if a > r { -k * (plus - minus) } else { k * (plus + minus) };
                let normal = potential / a - factor * slope;
                let miss = (f.radial - normal * angle.sin()).hypot(f.axial - normal * angle.cos());
                println!("{k} {distance} {angle}: {miss:.1e} {:.1e} {:.1e}", (f.potential - potential) * k, f.error);
                assert!(miss < 1e-10 && (f.potential - potential).abs() * k < 1e-10, "{k} {distance} {angle} {miss:e}");
                assert!(miss <= f.error && f.error < 1e-9, "{k} {distance} {angle} {miss:e} {f:?}");
            }
        }
    }
}

#[test]
fn joints_need_the_gap_symmetric_in_arc_length() {
    let (shape, k, gap) = (disc(1), 100.0, 1e-8);
    let most = largest(&shape, k);
    let (left, right) = (on_surface(&Sheet::new(&shape), k, 0, 1.0), on_surface(&Sheet::new(&shape), k, 1, 0.0));
    assert!((left.radial - right.radial).hypot(left.axial - right.axial) < 1e-10 * most);
    let r = shape.at(0, 1.0);
    let speeds = [0, 1].map(|p| {
        let r = shape.at(p, 1.0 - p as f64);
        r.du.hypot(r.dz)
    });
    let by_brute = |gaps: [f64; 2]| {
        let panels =
            [(0, graded(1.0 - gaps[0], 0.0, gaps[0])), (1, graded(gaps[1], 1.0, gaps[1])), (2, graded(0.0, 1.0, 0.1))];
        let e = brute(&shape, k, [r.u, r.z], &panels, 0.3 * gap);
        (e[0] - left.radial).hypot(e[1] - left.axial) / most
    };
    let (paired, unpaired) = (by_brute([gap / speeds[0], gap / speeds[1]]), by_brute([gap, gap]));
    println!("{paired:e} {unpaired:e}");
    assert!(paired < 1e-5 && unpaired > 0.05);
    // next to the joint the field is continuous, but for s ln s times the jump of curvature
    for away in [1e-14, 1e-12, 1e-10] {
        for f in [on_surface(&Sheet::new(&shape), k, 0, 1.0 - away), on_surface(&Sheet::new(&shape), k, 1, away)] {
            let change = (f.radial - left.radial).hypot(f.axial - left.axial) / most;
            println!("{away:e} {change:e} {:e}", f.error / most);
            assert!(change < 1e-9 + 5e3 * away);
            assert!(f.error < 1e-9 * most);
        }
    }
}

#[test]
fn a_surface_does_not_push_itself() {
    let shape = pear(5);
    for k in [1.0, 10.0, 100.0] {
        let mut total = [0.0; 2];
        for piece in 0..3 {
            let mut panels = graded(0.0, 0.5, 1e-5);
            panels.extend(graded(1.0, 0.5, 1e-5));
            let part = sum(&panels, |x| {
                let push = shape.at(piece, x).charge * on_surface(&Sheet::new(&shape), k, piece, x).axial;
                [push, push.abs()]
            });
            total = [total[0] + part[0], total[1] + part[1]];
        }
        println!("{k}: {:.1e}", total[0] / total[1]);
        assert!(total[0].abs() < 1e-9 * total[1], "{k} {total:?}");
    }
}
