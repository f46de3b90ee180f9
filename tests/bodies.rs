//! Rigid bodies: each shape against another way to say it, upside down, and against the asymptotics of a sharp tip.

mod common;

use common::{measured, parse, resolve, run, with};
use membrane::run::Status;
use membrane::spec::Syntax;

/// Quantities of one state of a problem file, with changes of its text.
fn state(file: &str, changes: &[(&str, &str)], set: &[(&str, &str)], at: (&str, f64)) -> impl Fn(&str) -> f64 + use<> {
    let mut text = std::fs::read_to_string(format!("problems/{file}.ron")).unwrap();
    for (old, new) in changes {
        assert!(text.contains(old), "{file}: {old}");
        text = text.replace(old, new);
    }
    let mut settings = vec![("expect", "[]")];
    settings.extend(set);
    let model = resolve(&with(&parse(file, text, Syntax::Ron), &settings));
    let outcome = run(&model, Some(at));
    assert_eq!(outcome.status, Status::Complete, "{file} {changes:?} {at:?}");
    assert!(outcome.points[0].solution.certificate.is_admissible(), "{:?}", outcome.points[0].solution.certificate);
    move |name: &str| measured(&model, &outcome, 0, name).unwrap_or_else(|| panic!("no {name}")).0
}

fn same(a: impl Fn(&str) -> f64, b: impl Fn(&str) -> f64, names: &[&str], within: f64) {
    for name in names {
        let (x, y) = (a(name), b(name));
        assert!((x - y).abs() <= within * y.abs(), "{name}: {x} {y}");
    }
}

#[test]
fn a_shape_is_what_its_formula_says() {
    let names = ["force", "p_f", "u_c1", "u_c2", "energy", "lambda_pole"];
    let at = ("gap", 1.6);
    let bead = "Sphere(radius: \"bead_radius\")";
    let said = |shape: &str| state("bead_on_flat", &[(bead, shape)], &[("identities", "{}")], at);
    let sphere = said(bead);
    let profile = said("Profile(\"bead_radius - sqrt(bead_radius^2 - u^2)\")");
    same(&sphere, &profile, &names, 1e-10);
    let other = said("Profile(\"1.001*bead_radius - sqrt((1.001*bead_radius)^2 - u^2)\")");
    assert!((other("force") / sphere("force") - 1.0).abs() > 1e-5, "a thousandth of the radius is seen");
    let (paraboloid, parabola) = (said("Paraboloid(radius: 0.7)"), said("Profile(\"u^2/(2*0.7)\")"));
    same(&paraboloid, &parabola, &names, 1e-10);
    // A drawn quarter of the circle.
    let arc = "Faces(from: (0, 0), faces: [Arc(name: \"tip\", through: (\"0.5*sin(0.6)\", \"0.5*(1 - cos(0.6))\"), to: (0.5, 0.5))])";
    let drawn = state(
        "bead_on_flat",
        &[
            (bead, arc),
            ("Contact(on: \"bead\")", "Contact(on: \"bead.tip\", name: \"ball\")"),
            ("bead.end", "ball.end"),
            ("bead.start", "ball.start"),
        ],
        &[("identities", "{}")],
        at,
    );
    same(&sphere, &drawn, &names, 1e-10);
    let curve =
        "Faces(from: (0, 0), faces: [Curve(name: \"tip\", u: \"0.5*sin(t)\", d: \"0.5*(1 - cos(t))\", t: (0, 1.5))])";
    let curved = state(
        "bead_on_flat",
        &[
            (bead, curve),
            ("Contact(on: \"bead\")", "Contact(on: \"bead.tip\", name: \"ball\")"),
            ("bead.end", "ball.end"),
            ("bead.start", "ball.start"),
        ],
        &[("identities", "{}")],
        at,
    );
    same(&sphere, &curved, &names, 1e-10);
}

#[test]
fn a_punch_is_what_its_drawing_says() {
    let drawn = "Faces(from: (0, 0), faces: [Line(name: \"face\", to: (\"punch_radius\", 0), edge: \"edge\"), Line(name: \"side\", to: (\"punch_radius\", 10))])";
    // On the face, bent over the edge, along the side.
    for gap in [2.7, 2.0, 1.2] {
        let punch = state("flat_punch", &[], &[], ("gap", gap));
        let faces = state("flat_punch", &[("Punch(radius: \"punch_radius\")", drawn)], &[], ("gap", gap));
        same(punch, faces, &["force", "u_c1", "u_c2", "p_f", "energy"], 1e-9);
    }
}

