//! Claimed errors are honest and useful, at states that no reference prints: what a run to 1e-7 claims is compared with
//! how far it is from a run to 1e-11 of the same state.
//!
//! Honest: no number is further from the truth than it claims. Useful: no claim is above 100 times the true error, or 1e-10
//! relative where that is larger.

mod common;

use common::{measured, parse, read, resolve, run, with};
use membrane::run::{Reason, Status};
use membrane::spec::Syntax;
use std::f64::consts::PI;

struct Case {
    file: &'static str,
    settings: Vec<(String, String)>,
    at: (&'static str, f64),
}

/// What is wrong with the claims at a state.
fn judge(case: &Case) -> Vec<String> {
    let document = with(&read(case.file), &case.settings);
    let place = format!("{} {:?} {:?}", case.file, case.settings, case.at);
    let solve = |accuracy: &str| {
        let model = resolve(&with(&document, &[("accuracy", accuracy)]));
        let outcome = run(&model, Some(case.at));
        (model, outcome)
    };
    let (model, coarse) = solve("1e-7");
    let (_, fine) = solve("1e-11");
    if coarse.status != Status::Complete {
        return vec![format!("{place}: at 1e-7 {:?}", coarse.status)];
    }
    let Some(truth) = fine.points.first() else { return vec![format!("{place}: at 1e-11 {:?}", fine.status)] };
    let found = &coarse.points[0].solution;
    let mut wrong = vec![];
    for ((q, a), b) in model.quantities.iter().zip(&found.quantities).zip(&truth.solution.quantities) {
        let (Some(a), Some(b)) = (a, b) else {
            assert_eq!(a.is_some(), b.is_some(), "{place}: {}", q.name);
            continue;
        };
        let miss = (a.value - b.value).abs();
        if miss > a.error + b.error {
            wrong.push(format!("{place}: {} = {:e} claims {:.1e}, misses by {miss:.1e}", q.name, b.value, a.error));
        }
        let useful = (100.0 * (miss + b.error)).max(1e-10 * b.value.abs());
        if a.error > useful {
            wrong.push(format!(
                "{place}: {} = {:e} claims {:.1e} and misses by {miss:.1e} only",
                q.name, b.value, a.error
            ));
        }
    }
    wrong
}

fn all(cases: impl Iterator<Item = Case>) {
    let begun = std::time::Instant::now();
    let (mut count, mut wrong) = (0, vec![]);
    for case in cases {
        count += 1;
        wrong.extend(judge(&case));
    }
    println!("{count} states, {:.1?}", begun.elapsed());
    assert!(wrong.is_empty(), "{} wrong claims:\n{}", wrong.len(), wrong.join("\n"));
}

fn law(material: &'static str) -> impl Iterator<Item = Case> {
    let mut cases = vec![];
    for angle in [0, 5, 25, 45, 65, 85] {
        for r0 in [1.03, 1.2, 2.0, 3.0] {
            for (depth, deep) in [(0.002, false), (0.4, false), (0.95, true)] {
                // A membrane that locks cannot be pressed this flat.
                if deep && r0 > 1.5 && angle < 25 && material.starts_with("Gent") {
                    continue;
                }
                for (file, dbar) in [("problems/cone_on_flat.ron", 1.0 - depth), ("problems/two_cones.ron", depth)] {
                    let settings =
                        [("cone_angle", angle.to_string()), ("r0", r0.to_string()), ("material", material.into())];
                    let settings = settings.map(|(key, value)| (key.to_owned(), value)).into();
                    cases.push(Case { file, settings, at: ("dbar", dbar) });
                }
            }
        }
    }
    cases.into_iter()
}

/// The initial sphere below a narrow pipette: what is summed along it is known in closed form, and no further off than it claims.
#[test]
fn the_initial_state() {
    let text = r#"(
        format: 1, title: "Below a pipette",
        parameters: { "rho": 0.5 }, unknowns: { "dP": 0 },
        reference: Sphere(radius: 1), material: NeoHookean(shear_modulus: 1),
        initial: Inflated(radius: 1.3), fluid: Incompressible,
        bodies: { "pipette": (shape: Pipette(radius: "rho"), facing: Down, h: 0) },
        meridian: [Pole, Free(name: "cap", outside_pressure: "-dP"), Kink(at: "pipette.mouth"), Free(name: "rest"), Pole],
        branch: (control: "dP", to: 0.01, steps: 1),
        outputs: { "height": "membrane.height", "area": "membrane.area", "volume": "membrane.volume" },
    )"#;
    let r = 1.3_f64;
    let truth = [("height", 2.0 * r), ("area", 4.0 * PI * r * r), ("volume", 4.0 / 3.0 * PI * r.powi(3))];
    for rho in ["0.5", "0.1"] {
        let model = resolve(&with(&parse("a test", text.into(), Syntax::Ron), &[("rho", rho)]));
        let outcome = run(&model, None);
        assert_eq!(outcome.points[0].reason, Reason::Start);
        for (name, value) in truth {
            let (found, error) = measured(&model, &outcome, 0, name).expect("a number");
            assert!((found - value).abs() <= error, "{rho} {name}: {found} {value} {error:e}");
            assert!(error < 1e-11 * value, "{rho} {name}: {error:e}");
        }
    }
}

