//! Tractions besides pressure: against independent values, against each other, and against the potential they derive from.

mod common;

use common::{parse, resolve, run, with};
use membrane::run::Status;
use membrane::spec::Syntax;

/// One state of a problem, as name -> (value, error).
fn solve(text: &str, set: &[(&str, String)], at: (&str, f64)) -> impl Fn(&str) -> (f64, f64) + use<> {
    let settings: Vec<(String, String)> = set.iter().map(|(k, v)| ((*k).to_owned(), v.clone())).collect();
    let model = resolve(&with(&parse("a file of this test", text.to_owned(), Syntax::Ron), &settings));
    let outcome = run(&model, Some(at));
    assert_eq!(outcome.status, Status::Complete, "{set:?} {at:?}");
    let solution = outcome.points[0].solution.clone();
    assert!(solution.certificate.virtual_work < 1e-4, "{set:?}: {}", solution.certificate.virtual_work);
    move |name: &str| {
        let q = model.quantities.iter().position(|q| q.name == name).unwrap_or_else(|| panic!("no {name}"));
        let m = solution.quantities[q].unwrap();
        (m.value, m.error)
    }
}

/// The shipped file.
const FILE: &str = include_str!("../problems/electrostatic.ron");

fn charged(r0: f64, k: f64, c: f64, h: f64) -> [(&'static str, String); 4] {
    [("r0", r0.to_string()), ("k", k.to_string()), ("C", c.to_string()), ("H", h.to_string())]
}

/// All states with self-repulsion that the reference has; errors are honest up to what the reference is known to.
#[test]
fn electrostatic_adhesion_against_independent_values() {
    let text = std::fs::read_to_string("tests/data/reference/electrostatic.json").unwrap();
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut seen = 0;
    for case in data["cases"].as_array().unwrap() {
        let p = |key: &str| case["params"][key].as_f64().unwrap();
        if case["params"]["self_repulsion"] != true {
            continue;
        }
        let state = solve(FILE, &charged(p("r0"), p("kbar"), p("C"), p("Hbar")), ("sigma_hat", p("sigma_hat")));
        // The reference rounds at 1e-10 besides.
        let known = (10.0 * case["mesh_change_rel"].as_f64().unwrap()).max(1e-9);
        for (ours, theirs) in [
            ("a", "a"),
            ("phi_c", "phi_c"),
            ("p_f", "p_f"),
            ("force", "F"),
            ("height", "height"),
            ("lam_top", "lam_top"),
            ("lam_bottom", "lam_bottom"),
            ("sigma_bottom", "sigma_bottom"),
            ("energy", "U_el"),
            ("energy_substrate", "U_sub"),
            ("energy_self", "U_self"),
        ] {
            let Some(expected) = case["results"][theirs].as_f64() else { panic!("{}: no {theirs}", case["id"]) };
            let (value, error) = state(ours);
            let miss = (value - expected).abs();
            assert!(miss < 1e-7 * expected.abs(), "{}: {ours} {value} {expected}", case["id"]);
            assert!(
                miss < error + known * expected.abs(),
                "{}: {ours} misses by {miss:e}, claims {error:e}",
                case["id"]
            );
        }
        seen += 1;
    }
    assert!(seen >= 15, "{seen}");
}

/// dU/d sigma_hat = U_sub/sigma_hat, dU/dC = (U_sub + U_self)/C, dU/dH = F, dU/d r0 = 4 pi r0^2 p_f.
#[test]
fn the_potential_has_the_right_derivatives() {
    let base = [1.2, 50.0, 0.05, 0.002, 10.0];
    let total = |v: [f64; 5]| {
        let s = solve(FILE, &charged(v[0], v[1], v[2], v[3]), ("sigma_hat", v[4]));
        (s("energy").0 + s("energy_substrate").0 + s("energy_self").0, s)
    };
    let (_, s) = total(base);
    let expected = [
        (0, 4.0 * std::f64::consts::PI * 1.44 * s("p_f").0),
        (2, (s("energy_substrate").0 + s("energy_self").0) / base[2]),
        (3, s("force").0),
        (4, s("energy_substrate").0 / base[4]),
    ];
    for (which, derivative) in expected {
        let step = 2e-2 * base[which];
        let slope = |d: f64| {
            let (mut up, mut down) = (base, base);
            up[which] += d;
            down[which] -= d;
            (total(up).0 - total(down).0) / (2.0 * d)
        };
        // Richardson: the error of central differences is even.
        let found = (4.0 * slope(step) - slope(2.0 * step)) / 3.0;
        assert!((found / derivative - 1.0).abs() < 1e-5, "parameter {which}: {found} {derivative}");
    }
}

/// Without the repulsion of the membrane by itself the answer is another one.
#[test]
fn the_repulsion_matters() {
    let bare: String = FILE.lines().filter(|l| !l.contains("repulsion")).map(|l| format!("{l}\n")).collect();
    let set = charged(1.2, 100.0, 0.05, 0.001);
    let with = solve(FILE, &set, ("sigma_hat", 20.0));
    let without = solve(&bare, &set, ("sigma_hat", 20.0));
    assert!((with("p_f").0 / without("p_f").0 - 1.0).abs() > 1e-3);
    assert!((with("force").0 / without("force").0 - 1.0).abs() > 1e-4);
}

/// The catalogue's charged plane is the formula that a user could write.
#[test]
fn a_formula_does_what_the_catalogue_does() {
    let written = FILE.replace(
        "ChargedPlane(h: \"H\", charge_ratio: \"sigma_hat\", coupling: \"C\", debye_length: \"1/k\")",
        "Applied(axial: \"2*pi*C*sigma_hat*exp(-k*(H - h))\", per: ReferenceArea)",
    );
    assert_ne!(FILE, written);
    let written = written.replace("\"energy_substrate\": \"attraction.energy\",", "");
    let set = charged(1.2, 40.0, 0.05, 0.001);
    let (a, b) = (solve(FILE, &set, ("sigma_hat", 5.0)), solve(&written, &set, ("sigma_hat", 5.0)));
    for q in ["a", "p_f", "force", "height"] {
        assert!((a(q).0 / b(q).0 - 1.0).abs() < 1e-9, "{q}");
    }
}

/// A heavy capsule stands on its ground with its whole weight, whatever its shape; per current area it weighs more.
#[test]
fn the_ground_carries_the_weight() {
    let file = |per: &str| {
        format!(
            r#"(format: 1, title: "Heavy capsule", parameters: {{ "r0": 1.3 }}, unknowns: {{ "weight": 0 }},
            reference: Sphere(radius: 1), material: MooneyRivlin(c1: 0.5, c2: 0.05), initial: Inflated(radius: "r0"),
            fluid: Incompressible, bodies: {{ "ground": (shape: Plane, facing: Up, h: 0) }},
            tractions: {{ "gravity": Applied(axial: "weight", per: {per}) }},
            meridian: [Pole, Free(name: "cap"), Contact(on: "ground"), Pole], branch: (control: "weight", to: 0.2, steps: 5),
            outputs: {{ "pressed": "ground.force", "area": "membrane.area" }})"#
        )
    };
    for (per, current) in [("ReferenceArea", false), ("CurrentArea", true)] {
        let s = solve(&file(per), &[], ("weight", 0.1));
        let area = if current { s("area").0 } else { 4.0 * std::f64::consts::PI };
        assert!((s("pressed").0 / (0.1 * area) - 1.0).abs() < 1e-9, "{per}");
    }
}
