//! The adhesive edge: against independent values, as the limit of forces of short range, and against its own energy.

mod common;

use common::{parse, resolve, run, with};
use membrane::run::Status;
use membrane::solution::Certificate;
use membrane::spec::Syntax;

/// The shipped files.
const EDGE: &str = include_str!("../problems/adhesion_short_range.ron");
const FORCES: &str = include_str!("../problems/electrostatic.ron");

/// One state of a problem: name -> (value, error), and what proves it.
fn solve(text: &str, set: &[(&str, String)], at: (&str, f64)) -> (impl Fn(&str) -> (f64, f64) + use<>, Certificate) {
    let settings: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    let model = resolve(&with(&parse("a file of this test", text.to_owned(), Syntax::Ron), &settings));
    let outcome = run(&model, Some(at));
    assert_eq!(outcome.status, Status::Complete, "{set:?} {at:?}");
    let solution = outcome.points[0].solution.clone();
    let certificate = solution.certificate.clone();
    let measured = move |name: &str| {
        let q = model.quantities.iter().position(|q| q.name == name).unwrap_or_else(|| panic!("no {name}"));
        let m = solution.quantities[q].unwrap();
        (m.value, m.error)
    };
    (measured, certificate)
}

#[test]
fn the_edge_against_independent_values() {
    let text = std::fs::read_to_string("tests/data/reference/electrostatic.json").unwrap();
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    let rows = data["short_range_limit"]["rows"].as_array().unwrap();
    assert!(rows.len() >= 2);
    for row in rows {
        let w = row["W0"].as_f64().unwrap();
        let (state, proof) = solve(EDGE, &[], ("W", w));
        assert!(proof.is_admissible() && proof.virtual_work < 1e-7, "{proof:?}");
        // The last digit printed of each.
        for (ours, theirs, digits) in [
            ("a", "a", 1e-12),
            ("p_f", "p_f", 1e-11),
            ("contact_angle", "theta", 1e-9),
            ("lam_minus", "lam_minus", 1e-10),
            ("lam_plus", "lam_plus", 1e-10),
            ("lam_top", "lam_top", 1e-11),
            ("lam_bottom", "lam_bottom", 1e-12),
        ] {
            let (value, error) = state(ours);
            let expected = row[theirs].as_f64().unwrap();
            let miss = (value - expected).abs();
            assert!(miss <= error + digits, "{ours} = {value} at W = {w}, expected {expected}");
            assert!(error <= 1e-9 * value.abs(), "{ours} claims {error:.1e}");
        }
        let phi = state("phi_c").0 / std::f64::consts::PI;
        assert!((phi - row["phi_c_over_pi"].as_f64().unwrap()).abs() < 2e-12);
        // Another energy is another state.
        let (other, _) = solve(EDGE, &[], ("W", 1.001 * w));
        assert!((other("a").0 / state("a").0 - 1.0).abs() > 1e-4);
    }
}

/// Forces of a range 1/k at a fixed energy tend to the edge, by half the distance for twice the k.
#[test]
fn forces_of_short_range_tend_to_the_edge() {
    let (w, c) = (0.3, 0.05);
    let limit = solve(EDGE, &[], ("W", w)).0;
    let only =
        "{ \"attraction\": ChargedPlane(h: 0, charge_ratio: \"sigma_hat\", coupling: \"C\", debye_length: \"1/k\") }";
    let outputs = "{ \"a\": \"contact_plane.start.u\", \"lam_bottom\": \"contact_plane.end.lambda\" }";
    let near = |k: f64| {
        let set = [
            ("k", k.to_string()),
            ("tractions", only.to_owned()),
            ("outputs", outputs.to_owned()),
            ("parameters", format!("{{ \"G\": 1, \"r0\": 1.2, \"k\": {k}, \"C\": {c} }}")),
            ("identities", "{}".to_owned()),
            ("expect", "[]".to_owned()),
        ];
        solve(FORCES, &set, ("sigma_hat", w * k / (2.0 * std::f64::consts::PI * c))).0
    };
    let states = [200.0, 400.0, 800.0].map(near);
    for name in ["a", "lam_bottom", "p_f"] {
        let goal = limit(name).0;
        let miss: Vec<f64> = states.iter().map(|s| s(name).0 - goal).collect();
        let ratios = [miss[0] / miss[1], miss[1] / miss[2]];
        assert!(ratios.iter().all(|r| (1.8..2.25).contains(r)), "{name}: misses {miss:?}");
        assert!((ratios[1] - 2.0).abs() < (ratios[0] - 2.0).abs(), "{name}: {ratios:?}");
        // Without the term in 1/k, and then in 1/k^2.
        let extrapolated = (8.0 * miss[2] - 6.0 * miss[1] + miss[0]) / 3.0;
        assert!(extrapolated.abs() < 0.02 * miss[2].abs(), "{name}: {extrapolated:.1e} is left of {miss:?}");
    }
}

/// Along the branch the elastic energy grows by what the contact gains. The same equations written one by one give the same state, but
/// then nothing says that there is an energy behind them, and virtual work misses it.
#[test]
fn virtual_work_knows_the_energy_of_adhesion() {
    let (state, proof) = solve(EDGE, &[], ("W", 0.2));
    assert!(proof.virtual_work < 1e-8, "{proof:?}");
    let joint = r#"[Pole, Free(name: "cap"), Joint(name: "edge", continuous: ["u", "h"], conditions: {
        "pull": "cap.end.w_l*cos(cap.end.tau - plane.start.tau) = plane.start.w_l",
        "energy": "cap.end.lambda*cap.end.w_l - cap.end.w = plane.start.lambda*plane.start.w_l - plane.start.w + W",
    }), Contact(on: "plane"), Pole]"#;
    let set = [("meridian", joint.to_owned()), ("expect", "[]".to_owned()), ("identities", "{}".to_owned())];
    let (written, other) = solve(EDGE, &set, ("W", 0.2));
    assert!((written("a").0 - state("a").0).abs() < 1e-11);
    assert!(other.virtual_work > 1e-3, "{other:?}");
}