/// An edge that is stuck at a material point of its own holds another state than the initial sphere from the start.
#[test]
fn the_state_that_a_condition_holds_at_the_start() {
    let text = r#"(
        format: 1, title: "Below a pipette",
        parameters: { "place": 0.4 }, unknowns: { "dP": 0 },
        reference: Sphere(radius: 1), material: NeoHookean(shear_modulus: 1),
        initial: Inflated(radius: 1.3), fluid: Incompressible,
        bodies: { "pipette": (shape: Pipette(radius: 0.5), facing: Down, h: 0) },
        meridian: [
            Pole, Free(name: "cap", outside_pressure: "-dP"), Kink(at: "pipette.mouth", law: StuckAt("phi = place")),
            Free(name: "rest"), Pole,
        ],
        branch: (control: "dP", to: 0.01, steps: 1),
        outputs: { "held": "pipette.mouth.phi", "rise": "p_f - initial.p_f" },
    )"#;
    let first = (0.5_f64 / 1.3).asin();
    for (place, moves) in [(0.4, true), (first, false)] {
        let settings = [("place", format!("{place:e}"))];
        let model = resolve(&with(&parse("a test", text.into(), Syntax::Ron), &settings));
        let outcome = run(&model, None);
        assert_eq!(outcome.points[0].reason, Reason::Start);
        let value = |name| measured(&model, &outcome, 0, name).expect("a number").0;
        assert!((value("held") - place).abs() < 1e-12, "{} {place}", value("held"));
        assert_eq!(value("rise").abs() > 1e-4, moves, "{}", value("rise"));
    }
}

#[test]
fn neo_hookean() {
    all(law("NeoHookean(shear_modulus: 1)"));
}

#[test]
fn mooney_rivlin() {
    all(law("MooneyRivlin(c1: 0.5, c2: 0.05)"));
}

#[test]
fn skalak() {
    all(law("Skalak(shear_modulus: 1, area_ratio: 1)"));
}

#[test]
fn gent() {
    all(law("Gent(shear_modulus: 1, locking: 30)"));
}

#[test]
fn ogden() {
    all(law("Ogden([(0.8, 1.7), (0.2, -1.4)])"));
}

#[test]
fn hooke() {
    all(law("Hooke(young_modulus: 3, poisson_ratio: 0.3)"));
}

#[test]
fn an_energy_of_the_file() {
    all(law("Energy(\"cosh(lambda - 1) + cosh(mu - 1) + (lambda*mu - 1)^2\")"));
}
