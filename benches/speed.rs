//! How long a state takes: `cargo bench`. Prints, and never judges; what must not get slower without a clock is in the work
//! counters of `tests/problems.rs`.
//!
//! The yardstick is C written by hand for one problem (`benches/yardstick`), compiled and timed in turn with the program.

use membrane::model::{self, Model};
use membrane::run::{self, Outcome, Status};
use membrane::spec::{Document, Source, Syntax};
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs of a branch, of which the fastest counts, state by state.
const RUNS: usize = 8;

fn model(file: &str, settings: &[(&str, &str)]) -> Model {
    let text = std::fs::read_to_string(file).expect("a shipped problem");
    let mut document = Document::read(Source { name: file.into(), text, syntax: Syntax::Ron }).expect("a problem");
    for (key, value) in settings {
        document = model::set(&document, key, value).unwrap_or_else(|_| panic!("{key}={value}"));
    }
    model::resolve(&document.problem).expect("a problem")
}

fn branch(model: &Model) -> Outcome {
    let outcome = run::run(model, &[], &mut |_, _| ControlFlow::Continue(()));
    assert_eq!(outcome.status, Status::Complete);
    outcome
}

/// Processor time of each state in microseconds, the least over the runs.
fn least(runs: impl Iterator<Item = Vec<f64>>) -> Vec<f64> {
    runs.reduce(|a, b| a.iter().zip(&b).map(|(a, b)| a.min(*b)).collect()).expect("a run")
}

fn times(outcome: &Outcome) -> Vec<f64> {
    outcome.points.iter().map(|p| 1e6 * p.work.cpu_seconds).collect()
}

fn median(times: &[f64]) -> f64 {
    let mut sorted = times.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

fn report(what: &str, outcome: &Outcome, times: &[f64]) {
    let states = times.len() as f64;
    let per = |of: fn(&run::Work) -> usize| outcome.points.iter().map(|p| of(&p.work)).sum::<usize>() as f64 / states;
    println!(
        "{what:34} {:4} states {:9.1} us/state median {:9.1} us/state mean {:8.1} ms in all; per state {:.1} Newton \
         iterations, {:.1} factorisations, {:.1} intervals",
        times.len(),
        median(times),
        times.iter().sum::<f64>() / states,
        1e-3 * times.iter().sum::<f64>(),
        per(|w| w.effort.iterations),
        per(|w| w.effort.factorisations),
        per(|w| w.intervals),
    );
}

/// The largest relative error of force and pressure against the reference.
fn miss(model: &Model, outcome: &Outcome) -> f64 {
    let data: Value = serde_json::from_str(include_str!("../tests/data/reference/flat_plates.json")).expect("JSON");
    let steps = data["steps"].as_array().expect("a list");
    assert_eq!(steps.len(), outcome.points.len());
    let mut worst = 0.0_f64;
    for (name, key) in [("p_f", "p"), ("force", "F")] {
        let q = model.quantities.iter().position(|q| q.name == name).expect("a quantity");
        for (step, point) in steps.iter().zip(&outcome.points) {
            let expected: f64 = step[key].as_str().expect("digits").parse().expect("a number");
            let found = point.solution.quantities[q].expect("a number").value;
            worst = worst.max((found / expected - 1.0).abs());
        }
    }
    worst
}

/// The yardstick, compiled; nothing where there is no C compiler.
fn compiled() -> Option<PathBuf> {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shooting");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/yardstick/shooting.c");
    let done =
        Command::new("cc").args(["-O3", "-march=native", "-w", "-DMAIN", source, "-lm", "-o"]).arg(&program).status();
    done.is_ok_and(|status| status.success()).then_some(program)
}

/// Processor time of each of the 50 states by the yardstick in microseconds: one run.
fn yardstick(program: &Path) -> Vec<f64> {
    let output = Command::new(program)
        .args(["broyden", "1", "1e-9", "1e-9"])
        .env("PEERS_CLOCK", "cpu")
        .output()
        .expect("the yardstick runs");
    let text = String::from_utf8(output.stdout).expect("numbers");
    text.lines().map(|line| 1e6 * line.split(' ').nth(4).expect("a time").parse::<f64>().expect("a number")).collect()
}

fn main() {
    // Cargo passes `--bench`, and names that are asked for; there is nothing to choose from.
    println!("processor time, least of {RUNS} runs for each state\n");
    let plates = model("problems/flat_plates.ron", &[("accuracy", "1e-8")]);
    let program = compiled();
    if program.is_none() {
        println!("no C compiler (cc) here: the yardstick is left out");
    }
    // In turn, so that both meet the same machine.
    let (mut ours, mut theirs, mut last) = (vec![], vec![], None);
    for _ in 0..RUNS {
        let outcome = branch(&plates);
        ours.push(times(&outcome));
        last = Some(outcome);
        theirs.extend(program.as_deref().map(yardstick));
    }
    let (ours, outcome) = (least(ours.into_iter()), last.expect("a run"));
    report("flat_plates, 1e-8", &outcome, &ours);
    println!("{:34} largest relative error of force and p_f: {:.1e}", "", miss(&plates, &outcome));
    if !theirs.is_empty() {
        let theirs = least(theirs.into_iter());
        println!(
            "{:34} {:4} states {:9.1} us/state median",
            "yardstick: C, shooting, no error",
            theirs.len(),
            median(&theirs)
        );
        println!("{:34} {:.1}", "ratio of the medians", median(&ours) / median(&theirs));
    }
    println!();
    let written = r#"Energy("G/2*(lambda^2 + mu^2 + 1/(lambda*mu)^2 - 3)")"#;
    for (file, what, settings) in [
        ("flat_plates", "flat_plates, 1e-9", &[][..]),
        ("flat_plates", "the same, its law as an Energy", &[("material", written)][..]),
        ("two_cones", "two_cones, 1e-9", &[][..]),
        ("cone_on_flat", "cone_on_flat, 1e-9", &[][..]),
        ("sphere_inflation", "sphere_inflation, 1e-9", &[][..]),
    ] {
        let model = model(&format!("problems/{file}.ron"), settings);
        let mut last = None;
        let times = least((0..RUNS).map(|_| {
            let outcome = branch(&model);
            let times = times(&outcome);
            last = Some(outcome);
            times
        }));
        report(what, &last.expect("a run"), &times);
    }
}