#[test]
fn upside_down_nothing_changes() {
    let up = state("bead_on_flat", &[], &[], ("gap", 1.4));
    let changes = [
        ("facing: Down, h: \"-gap\"", "facing: UP, h: 0"),
        ("facing: Up, h: 0", "facing: Down, h: \"-gap\""),
        ("facing: UP", "facing: Up"),
        (
            "[Pole, Contact(on: \"bead\"), Free(name: \"side\"), Contact(on: \"support\"), Pole]",
            "[Pole, Contact(on: \"support\"), Free(name: \"side\"), Contact(on: \"bead\"), Pole]",
        ),
        ("bead.end.u", "bead.start.u"),
        ("support.start.u", "support.end.u"),
        ("-bead.end.tau", "bead.start.tau - pi"),
        ("bead.start.lambda", "bead.end.lambda"),
    ];
    let down = state("bead_on_flat", &changes, &[], ("gap", 1.4));
    same(up, down, &["force", "u_c1", "u_c2", "wrap_angle", "p_f", "energy", "lambda_pole"], 1e-10);
}

/// As the radius Rt of a rounded tip vanishes, the stretch of the pole goes to 2 tan(a/2) (C/sin a)^(1/c) Rt^((c - 1)/c), with C of the
/// sharp cone, c = cos a.
#[test]
fn a_rounded_tip_tends_to_a_sharp_one() {
    let a = 40.0_f64.to_radians();
    let (sin, cos) = a.sin_cos();
    let sharp = state("cone_on_flat", &[], &[], ("dbar", 0.5));
    let c = sharp("tip_coefficient");
    let miss = |radius: f64| {
        // The tip of the cone stands above that of its sphere.
        let apex = radius * (1.0 / cos - 1.0) / 4.0;
        let rounded = state("rounded_cone", &[], &[("tip_radius", &radius.to_string())], ("dbar", 0.5 + apex));
        let limit = 2.0 * (0.5 * a).tan() * (c / sin).powf(1.0 / cos) * radius.powf((cos - 1.0) / cos);
        let force = rounded("force") / sharp("force") - 1.0;
        (rounded("lambda_pole") / limit - 1.0, force)
    };
    let (coarse, fine) = (miss(0.02), miss(0.005));
    assert!(fine.0.abs() < 1e-3, "{fine:?}");
    assert!(fine.0.abs() < 0.5 * coarse.0.abs() && fine.1.abs() < 0.5 * coarse.1.abs(), "{coarse:?} {fine:?}");
    assert!(fine.1.abs() < 1e-4, "{fine:?}");
}

#[test]
fn wrong_shapes_are_refused_at_their_place() {
    for (shape, code) in [
        ("Profile(\"1 + u^2\")", "profile-start"),
        ("Profile(\"b*u^2\")", "unknown-name"),
        ("Sphere(radius: \"-bead_radius\")", "not-positive"),
        ("Faces(from: (0, 0), faces: [Line(name: \"face\", to: (1, 0))])", "unknown-name"),
        ("Cylinder(radius: 0.3)", "no-first-touch"),
        // The sphere does not fit into the hollow, or is not met on the axis first.
        ("Sphere(radius: \"0.99*r0\", hollow: true)", "no-first-touch"),
        ("Sphere(radius: \"r0\", hollow: true)", "no-first-touch"),
        ("Profile(\"u^4 - 0.6*u^2/r0\")", "no-first-touch"),
    ] {
        let text = std::fs::read_to_string("problems/bead_on_flat.ron").unwrap();
        let text = text.replace("Sphere(radius: \"bead_radius\")", shape);
        let refused = membrane::model::resolve(&parse("a test", text, Syntax::Ron).problem).unwrap_err();
        assert!(refused.diagnostics.iter().any(|d| d.code == code), "{shape}: {:?}", refused.diagnostics);
    }
    for shape in ["Sphere(radius: \"1.01*r0\", hollow: true)", "Profile(\"u^4 - 0.4*u^2/r0\")"] {
        let text = std::fs::read_to_string("problems/bead_on_flat.ron").unwrap();
        resolve(&parse("a test", text.replace("Sphere(radius: \"bead_radius\")", shape), Syntax::Ron));
    }
}

