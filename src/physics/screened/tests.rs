//! Tests: closed forms, independent values, balance of forces, brute force, and a rule that must fail.

use std::f64::consts::PI;

use serde_json::Value;

use super::*;

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
            let f = on_surface(shape, k, piece, (i as f64 + 0.5) / 20.0);
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
            let f = on_surface(shape, k, piece, x);
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
                    let f = on_surface(&shape, k, 0, x);
                    let ring = shape.at(0, x);
                    let miss = (f.radial - normal * ring.u / r).hypot(f.axial - normal * ring.z / r);
                    let other = (f.potential - potential).abs() * k;
                    println!("{r} {n} {kr} {x}: {:.1e} {:.1e} {:.1e}", miss / normal, other, f.error / normal);
                    assert!(miss < 1e-9 * normal && other < 1e-9, "{kr} {x} {miss:e}");
                    assert!(miss < f.error && other < f.error, "{kr} {x} {miss:e} {other:e} {f:?}");
                    // a radius has absolute accuracy only: the estimate grows towards the pole
                    assert!(f.error < 1e-9 * normal + 2e-16 / ring.u, "{kr} {x} {f:?}");
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
