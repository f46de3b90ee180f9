//! Features of the meridian that are small against 1/k, poles, faint charges, and curves that are none.
//!
//! The numbers are of independent origin: 80-bit arithmetic, the sources left and right of the target added in pairs of equal arc
//! length, Gauss sums over panels that halve towards the target and over panels of the angle.

use super::*;

/// Flat discs of radius `a` at both poles of a torus of minor radius 1.
fn flattened(a: f64, n: usize) -> Shape {
    Shape {
        pieces: vec![
            (Box::new(move |t| [t, 1.0, 1.0, 0.0]), [0.0, a], breaks(n)),
            (Box::new(move |t| [a + t.sin(), t.cos(), t.cos(), -t.sin()]), [0.0, PI], breaks(2 * n)),
            (Box::new(move |t| [a - t, -1.0, -1.0, 0.0]), [0.0, a], breaks(n)),
        ],
        charge: Box::new(uniform),
    }
}

/// Checks the field (radial, axial, potential) at the parameter `t` of a piece.
fn check(shape: &Shape, k: f64, (piece, t): (usize, f64), exact: [f64; 3]) {
    let f = on_surface(&Sheet::new(shape), k, piece, t / shape.pieces[piece].1[1]);
    let most = largest(shape, k);
    let miss = (f.radial - exact[0]).hypot(f.axial - exact[1]);
    println!("{k} {piece} {t}: {:.1e} {:.1e} {:.1e}", miss / most, f.potential - exact[2], f.error / most);
    assert!(miss < 1e-10 * most && (f.potential - exact[2]).abs() < 1e-13 * exact[2] * (1.0 + 100.0 / k), "{f:?}");
    assert!(miss < f.error && f.error < 1e-9 * most, "{miss:e} {f:?}");
}

#[test]
fn first_contacts_are_smaller_than_the_screening_length() {
    // radius of the disc, k, piece, parameter, field
    let cases = [
        (0.01, 10.0, (0, 0.001), [0.000375488134818035, 0.454761242074359, 0.62858232885566]),
        (0.01, 10.0, (0, 0.0019), [0.000714097289279368, 0.455306069383876, 0.62858183861384]),
        (0.01, 10.0, (0, 0.00999), [0.00390743105944081, 0.483346008786323, 0.628563417926099]),
        (0.01, 10.0, (1, 0.00001), [0.00391608517097926, 0.483699646878839, 0.628563339715138]),
        (0.0005, 10.0, (1, 0.001), [0.000906833105874635, 0.615706763000943, 0.628333834777461]),
        (0.3, 10.0, (1, 1.0), [0.459197577695765, 0.294791517841471, 0.628369766519738]),
        (0.002, 100.0, (0, 0.0001), [2.56672728948804e-6, 0.0360881926594513, 0.0628322952560464]),
        (0.00015, 100.0, (1, 0.00004), [1.07309509215715e-5, 0.0592309361234128, 0.0628318978722003]),
    ];
    for (a, k, place, exact) in cases {
        for n in [1, 6] {
            check(&flattened(a, n), k, place, exact);
        }
    }
}

#[test]
fn sharp_ends_and_edges_agree_with_independent_values() {
    let shape = |a: f64, b: f64| Shape {
        pieces: vec![spheroid(a, b, 12)],
        charge: Box::new(|phi: f64, p: [f64; 4]| (1.0 + 0.3 * phi.cos()) * uniform(phi, p)),
    };
    // the radius of curvature at the pole is 0.3, at the edge 0.002
    check(&shape(0.7, 1.6), 1.0, (0, 0.02), [0.306687276175144, 9.23156216031222, 5.43040736062828]);
    check(&shape(1.2, 0.05), 1.0, (0, 1.5), [18.6664723211202, 3.64983424980183, 4.55392976402128]);
}

#[test]
fn points_next_to_a_pole_have_the_closed_form() {
    let (r, k) = (1.2, 100.0);
    let shape = sphere(r, 20);
    for distance in [1e-4_f64, 1e-5, 1e-6, 1e-8] {
        let a = r + distance;
        let normal = 2.0 * PI * r / (k * a) * (1.0 / a + k) * (-k * distance).exp();
        for u in [0.0, 1e-16, 1e-12, 1e-6] {
            for z in [(a * a - u * u).sqrt(), -(a * a - u * u).sqrt()] {
                let f = near(&Sheet::new(&shape), k, u, z);
                let miss = (f.radial - normal * u / a).hypot(f.axial - normal * z / a);
                println!("{distance} {u} {z}: {miss:.1e} {:.1e}", f.error);
                // the distance itself is rounded
                assert!(miss < 1e-10 + 1e-15 / distance && miss < f.error, "{distance} {u} {z} {miss:e} {f:?}");
                assert!(f.error < 1e-10 + 2e-14 / distance, "{distance} {u} {z} {f:?}");
            }
        }
    }
}

/// A surface whose lower half has no charge.
#[test]
fn places_without_charge_feel_the_others() {
    let half = |phi: f64, p: [f64; 4]| phi.cos().max(0.0).powi(3) * uniform(phi, p);
    let shape = Shape { pieces: vec![spheroid(1.0, 1.0, 16)], charge: Box::new(half) };
    for k in [1.0, 10.0] {
        for x in [0.51, 0.6, 0.9, 1.0] {
            let (f, ring) = (on_surface(&Sheet::new(&shape), k, 0, x), shape.at(0, x));
            let beside = near(&Sheet::new(&shape), k, ring.u * (1.0 + 1e-9), ring.z * (1.0 + 1e-9));
            let change = (f.radial - beside.radial).hypot(f.axial - beside.axial);
            println!("{k} {x}: {change:.1e} {:.1e} {f:?}", f.error);
            assert!(change < 1e-7 && f.error < 1e-10 && f.axial < 0.0);
        }
    }
}

#[test]
fn what_is_not_a_number_ends() {
    let broken = |t: f64| [t.sin(), if t > 1.0 { f64::NAN } else { t.cos() }, t.cos(), -t.sin()];
    let shape = Shape { pieces: vec![(Box::new(broken), [0.0, PI], breaks(5))], charge: Box::new(uniform) };
    for x in [0.0, 0.1, 0.8] {
        assert!(!(on_surface(&Sheet::new(&shape), 10.0, 0, x).error < 1.0));
    }
    assert!(!(near(&Sheet::new(&shape), 10.0, 0.5, 2.0).error < 1.0));
}

/// Time per target; prints only.
#[test]
#[ignore = "a measurement"]
fn time_per_target() {
    for k in [10.0, 100.0, 1000.0, 3000.0] {
        for (name, shape) in [("sphere", sphere(1.2, 20)), ("disc", disc(20)), ("pear", pear(20))] {
            let (pieces, points) = (shape.pieces(), 200 / shape.pieces());
            let sheet = Sheet::new(&shape);
            let start = std::time::Instant::now();
            let mut error = 0.0_f64;
            for piece in 0..pieces {
                for i in 0..points {
                    error = error.max(on_surface(&sheet, k, piece, (i as f64 + 0.5) / points as f64).error);
                }
            }
            let time = start.elapsed().as_secs_f64() / (pieces * points) as f64;
            println!("{name}, k = {k}: {:.0} us, error below {error:.1e}", 1e6 * time);
        }
    }
}
