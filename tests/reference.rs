//! The shipped problems against values of independent origin (`tests/data/reference`, see the README there), and the honesty of the
//! estimated errors: a true error lies below its estimate, and the estimate is of use.

use membrane::run::{Request, Status};
use membrane::spec::{Document, Source, Syntax};
use membrane::{model, run};
use serde_json::Value;

/// Digits of the reference values of a case, as a relative error.
fn solve(file: &str, set: &[(&str, String)], at: (&str, f64)) -> Vec<(String, f64, f64)> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut document = Document::read(Source { name: file.into(), text, syntax: Syntax::Ron }).unwrap();
    for (key, value) in set {
        document = model::set(&document, key, value).unwrap_or_else(|e| panic!("{key}={value}: {:?}", e.1));
    }
    let model = model::resolve(&document.problem).unwrap();
    let outcome =
        run::run(
            &model,
            &[Request { name: at.0.into(), value: at.1 }],
            &mut |_, _| std::ops::ControlFlow::Continue(()),
        );
    assert_eq!(outcome.status, Status::Complete, "{file} {set:?} {at:?}");
    let solution = &outcome.points[0].solution;
    model
        .quantities
        .iter()
        .zip(&solution.quantities)
        .filter_map(|(q, m)| m.map(|m| (q.name.clone(), m.value, m.error)))
        .collect()
}

/// Compares one number; the reference is known to `digits`, relative.
fn compare(case: &str, name: &str, found: &[(String, f64, f64)], expected: f64, tolerance: f64, digits: f64) -> f64 {
    let (_, value, error) = found.iter().find(|f| f.0 == name).unwrap_or_else(|| panic!("{case}: no {name}"));
    let miss = (value - expected).abs();
    let relative = miss / expected.abs();
    let doubt = digits * expected.abs();
    println!(
        "{case:40} {name:16} {value:20.14} miss {relative:8.1e} error {:8.1e} ratio {:8.2}",
        error / value.abs(),
        error / miss
    );
    assert!(relative <= tolerance, "{case}: {name} = {value}, expected {expected}: misses by {relative:.1e}");
    assert!(miss <= error + doubt, "{case}: {name} misses by {miss:.1e}, but claims {error:.1e}");
    let useful = (100.0 * (miss + doubt)).max(1e-10 * expected.abs());
    assert!(*error <= useful, "{case}: {name} claims {error:.1e} and misses by {miss:.1e} only");
    relative
}

fn number(v: &Value) -> f64 {
    v.as_f64().or_else(|| v.as_str().and_then(|s| s.parse().ok())).unwrap()
}

#[test]
fn indentation() {
    let data: Value = serde_json::from_str(include_str!("data/reference/indentation.json")).unwrap();
    let cases = data["cases"].as_array().unwrap();
    assert!(cases.len() >= 29);
    for case in cases {
        let id = case["id"].as_str().unwrap();
        let p: Vec<f64> = case["params"].as_array().unwrap().iter().map(number).collect();
        let material = match case["material"].as_str().unwrap() {
            "neo-hookean" => format!("NeoHookean(shear_modulus: {})", p[0]),
            "mooney-rivlin" => format!("MooneyRivlin(c1: {}, c2: {})", p[0], p[1]),
            "skalak" => format!("Skalak(shear_modulus: {}, area_ratio: {})", p[0], p[1]),
            "gent" => format!("Gent(shear_modulus: {}, locking: {})", p[0], p[1]),
            other => panic!("{other}"),
        };
        let two = case["problem"] == "P3";
        let r0 = number(&case["r0"]);
        let (file, dbar) = if two {
            ("problems/two_cones.ron", 1.0 - number(&case["gap"]) / r0)
        } else {
            ("problems/cone_on_flat.ron", number(&case["gap"]) / (2.0 * r0))
        };
        let set = [("r0", format!("{r0}")), ("cone_angle", format!("{}", case["alpha_deg"])), ("material", material)];
        let found = solve(file, &set, ("dbar", dbar));
        // Twelve digits are printed; the reference states its own error.
        let digits = number(&case["check_variation_rel"]).max(5e-12);
        let tolerance = if r0 < 1.1 { 1e-8 } else { 1e-9 };
        let mut names = vec![("p_f", "p_f"), ("force", "force"), ("energy", "energy"), ("u_max", "u_max")];
        if two {
            names.extend([("phi_c", "phi_c1"), ("u_c", "u_c1")]);
        } else {
            names.extend([("phi_c1", "phi_c1"), ("u_c1", "u_c1"), ("phi_c2", "phi_c2"), ("u_c2", "u_c2")]);
        }
        if case.get("tip_coefficient_C").is_some_and(|v| v.is_number()) {
            names.push(("tip_coefficient", "tip_coefficient_C"));
        }
        for (ours, theirs) in names {
            if case[theirs].is_null() {
                continue;
            }
            compare(id, ours, &found, number(&case[theirs]), tolerance, digits);
        }
    }
}

#[test]
fn flat_plates() {
    let data: Value = serde_json::from_str(include_str!("data/reference/flat_plates.json")).unwrap();
    let steps = data["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 50);
    for step in steps {
        let hbar = number(&step["hbar"]);
        let found = solve("problems/flat_plates.ron", &[], ("hbar", hbar));
        for (ours, theirs) in [("p_f", "p"), ("force", "F"), ("phi_c", "phi_c"), ("u_c", "u_c"), ("u_max", "u_e")] {
            compare(&format!("hbar {hbar}"), ours, &found, number(&step[theirs]), 1e-10, 2e-14);
        }
    }
}
