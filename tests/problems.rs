//! Every shipped problem file, found by a walk through `problems/`: it resolves, its branch is solved to the end, every
//! state has its proof, every number that the file expects holds, and none of it would hold for another problem.

mod common;

use common::{measured, parse, read, resolve, run, shipped, stem, with};
use membrane::model::{Expectation, Model};
use membrane::run::Status;
use membrane::spec::{Document, Syntax, convert};
use std::fmt::Write;

/// Residual mismatch of what holds exactly: the states are asked for to 1e-9, and these are no less accurate.
const BALANCE: f64 = 1e-9;
/// Near first touch the work itself vanishes (like the square of the approach), and what is left of it is compared with
/// differences of energies of order 1.
const WORK: f64 = 1e-5;
/// The references print twelve digits at least.
const DIGITS: f64 = 5e-12;

#[test]
fn every_branch_is_solved_and_proved() {
    for file in shipped() {
        let document = read(&file);
        let model = resolve(&document);
        let outcome = run(&model, None);
        assert_eq!(outcome.status, Status::Complete, "{file}");
        assert!(outcome.points.len() >= 2, "{file}");
        // A sharp tip on the axis.
        let text = &document.origin.source().text;
        let tip = text.contains("Cone(") && !text.contains("tip_radius:") && !text.contains("hollow:");
        for (i, point) in outcome.points.iter().enumerate() {
            let proof = &point.solution.certificate;
            let place = format!("{file}, point {i}: {proof:?}");
            assert!(proof.is_admissible(), "{place}");
            assert!(proof.first_integral <= BALANCE, "{place}");
            assert!(proof.force_balance <= BALANCE, "{place}");
            assert!(proof.identities <= BALANCE.max(model.accuracy), "{place}");
            assert!(proof.virtual_work <= WORK.max(1e4 * model.accuracy), "{place}");
            let infinite = &point.solution.infinite;
            assert_eq!(infinite.iter().any(|name| name.ends_with("lambda")), tip, "{place}: {infinite:?}");
            for (q, m) in model.quantities.iter().zip(&point.solution.quantities) {
                let Some(m) = m else { continue };
                assert!(m.value.is_finite() && m.error.is_finite(), "{place}: {}", q.name);
                let allowed = (model.accuracy * m.value.abs()).max(1e-12);
                assert!(m.error <= allowed, "{place}: {} = {} claims {}", q.name, m.value, m.error);
            }
        }
    }
}

/// How far each expected value is missed, relative to it, and whether by more than was claimed.
fn misses(file: &str, document: &Document, e: &Expectation) -> Vec<(String, f64, bool)> {
    let model = resolve(document);
    let at = e.at.as_ref().map(|(name, value)| (name.as_str(), *value));
    let outcome = run(&model, at);
    assert_eq!(outcome.status, Status::Complete, "{file} {at:?}");
    let last = outcome.points.len() - 1; // without `at`, the end of the branch
    e.values
        .iter()
        .map(|(name, expected)| {
            let (value, error) = measured(&model, &outcome, if at.is_some() { 0 } else { last }, name)
                .unwrap_or_else(|| panic!("{file} {at:?}: there is no {name}"));
            let miss = (value - expected).abs();
            (name.clone(), miss / expected.abs(), miss > error + DIGITS * expected.abs())
        })
        .collect()
}

#[test]
fn every_expectation_holds() {
    for file in shipped() {
        let document = read(&file);
        let model = resolve(&document);
        let expectations = model.expectations;
        let expects = expectations.iter().any(|e| !e.refuted) || !model.identities.is_empty();
        assert!(expects, "{file} expects nothing");
        for e in &expectations {
            let source = std::path::Path::new(e.source.split(',').next().unwrap());
            assert!(!e.source.starts_with("tests/") || source.exists(), "{file}: no file {source:?}");
            for (name, miss, unclaimed) in misses(&file, &with(&document, &e.set), e) {
                let place = format!("{file} {:?} {:?}: {name} misses {} by {miss:.1e}", e.set, e.at, e.source);
                if e.refuted {
                    assert!(miss > e.relative, "{place}: it holds after all");
                } else {
                    assert!(miss <= e.relative, "{place}");
                    assert!(!unclaimed, "{place}, more than is claimed");
                }
            }
        }
    }
}

/// A number in a text, the first one after `from`, times `factor`.
fn scaled(text: &str, from: usize, factor: f64) -> String {
    let number = |c: char| c.is_ascii_digit() || c == '.';
    let start = from + text[from..].find(number).expect("a number");
    let end = text[start..].find(|c| !number(c)).map_or(text.len(), |n| start + n);
    format!("{}{}{}", &text[..start], text[start..end].parse::<f64>().unwrap() * factor, &text[end..])
}

/// The settings of an expectation, and those of a problem whose modulus is another by `factor`.
fn stiffer(model: &Model, e: &Expectation, factor: f64) -> Vec<(String, String)> {
    let mut settings = e.set.clone();
    match settings.iter_mut().find(|(key, _)| key == "material") {
        // The first constant of every law is a modulus.
        Some((_, law)) => *law = scaled(law, law.find(':').expect("a constant"), factor),
        None => set(&mut settings, model, "G", factor),
    }
    settings
}

