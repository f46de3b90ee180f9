//! Numbers read off fields: integrals, largest and smallest values, values at a material point.

mod common;

use common::{measured, parse, resolve, run, with};
use membrane::run::{Outcome, Status};
use membrane::spec::{Document, Syntax};
use serde_json::Value;

fn file(name: &str, outputs: &str) -> Document {
    let text = std::fs::read_to_string(format!("problems/{name}.ron")).unwrap();
    let text = text.replacen("outputs: {", &format!("outputs: {{ {outputs} "), 1);
    with(&parse(name, text, Syntax::Ron), &[("expect", "[]")])
}

fn state(document: &Document, at: (&str, f64)) -> (membrane::model::Model, Outcome) {
    let model = resolve(document);
    let outcome = run(&model, Some(at));
    assert_eq!(outcome.status, Status::Complete, "{at:?}");
    (model, outcome)
}

/// Stretches and the radius at phi = 1.2, between two beads.
#[test]
fn values_at_a_place_against_independent_ones() {
    let outputs = r#""lambda_there": "membrane.value(lambda, phi = 1.2)", "mu_there": "side.value(mu, phi = 1.2)",
        "u_there": "membrane.value(u, phi = 1.2)", "elsewhere": "membrane.value(u, phi = 1.201)","#;
    let document = file("two_beads", outputs);
    let data: Value =
        serde_json::from_str(&std::fs::read_to_string("tests/data/reference/other_contacts.json").unwrap()).unwrap();
    let mut seen = 0;
    for case in data["cases"].as_array().unwrap().iter().filter(|c| c["group"] == "G8") {
        let (model, outcome) = state(&document, ("d", case["inputs"]["d"].as_f64().unwrap()));
        for (ours, theirs) in [("lambda_there", "lambda_phi12"), ("mu_there", "mu_phi12"), ("u_there", "u_phi12")] {
            let (value, error) = measured(&model, &outcome, 0, ours).unwrap();
            let expected = case["results"][theirs].as_f64().unwrap();
            let miss = (value - expected).abs();
            assert!(miss <= error + 1e-12 * expected, "{ours} = {value}, expected {expected}, claimed {error:.1e}");
            assert!(error < 1e-9 * expected, "{ours} claims {error:.1e}");
        }
        let (value, _) = measured(&model, &outcome, 0, "elsewhere").unwrap();
        assert!((value - case["results"]["u_phi12"].as_f64().unwrap()).abs() > 1e-6, "a thousandth further is another");
        seen += 1;
    }
    assert_eq!(seen, 3);
}

/// Integrals of what is summed anyway, and extremes of what the profile shows.
#[test]
fn integrals_and_extremes_are_those_of_the_membrane() {
    let outputs = r#""summed": "membrane.integral(w)", "areas": "membrane.integral(lambda*mu)", "on_side": "side.integral(1)",
        "largest": "membrane.max(w_m/lambda)", "least": "membrane.min(w_m)", "steepest": "side.max(tau)",
        "pressed": "support.max(p_c)", "widest": "side.max(u)", "area": "membrane.area", "side_area": "side.reference_area","#;
    let (model, outcome) = state(&file("bead_on_flat", outputs), ("gap", 1.5));
    let of = |name: &str| measured(&model, &outcome, 0, name).unwrap();
    for (a, b) in [("summed", "energy"), ("areas", "area"), ("on_side", "side_area")] {
        let (x, y) = (of(a), of(b));
        assert!((x.0 - y.0).abs() <= x.1 + y.1 + 1e-13 * y.0, "{a}: {x:?}, {b}: {y:?}");
        assert!(x.1 < 1e-9 * x.0, "{a} claims {:.1e}", x.1);
    }
    let rows = membrane::solution::profile(&model, &outcome.points[0].solution);
    let over = |f: &dyn Fn(&membrane::solution::Row) -> f64| rows.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
    for (name, seen) in [
        ("largest", over(&|r| r.w_m / r.lambda)),
        ("least", -over(&|r| -r.w_m)),
        ("steepest", over(&|r| if r.segment == "side" { r.tau } else { 0.0 })),
        ("pressed", over(&|r| if r.segment == "support" { r.p_c.unwrap_or(0.0) } else { 0.0 })),
        ("widest", over(&|r| if r.segment == "side" { r.u } else { 0.0 })),
    ] {
        let (value, error) = of(name);
        let sign = if name == "least" { -1.0 } else { 1.0 };
        // The mesh may miss the top, by little; nothing lies beyond it.
        let beyond = sign * (value - seen);
        assert!(beyond >= -error - 1e-12, "{name}: {value} {seen}");
        assert!(beyond < 1e-2 * value.abs(), "{name}: {value} {seen}");
    }
    // Finer runs agree within the claims.
    let finer = with(&file("bead_on_flat", outputs), &[("accuracy", "1e-11")]);
    let (fine_model, fine) = state(&finer, ("gap", 1.5));
    for name in ["summed", "largest", "least", "widest", "pressed"] {
        let ((a, claimed), (b, _)) = (of(name), measured(&fine_model, &fine, 0, name).unwrap());
        assert!((a - b).abs() <= claimed + 1e-12 * b.abs(), "{name}: {a} {b}, claimed {claimed:.1e}");
    }
}

/// Under a sharp cone the tension has no largest value: it is named, not printed.
#[test]
fn what_grows_without_bound_has_no_largest_value() {
    let (model, outcome) =
        state(&file("cone_on_flat", r#""largest": "membrane.max(w_l)", "least": "membrane.min(w_l)","#), ("dbar", 0.5));
    assert!(measured(&model, &outcome, 0, "largest").is_none());
    assert!(outcome.points[0].solution.infinite.contains(&"largest".to_owned()));
    assert!(measured(&model, &outcome, 0, "least").is_some());
}

#[test]
fn wrong_readings_are_refused_at_their_place() {
    for (formula, code) in [
        ("membrane.maximum(u)", "unknown-name"),
        ("belt.max(u)", "unknown-name"),
        ("membrane.max(u, mu)", "arguments"),
        ("membrane.value(u)", "arguments"),
        ("membrane.max(force*u)", "not-local"),
        ("membrane.max(nothing)", "unknown-name"),
    ] {
        let document = file("bead_on_flat", &format!("\"wrong\": \"{formula}\","));
        let refused = membrane::model::resolve(&document.problem).unwrap_err();
        assert!(refused.diagnostics.iter().any(|d| d.code == code), "{formula}: {:?}", refused.diagnostics);
    }
}