const STAMP: &str = r#"(
    format: 1, title: "Stamp",
    unknowns: { "depth": 0 },
    reference: Sphere(radius: 1), material: NeoHookean(shear_modulus: 1),
    initial: Inflated(radius: 1.3), fluid: Incompressible,
    bodies: { "stamp": (shape: Punch(radius: 0.4), facing: Down, h: "depth - 2.6"), "table": (shape: Plane, facing: Up, h: 0) },
    meridian: [Pole, Contact(on: "stamp.face"), Kink(at: "stamp.edge", appears: OnTouch), Free(name: "side"), Contact(on: "table"), Pole],
    branch: (control: "depth", to: 0.6, steps: 6),
    outputs: { "reach": "side.start.u" },
)"#;

#[test]
fn a_contact_goes_no_further_than_its_face() {
    let kink = "Kink(at: \"stamp.edge\", appears: OnTouch), ";
    let solve = |text: &str| run(&resolve(&parse("a test", text.into(), Syntax::Ron)), None);
    let listed = solve(STAMP);
    assert_eq!(listed.status, Status::Complete);
    assert!(listed.points.iter().all(|p| p.solution.certificate.is_admissible()));
    // Without the edge the face goes on for the equations, and not for the certificate.
    let endless = solve(&STAMP.replace(kink, ""));
    let last = &endless.points.last().expect("a state").solution.certificate;
    assert!(last.violations.iter().any(|v| v.contains("beyond the end of stamp.face")), "{:?}", last.violations);
    assert!(endless.points[0].solution.certificate.is_admissible(), "it is small at first");
}

#[test]
fn names_are_looked_for_before_events() {
    for (old, new, code, message) in [
        ("stamp.edge", "stamp.corner", "unknown-name", "there is no sharp edge `stamp.corner`"),
        ("table\"), Pole]", "table\")]", "no-end", "a meridian starts and ends with an end"),
    ] {
        assert!(STAMP.contains(old), "{old}");
        let text = STAMP.replace(old, new);
        let refused = membrane::model::resolve(&parse("a test", text, Syntax::Ron).problem).unwrap_err();
        let found: Vec<_> = refused.diagnostics.iter().map(|d| (d.code, d.message.as_str())).collect();
        assert_eq!(found, [(code, message)]);
    }
}

/// A bead that starts away from the membrane touches it on the way, leaves it on the way back, and meanwhile is as if it had been listed.
#[test]
fn a_body_is_met_at_a_pole_and_left_again() {
    let text = std::fs::read_to_string("problems/two_beads.ron").unwrap();
    let text = text
        .replace("Contact(on: \"bead\")", "Contact(on: \"bead\", appears: OnTouch)")
        .replace("\"d\": \"2*r0\"", "\"d\": \"2.2*r0\"")
        .replace("to: \"0.3*2*r0\", steps: 40", "at: [3.2, 2.4, 3.1, 2.4]");
    let model = resolve(&with(&parse("two beads", text, Syntax::Ron), &[("expect", "[]")]));
    let outcome = run(&model, None);
    assert_eq!(outcome.status, Status::Complete);
    let kinds: Vec<&str> = outcome.events.iter().map(|e| e.kind).collect();
    assert_eq!(kinds, ["touch", "lift_off", "touch"]);
    let place = |name: &str| model.quantities.iter().position(|q| q.name == name).unwrap();
    let touch = outcome.events[0].solution.quantities[place("d")].unwrap();
    assert!((touch.value - 3.0).abs() < 1e-8, "{touch:?}");
    let listed = state("two_beads", &[], &[], ("d", 2.4));
    let mut seen = 0;
    for point in &outcome.points {
        assert!(point.solution.certificate.is_admissible(), "{:?}", point.solution.certificate);
        let q = |name: &str| point.solution.quantities[place(name)].map_or(f64::NAN, |m| m.value);
        if (q("d") - 2.4).abs() < 1e-12 {
            same(q, &listed, &["force", "p_f", "u_c", "energy"], 1e-9);
            seen += 1;
        }
    }
    assert_eq!(seen, 2);
}
