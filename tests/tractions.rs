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

/// Images in the plane derive from the potential as well: with U_image = U_sub - U_direct, dU/d sigma_hat = U_direct/sigma_hat,
/// dU/dC = (U_sub + U_self)/C, dU/dH = F; the direct term alone is not the force.
#[test]
fn images_in_the_plane_derive_from_a_potential() {
    for substrate in ["Insulating", "Conducting"] {
        let text = FILE
            .replacen("debye_length: \"1/k\")", &format!("debye_length: \"1/k\", substrate: {substrate})"), 1)
            .replace("\"energy_self\":", "\"image\": \"attraction.image_energy\", \"energy_self\":");
        let base = [1.2, 20.0, 0.05, 0.01, 4.0];
        let total = |v: [f64; 5]| {
            let mut set = charged(v[0], v[1], v[2], v[3]).to_vec();
            set.push(("accuracy", "1e-9".to_owned()));
            let s = solve(&text, &set, ("sigma_hat", v[4]));
            (s("energy").0 + s("energy_substrate").0 + s("energy_self").0, s)
        };
        let (_, s) = total(base);
        let direct = s("energy_substrate").0 - s("image").0;
        let expected =
            [(2, (s("energy_substrate").0 + s("energy_self").0) / base[2]), (3, s("force").0), (4, direct / base[4])];
        for (which, derivative) in expected.into_iter().filter(|e| e.0 == 3 || substrate == "Insulating") {
            let slope = |d: f64| {
                let (mut up, mut down) = (base, base);
                up[which] *= 1.0 + d;
                down[which] *= 1.0 - d;
                (total(up).0 - total(down).0) / (2.0 * d * base[which])
            };
            // Richardson: the error of central differences is even.
            let [a, b, c] = [0.02, 0.04, 0.08].map(slope);
            let [a, b] = [(4.0 * a - b) / 3.0, (4.0 * b - c) / 3.0];
            let found = (16.0 * a - b) / 15.0;
            let miss = (found / derivative - 1.0).abs();
            println!("{substrate} {which}: {found} {derivative} {miss:e}");
            assert!(miss < 1e-7, "{substrate}, parameter {which}: {found} {derivative}");
            if which == 3 {
                // The plane's own charge pulls with -k U_direct only.
                assert!((found / (-20.0 * direct) - 1.0).abs() > 1e-3);
            }
        }
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

/// What cannot be is said at its place; what is right is taken.
#[test]
fn charges_that_cannot_be_are_refused_by_name() {
    let with_images = FILE.replacen("debye_length: \"1/k\")", "debye_length: \"1/k\", substrate: Insulating)", 1);
    let repelled = FILE.replace("from: 0.05, to: 60", "from: -0.05, to: -60");
    let plane = "/tractions/attraction/ChargedPlane";
    let own = "/tractions/repulsion/SelfRepulsion";
    for (text, setting, code, place) in [
        (FILE, ("H", "-0.1"), "charged-plane", format!("{plane}/h")),
        (FILE, ("k", "0"), "not-finite", format!("{plane}/debye_length")),
        (FILE, ("k", "-5"), "charge", format!("{plane}/debye_length")),
        (FILE, ("C", "-1"), "charge", format!("{plane}/coupling")),
        (FILE, ("C", "44"), "no-tension", format!("{own}/coupling")),
        (&repelled, ("C", "0.05"), "equal-charges", "/branch/from".to_owned()),
        (&with_images, ("H", "0"), "image-in-contact", format!("{plane}/h")),
    ] {
        let document = parse("a file of this test", text.to_owned(), Syntax::Ron);
        let found = membrane::model::resolve(&with(&document, &[setting]).problem).unwrap_err().diagnostics;
        let places = membrane::diagnostic::to_json(&found, &document);
        assert_eq!(found[0].code, code, "{setting:?}");
        let labels = format!("{:?}", found[0]);
        assert!(labels.contains(&place), "{setting:?}: {labels} {places:?}");
        resolve(&document_that_is_right(text));
    }
}

/// The same text with the sign and the distance mended.
fn document_that_is_right(text: &str) -> membrane::spec::Document {
    parse("a file of this test", text.replace("from: -0.05, to: -60", "from: 0.05, to: 60"), Syntax::Ron)
}

/// With a long screening length a strong attraction compresses what lies on the plane: an event, and states that are not admissible.
#[test]
fn compression_in_the_contact_is_an_event() {
    let text = FILE.replace("from: 0.05, to: 60, steps: 20", "from: 20, to: 40, steps: 2");
    let events = |k: &str| {
        let set = [("k", k), ("accuracy", "1e-6")];
        let model = resolve(&with(&parse("a file of this test", text.clone(), Syntax::Ron), &set));
        let outcome = run(&model, None);
        assert_eq!(outcome.status, Status::Complete);
        let last = outcome.points.last().unwrap().solution.certificate.is_admissible();
        (outcome.events.iter().filter(|e| e.kind == "wrinkling").count(), last)
    };
    assert_eq!(events("10"), (1, false));
    assert_eq!(events("100"), (0, true));
}
