//! Sets of conditions that count, and whether they determine their solution: one verdict each, and its twin.

use membrane::run::{Rank, Reason, Status, rank};
use membrane::spec::{Document, Source, Syntax};
use membrane::{model, run};
use std::ops::ControlFlow;

fn text(file: &str) -> String {
    std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn model_of(text: &str) -> model::Model {
    let source = Source { name: "test".into(), text: text.into(), syntax: Syntax::Ron };
    let document = Document::read(source).unwrap_or_else(|r| panic!("{:?}", r.diagnostics));
    model::resolve(&document.problem).unwrap_or_else(|d| panic!("{d:?}"))
}

fn verdict(text: &str) -> Rank {
    rank(&model_of(text))
}

#[test]
fn the_mended_conditions_of_the_thesis_leave_the_edge_free() {
    let r = verdict(&text("tests/data/rank/micropipette_sign_mended.ron"));
    assert_eq!(r.deficiency, Some(1));
    assert!(r.dependent.contains(&"(5.23)".to_owned()), "{r:?}");
    assert!(r.free.contains(&"dP".to_owned()) && r.free.contains(&"place of pipette.mouth".to_owned()), "{r:?}");
    assert!(r.closing.iter().any(|c| c.contains("lambda continuous")), "{r:?}");
    assert!(r.closing.iter().any(|c| c.contains("frictionless edge")), "{r:?}");
    assert!(!r.neutral, "the edge slides along the membrane: {r:?}");
    // What the edge already satisfies would close nothing.
    assert!(!r.closing.iter().any(|c| c.ends_with(": u continuous")), "{r:?}");
}

#[test]
fn the_printed_conditions_of_the_thesis_determine_a_solution_without_suction() {
    let r = verdict(&text("tests/data/rank/micropipette_as_printed.ron"));
    assert_eq!(r.deficiency, Some(0));
    assert_eq!(r.forced.len(), 1);
    assert!(r.forced[0].0 == "dP" && r.forced[0].1.abs() < 1e-9, "{r:?}");
}

#[test]
fn axial_force_continuous_is_an_identity_at_a_ligature() {
    let good = text("tests/data/rank/ligature.ron");

    let v = verdict(&good);
    assert_eq!(v.deficiency, Some(0), "{v:?}");
    let force = r#""axial force continuous": "thread.before.w_l*sin(thread.before.tau) = thread.after.w_l*sin(thread.after.tau)""#;
    let r = verdict(&good.replace(r#""axial position": "thread.h = 0""#, force));
    assert_eq!(r.deficiency, Some(1));
    assert!(r.dependent.contains(&"axial force continuous".to_owned()), "{r:?}");
    assert!(r.closing.iter().any(|c| c.contains("axial position")), "{r:?}");
    assert!(r.neutral, "the membrane may stand anywhere on the axis: {r:?}");
}

/// Well-posed files are not suspected, wherever the branch is examined: at first touch, near a limit point, at large stretch.
#[test]
fn shipped_problems_are_not_suspected() {
    let mut seen = 0;
    for entry in std::fs::read_dir("problems").unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "ron") {
            let r = verdict(&text(path.to_str().unwrap()));
            assert_eq!((r.deficiency, r.forced.len()), (Some(0), 0), "{path:?}");
            seen += 1;
        }
    }
    assert!(seen >= 6);
    for (r0, from) in [("2", "1.13"), ("3", "1.68")] {
        // The frictionless pipette near the limit point of dP.
        let file = text("problems/micropipette.ron")
            .replace("\"r0\": 2", &format!("\"r0\": {r0}"))
            .replace("control: \"L\",", &format!("control: \"L\", from: {from},"));
        assert_eq!(verdict(&file).deficiency, Some(0), "r0 = {r0}");
    }
}

/// Contact with the wall appears by an event and vanishes by the opposite one; the state there is the same, and the stages are named.
#[test]
fn going_back_along_the_branch_undoes_the_touch() {
    let file = text("problems/micropipette.ron");
    let forth = model_of(&file.replace("control: \"L\", steps: 200,", "control: \"L\", at: [0.9, 1.5, 2, 1.2, 0.9],"));
    let outcome = run::run(&forth, &[], &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(outcome.status, Status::Complete);
    let kinds: Vec<&str> = outcome.events.iter().map(|e| e.kind).filter(|k| *k != "fold").collect();
    assert_eq!(kinds, ["touch", "lift_off"]);
    let (touch, lift) = (
        outcome.events.iter().find(|e| e.kind == "touch").unwrap(),
        outcome.events.iter().find(|e| e.kind == "lift_off").unwrap(),
    );
    assert_eq!(touch.stage_before, lift.stage_after);
    assert_eq!(touch.stage_after, lift.stage_before);
    assert_ne!(touch.stage_before, touch.stage_after);
    let value = |q: &str, s: &membrane::solution::Solution| {
        s.quantities[forth.quantities.iter().position(|x| x.name == q).unwrap()].unwrap().value
    };
    for q in ["L", "dP", "p_f", "phi_c2"] {
        let (a, b) = (value(q, &touch.solution), value(q, &lift.solution));
        assert!((a - b).abs() < 1e-8 * a.abs(), "{q}: {a} {b}");
    }
    let steps: Vec<&membrane::solution::Solution> =
        outcome.points.iter().filter(|p| matches!(p.reason, Reason::Step | Reason::End)).map(|p| &p.solution).collect();
    assert_eq!(steps.len(), 5);
    let (first, last) = (value("dP", steps[0]), value("dP", steps[4]));
    assert!((first - last).abs() < 1e-8 * first, "the way back ends where the way out began: {first} {last}");
}

/// Limit points and first touch against independent values.
#[test]
fn critical_pressures_of_the_pipette() {
    let data: serde_json::Value = serde_json::from_str(&text("tests/data/reference/micropipette.json")).unwrap();
    let mut seen = 0;
    for case in data["critical_pressures"].as_array().unwrap() {
        let file = text("problems/micropipette.ron")
            .replace("\"r0\": 2", &format!("\"r0\": {}", case["r0"]))
            .replace("\"rhobar\": 0.58", &format!("\"rhobar\": {}", case["rhobar"]));
        let model = model_of(&file);
        let outcome = run::run(&model, &[], &mut |_, _| ControlFlow::Continue(()));
        let place = |name: &str| model.quantities.iter().position(|q| q.name == name).unwrap();
        let value = |e: &run::Event, q: &str| e.solution.quantities[place(q)].unwrap().value;
        let near = |a: f64, b: f64| (a - b).abs() < 1e-8 * b.abs();
        let touch = outcome.events.iter().find(|e| e.kind == "touch").unwrap();
        let (r0, rhobar) = (&case["r0"], &case["rhobar"]);
        for (ours, theirs) in
            [("dP", "p_contact"), ("L", "L_contact"), ("p_f", "p_f_contact"), ("phi_c2", "phi_contact")]
        {
            let (a, b) = (value(touch, ours), case[theirs].as_f64().unwrap());
            assert!(near(a, b), "r0 {r0} rhobar {rhobar}: {ours} {a} {b}");
        }
        for maximum in case["maxima"].as_array().unwrap() {
            let dp = maximum["dP"].as_f64().unwrap();
            let folds = outcome.events.iter().filter(|e| e.kind == "fold" && e.of == "dP");
            assert!(folds.clone().any(|e| near(value(e, "dP"), dp)), "r0 {r0} rhobar {rhobar}: no limit point at {dp}");
        }
        seen += 1;
    }
    assert_eq!(seen, 20);
}

/// At the start of the ligature branches cross: the thread may slide off as well. The branch on which it is pulled tight is followed,
/// and the thread's own work is in the balance.
#[test]
fn the_ligature_is_pulled_tight() {
    let outcome =
        run::run(&model_of(&text("tests/data/rank/ligature.ron")), &[], &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(outcome.status, Status::Complete);
    assert!(outcome.points.len() > 40);
    for point in &outcome.points {
        let force = point.model.quantities.iter().position(|q| q.name == "line_force").unwrap();
        let pulled = point.reason != Reason::Start;
        assert_eq!(point.solution.quantities[force].unwrap().value < -1e-3, pulled, "the thread pulls inwards");
        assert!(point.solution.certificate.virtual_work < 1e-8, "{}", point.solution.certificate.virtual_work);
    }
}

/// Beyond the stop of a file there is no branch: what is asked for there is not reached, and the stop itself is.
#[test]
fn nothing_is_asked_for_beyond_a_stop() {
    let file = text("problems/micropipette.ron").replace("\"rhobar\": 0.58", "\"rhobar\": 0.7");
    let model = model_of(&file);
    let at = |value: f64| {
        let request = run::Request { name: "L".into(), value };
        run::run(&model, &[request], &mut |_, _| ControlFlow::Continue(()))
    };
    let beyond = at(6.76);
    let Status::Incomplete(message) = &beyond.status else { panic!("there is no such state") };
    assert!(message.contains("the branch ends at L = 4.976"), "{message}");
    assert!(beyond.points.is_empty());
    let before = at(4.9);
    assert_eq!(before.status, Status::Complete);
    assert!(before.points[0].solution.certificate.is_admissible());
    let whole = run::run(&model, &[], &mut |_, _| ControlFlow::Continue(()));
    let end = whole.events.iter().find(|e| e.kind == "end").unwrap();
    let place = model.quantities.iter().position(|q| q.name == "L").unwrap();
    let found = at(end.solution.quantities[place].unwrap().value);
    assert_eq!(found.points.len(), 1, "{:?}", found.status);
}

/// Two constraints that say the same are found also where bodies are touched and no state can be solved with them.
#[test]
fn constraints_that_say_the_same_are_named() {
    let file = |second: &str| {
        text("problems/cone_on_flat.ron")
            .replace("unknowns: { \"dbar\": 1 }", "unknowns: { \"dbar\": 1, \"x\": 0.25, \"y\": 0.75 }")
            .replace(
                "    outputs: {",
                &format!("    constraints: {{ \"one\": \"x + y = 1\", \"two\": \"{second}\" }},\n    outputs: {{"),
            )
    };
    assert!(file("").contains("constraints"));
    let r = verdict(&file("2*x + 2*y = 2"));
    assert_eq!(r.deficiency, Some(1), "{r:?}");
    assert!(["one", "two"].iter().all(|c| r.dependent.iter().any(|d| d == c)), "{r:?}");
    assert!(["x", "y"].iter().all(|u| r.free.iter().any(|f| f == u)), "{r:?}");
    let twin = verdict(&file("2*x + y = 1.25"));
    assert_eq!(twin.deficiency, Some(0), "{twin:?}");
}