/// Another value of a parameter, by `factor`.
fn set(settings: &mut Vec<(String, String)>, model: &Model, name: &str, factor: f64) {
    let (_, value) = model.parameters.iter().find(|p| p.0 == name).unwrap_or_else(|| panic!("no parameter {name}"));
    match settings.iter_mut().find(|(key, _)| key == name) {
        Some((_, text)) => *text = format!("{}", text.parse::<f64>().unwrap() * factor),
        None => settings.push((name.into(), format!("{}", value * factor))),
    }
}

#[test]
fn no_expectation_holds_for_another_membrane() {
    for file in shipped() {
        let document = read(&file);
        let model = resolve(&document);
        for e in model.expectations.iter().filter(|e| !e.refuted) {
            let missed = |settings: &[(String, String)]| {
                let worst = misses(&file, &with(&document, settings), e).iter().map(|m| m.1).fold(0.0, f64::max);
                println!("{file} {settings:?}: misses by {worst:.1e}");
                assert!(worst > 10.0 * e.relative, "{file} {settings:?}: {} is met within {worst:.1e}", e.source);
            };
            missed(&stiffer(&model, e, 1.001));
            let mut settings = e.set.clone();
            let radius = if model.parameters.iter().any(|p| p.0 == "r0") { "r0" } else { "R" };
            set(&mut settings, &model, radius, 1.0 + 1e-6);
            missed(&settings);
        }
    }
}

/// A number with six digits; what is nearly nothing depends on rounding.
fn six(value: f64) -> String {
    if value.abs() < 1e-9 { "0".into() } else { format!("{value:.5e}") }
}

/// Two digits of a count, so that the last bit of a library function does not show.
fn about(count: usize) -> usize {
    let unit = 10_usize.pow((count.max(1).ilog10()).saturating_sub(1));
    (count + unit / 2) / unit * unit
}

#[test]
fn what_every_branch_gives_and_costs() {
    for file in shipped() {
        let model = resolve(&read(&file));
        let outcome = run(&model, None);
        let mut text = String::new();
        let total = |of: &dyn Fn(&membrane::run::Point) -> usize| about(outcome.points.iter().map(of).sum());
        let states = outcome.points.len();
        let _ = writeln!(text, "{states} states; totals over the branch, to two digits:");
        let _ = writeln!(text, "  Newton iterations {}", total(&|p| p.work.effort.iterations));
        let _ = writeln!(text, "  factorisations    {}", total(&|p| p.work.effort.factorisations));
        let _ = writeln!(text, "  intervals         {}", total(&|p| p.work.intervals));
        for event in &outcome.events {
            let _ = writeln!(text, "event: {} of {}", event.kind, event.of);
        }
        let quarters = [0, states / 4, states / 2, 3 * states / 4, states - 1];
        for (i, q) in model.quantities.iter().enumerate() {
            let values: Vec<String> = quarters
                .iter()
                .map(|&p| outcome.points[p].solution.quantities[i].map_or("-".into(), |m| six(m.value)))
                .collect();
            let _ = writeln!(text, "{:16}{}", q.name, values.iter().map(|v| format!(" {v:>13}")).collect::<String>());
        }
        let last = &outcome.points[states - 1].solution.infinite;
        let _ = writeln!(text, "infinite: {}", last.join(", "));
        insta::assert_snapshot!(format!("branch_{}", stem(&file)), text);
    }
}

#[test]
fn ron_and_json_say_the_same_bit_for_bit() {
    for file in shipped() {
        let document = read(&file);
        let json = convert::write(&document.problem, Syntax::Json).unwrap();
        let twin = parse("twin.json", json, Syntax::Json);
        assert_eq!(document.problem, twin.problem, "{file}");
        let (a, b) = (run(&resolve(&document), None), run(&resolve(&twin), None));
        assert_eq!(a.points.len(), b.points.len(), "{file}");
        for (a, b) in a.points.iter().zip(&b.points) {
            let bits = |s: &membrane::solution::Solution| -> Vec<u64> {
                let numbers = s.quantities.iter().flatten().flat_map(|m| [m.value, m.error]);
                numbers.chain(s.state.iter().copied()).map(f64::to_bits).collect()
            };
            assert_eq!(bits(&a.solution), bits(&b.solution), "{file}");
            assert_eq!(a.work.effort, b.work.effort, "{file}");
        }
    }
}

#[test]
fn the_schema_accepts_every_problem() {
    let schema = serde_json::from_str(&std::fs::read_to_string("schema/membrane.schema.json").unwrap()).unwrap();
    let (mut compiler, mut schemas) = (boon::Compiler::new(), boon::Schemas::new());
    compiler.add_resource("membrane.json", schema).unwrap();
    let schema = compiler.compile("membrane.json", &mut schemas).unwrap();
    for file in shipped() {
        let text = convert::write(&read(&file).problem, Syntax::Json).unwrap();
        let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
        if let Err(error) = schemas.validate(&value, schema) {
            panic!("{file}: {error:#}");
        }
        value["no such key"] = 1.into();
        assert!(schemas.validate(&value, schema).is_err(), "{file}: an unknown key is accepted");
    }
}
