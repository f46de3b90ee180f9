//! Friction at a sharp edge (Euler, Eytelwein): the membrane sticks, slides at the limit, and sticks again when it turns back.

mod common;

use common::{parse, resolve, run};
use membrane::model::Model;
use membrane::run::{Outcome, Status};
use membrane::spec::Syntax;

const FILE: &str = include_str!("../problems/micropipette.ron");

/// The pipette with a law of its edge, at these aspirated lengths in their order.
fn aspirated(law: &str, lengths: &str) -> (Model, Outcome) {
    let text =
        FILE.replace("law: Frictionless", &format!("law: {law}")).replace("steps: 200", &format!("at: {lengths}"));
    let model = resolve(&parse("a file of this test", text, Syntax::Ron));
    let outcome = run(&model, None);
    assert_eq!(outcome.status, Status::Complete, "{law}");
    (model, outcome)
}

fn value(model: &Model, solution: &membrane::solution::Solution, name: &str) -> f64 {
    solution.quantities[model.quantities.iter().position(|q| q.name == name).unwrap()].unwrap().value
}

const WAY: &str = "[0.5, 1, 1.5, 2, 2.5, 2.4, 2, 1.5]";

/// Without friction the law is that of the frictionless edge.
#[test]
fn no_friction_is_frictionless() {
    let (model, outcome) = aspirated("Capstan(friction: 0)", "[0.5, 1, 2]");
    let (other, frictionless) = aspirated("Frictionless", "[0.5, 1, 2]");
    let (_, rough) = aspirated("Capstan(friction: 0.001)", "[0.5, 1, 2]");
    let steps = |o: &Outcome| -> Vec<membrane::solution::Solution> {
        let listed = |p: &&membrane::run::Point| ["Step", "End"].contains(&format!("{:?}", p.reason).as_str());
        o.points.iter().filter(listed).map(|p| p.solution.clone()).collect()
    };
    for ((a, b), c) in steps(&outcome).iter().zip(&steps(&frictionless)).zip(&steps(&rough)) {
        for name in ["dP", "p_f", "phi_c2"] {
            let (x, y, z) = (value(&model, a, name), value(&other, b, name), value(&model, c, name));
            assert!((x - y).abs() < 1e-9 * y.abs(), "{name}: {x}, {y}");
            assert!((z - y).abs() > 1e-6 * y.abs(), "{name}: a thousandth of friction is seen");
        }
    }
}

/// It sticks below the limit, slides at it, and the way back is another one; what is lost balances the energy.
#[test]
fn the_edge_sticks_slides_and_sticks_again() {
    let friction = 0.05;
    let (model, outcome) = aspirated("Capstan(friction: 0.05)", WAY);
    let kinds: Vec<&str> = outcome.events.iter().map(|e| e.kind).filter(|k| ["slip", "stick"].contains(k)).collect();
    assert_eq!(kinds, ["slip", "stick"]);
    let slip = &outcome.events.iter().find(|e| e.kind == "slip").unwrap();
    assert!(slip.stage_after.contains("pipette.mouth (sliding)"), "{}", slip.stage_after);
    let (mut stuck, mut slid) = (0, 0);
    for point in &outcome.points {
        let s = &point.solution;
        assert!(s.certificate.is_admissible(), "{:?}", s.certificate.violations);
        assert!(s.certificate.virtual_work < 1e-8, "{:?}", s.certificate);
        let v = |name: &str| value(&point.model, s, name);
        let law = point.model.system.law.clone();
        // Hoop stretches are equal: mu = rho/rho0.
        let mu = 1.16 / v("phi_c2").sin();
        let pull = |lambda: f64| law.response(lambda, mu).w_l;
        let ratio = (pull(v("lambda_in")) / pull(v("lambda_out"))).ln();
        let limit = friction * (v("tau_in") - v("tau_out"));
        if point.model.stage().contains("sliding") {
            assert!((ratio - limit).abs() < 1e-9, "{ratio} {limit}");
            slid += 1;
        } else {
            assert!(ratio.abs() < limit * (1.0 + 1e-9), "{ratio} {limit}");
            stuck += 1;
        }
    }
    assert!(slid >= 2 && stuck >= 5, "{slid} {stuck}");
    // Where it has slid it sticks at another place, and needs another suction.
    let at = |l: f64| -> Vec<(f64, f64)> {
        let here = |p: &&membrane::run::Point| (value(&p.model, &p.solution, "L") - l).abs() < 1e-9;
        outcome
            .points
            .iter()
            .filter(here)
            .map(|p| (value(&model, &p.solution, "dP"), value(&model, &p.solution, "phi_c2")))
            .collect()
    };
    let twice = at(1.5);
    assert_eq!(twice.len(), 2);
    assert!(twice[0].1 < twice[1].1 - 1e-2, "{twice:?}");
    assert!((twice[0].0 - twice[1].0).abs() > 1e-4, "{twice:?}");
    // Both ways along the stuck edge are one.
    let (_, back) = aspirated("Stuck", "[0.5, 1, 0.5]");
    let (a, b) = (&back.points.first().unwrap().solution, &back.points.last().unwrap().solution);
    assert!((value(&model, a, "dP") - value(&model, b, "dP")).abs() < 1e-9);
}

/// Friction must not be negative.
#[test]
fn negative_friction_is_refused() {
    let text = FILE.replace("law: Frictionless", "law: Capstan(friction: \"-rhobar\")");
    let document = parse("a file of this test", text, Syntax::Ron);
    let refused = membrane::model::resolve(&document.problem).unwrap_err();
    assert!(refused.diagnostics.iter().any(|d| d.code == "negative-friction"), "{:?}", refused.diagnostics);
}
