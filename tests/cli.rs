//! The program as its users and their scripts meet it: every command, every exit code, both formats.

mod common;

use common::program::{command, fed, file, membrane};
use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::Command;
use std::time::{Duration, Instant};

/// An empty directory of a test's own.
fn directory(name: &str) -> PathBuf {
    common::program::directory(&format!("cli_{name}"))
}

const PLATES: &str = "problems/flat_plates.ron";
/// A branch of two states, for tests that are not about numbers.
const SHORT: &str = "branch=(control: \"hbar\", at: [0.9, 0.8])";

/// Text with every number rounded to six digits, so that a snapshot does not depend on rounding.
fn rounded(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(|c: char| c.is_ascii_digit()) {
        let inside_word = rest[..start].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        let tail = &rest[start..];
        let mut end = tail.find(|c: char| !(c.is_ascii_digit() || ".e-".contains(c))).unwrap_or(tail.len());
        while end > 1 && tail[..end].parse::<f64>().is_err() {
            end -= 1;
        }
        out += &rest[..start];
        let word = &tail[..end];
        match word.parse::<f64>() {
            // Errors and mismatches are as large as rounding makes them.
            Ok(value) if !inside_word && value != 0.0 && value.abs() < 1e-7 => out += "TINY",
            Ok(value) if !inside_word && word.len() > 7 => out += &format!("{value:.5e}"),
            _ => out += word,
        }
        rest = &tail[end..];
    }
    out + rest
}

#[test]
fn help_version_and_bad_usage() {
    assert!(membrane(&["--help"]).exits(0).out.contains("Exit codes: 0"));
    assert!(membrane(&["--version"]).exits(0).out.starts_with("membrane "));
    for bad in [
        &[][..],
        &["run"],
        &["solve", PLATES],
        &["run", PLATES, "--format", "xml"],
        &["run", PLATES, "--set", "r0"],
        &["run", PLATES, "--at", "=2"],
        &["check"],
        &["convert", PLATES],
    ] {
        let ran = membrane(bad).exits(2);
        assert!(ran.err.contains("Usage") || ran.err.contains("--help"), "{}", ran.err);
    }
}

#[test]
fn run_prints_a_table_that_fits_and_says_how_good_it_is() {
    let ran = membrane(&["run", PLATES]).exits(0);
    assert!(ran.err.is_empty(), "no progress without a terminal: {}", ran.err);
    assert!(ran.out.lines().all(|line| line.chars().count() <= 120));
    assert!(ran.out.contains("(25 of 50 states; all of them with --format json or --out DIR)"));
    let table = ran.out.lines().filter(|l| l.starts_with(" 0.")).count();
    assert_eq!(table, 25);
    assert!(ran.out.contains("Every state is admissible."));
    let short = membrane(&["run", PLATES, "--set", SHORT]).exits(0);
    let text: Vec<&str> =
        short.out.lines().filter(|l| !l.starts_with("Largest") && !l.starts_with("Relative")).collect();
    insta::assert_snapshot!("run_flat_plates", rounded(&text.join("\n")));
}

#[test]
fn infinite_quantities_are_named_once() {
    let ran = membrane(&["run", "problems/two_cones.ron", "--at", "dbar=0.2", "--at", "dbar=0.3"]).exits(0);
    let lines: Vec<&str> = ran.out.lines().filter(|l| l.contains("nfinite")).collect();
    assert_eq!(lines.len(), 1, "{}", ran.out);
    assert!(lines[0].contains("at the tip of cone: lambda, mu"), "{}", lines[0]);
}

#[test]
fn the_result_document_has_what_it_promises() {
    let ran = membrane(&["run", PLATES, "--set", SHORT, "--format", "json"]).exits(0);
    let document = ran.json();
    assert_eq!(document["schema_version"], 1);
    assert_eq!(document["program"]["name"], "membrane");
    assert_eq!(document["program"]["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(document["status"], "complete");
    assert_eq!(document["problem"]["accuracy"], 1e-9);
    assert_eq!(document["problem"]["wrinkling"], "Report");
    assert_eq!(document["events"], serde_json::json!([]));
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 2);
    assert_eq!((&points[0]["reason"], &points[1]["reason"]), (&"step".into(), &"end".into()));
    for point in points {
        assert_eq!(point["stage"], "plate");
        for name in ["G", "r0", "hbar", "p_f", "force", "phi_c", "u_c", "u_max", "energy", "P_i", "lambda_i", "p_f0"] {
            let value = point["quantities"][name].as_f64().unwrap_or_else(|| panic!("{name}"));
            if let Some(error) = point["certificate"]["error"][name].as_f64() {
                assert!(error <= 1e-9 * value.abs(), "{name}: {error}");
            } else {
                assert!(["G", "r0"].contains(&name), "{name} has no error");
            }
        }
        for name in ["first_integral", "force_balance", "virtual_work"] {
            assert!(point["certificate"][name].as_f64().unwrap() < 1e-7, "{name}");
        }
        assert_eq!(point["certificate"]["admissible"], true);
        assert_eq!(point["certificate"]["violations"], serde_json::json!([]));
        for name in ["newton_iterations", "factorisations", "intervals"] {
            assert!(point["work"][name].as_u64().unwrap() > 0, "{name}");
        }
        assert!(point["work"]["cpu_seconds"].as_f64().unwrap() > 0.0);
        assert!(point.get("profiles").is_none());
    }
    assert_eq!(points[1]["quantities"]["hbar"], 0.8);
}

#[test]
fn the_problem_in_a_result_runs_again_to_the_same_numbers() {
    let first = membrane(&["run", PLATES, "--set", SHORT, "--set", "r0=1.7", "--format", "json"]).exits(0).json();
    let again = fed(&["run", "-", "--from", "json", "--format", "json"], &first["problem"].to_string()).exits(0).json();
    assert_eq!(first["problem"], again["problem"]);
    for (a, b) in first["points"].as_array().unwrap().iter().zip(again["points"].as_array().unwrap()) {
        assert_eq!(a["quantities"], b["quantities"]);
    }
}

#[test]
fn at_gives_the_states_that_are_asked_for_in_order() {
    let ran = membrane(&["run", PLATES, "--at", "hbar=0.5", "--at", "hbar=2^(-1/2)", "--format", "json"]).exits(0);
    let document = ran.json();
    let points = document["points"].as_array().unwrap();
    assert_eq!(points.len(), 2);
    for (point, value) in points.iter().zip([0.5, 0.5_f64.sqrt()]) {
        assert_eq!(point["reason"], "at");
        assert_eq!(point["at"]["name"], "hbar");
        assert_eq!(point["at"]["value"], value);
        assert!((point["quantities"]["hbar"].as_f64().unwrap() - value).abs() < 1e-13);
    }
    // Exact on the contact disc.
    let q = |name: &str| points[0]["quantities"][name].as_f64().unwrap();
    assert!((q("force") / (std::f64::consts::PI * q("p_f") * q("u_c").powi(2)) - 1.0).abs() < 1e-9);
}

#[test]
fn every_crossing_counts_and_what_is_never_met_is_said_with_its_range() {
    let ran =
        membrane(&["run", "problems/sphere_inflation.ron", "--at", "p=1", "--at", "stretch=2", "--format", "json"]);
    let document = ran.exits(0).json();
    let points = document["points"].as_array().unwrap();
    let value = |i: usize, name: &str| points[i]["quantities"][name].as_f64().unwrap();
    assert_eq!(points.len(), 3, "the pressure is met before and after its limit point");
    for i in 0..2 {
        let l = value(i, "stretch");
        assert!((2.0 * (1.0 / l - l.powi(-7)) - 1.0).abs() < 1e-8, "{l} is no closed form");
    }
    assert!(value(0, "stretch") < value(1, "stretch") - 0.5);
    assert_eq!(points[2]["at"]["name"], "stretch");

    let ran = membrane(&["run", PLATES, "--at", "force=300", "--at", "force=3", "--format", "json"]).exits(1);
    let document = ran.json();
    let message = document["message"].as_str().unwrap();
    assert!(message.contains("force = 300") && message.contains("26.8342"), "{message}");
    assert_eq!(document["points"].as_array().unwrap().len(), 1);
}

#[test]
fn limit_points_are_reported_as_states_and_events() {
    let document = membrane(&["run", "problems/sphere_inflation.ron", "--format", "json"]).exits(0).json();
    let event = &document["events"][0];
    assert_eq!((&event["kind"], &event["of"]), (&"fold".into(), &"p".into()));
    let stretch = 7.0_f64.powf(1.0 / 6.0);
    assert!((event["quantities"]["stretch"].as_f64().unwrap() / stretch - 1.0).abs() < 1e-7);
    assert!(document["points"].as_array().unwrap().iter().any(|p| p["reason"] == "fold"));
    let text = membrane(&["run", "problems/sphere_inflation.ron"]).exits(0).out;
    assert!(text.contains("Event: fold of p: p = 1.23946") && text.contains("\n fold "), "{text}");
}

#[test]
fn at_refuses_what_cannot_be_asked_for_all_at_once() {
    let ran = membrane(&["run", PLATES, "--at", "r0=3", "--at", "forc=1", "--at", "force=3*x", "--at", "p_f=1/0"]);
    let err = ran.exits(2).err;
    for part in ["parameter-asked", "--set r0=", "unknown-name", "did you mean `force`?", "u_max", "`x`", "not-finite"]
    {
        assert!(err.contains(part), "{part} is missing: {err}");
    }
}

#[test]
fn a_state_that_does_not_exist_is_a_result_with_code_1() {
    let ran = membrane(&["run", PLATES, "--at", "hbar=0.9", "--at", "hbar=-0.5", "--format", "json"]).exits(1);
    assert!(ran.err.starts_with("incomplete: "), "{}", ran.err);
    let document = ran.json();
    assert_eq!(document["status"], "incomplete");
    assert!(document["message"].as_str().unwrap().contains("hbar"), "{}", document["message"]);
    assert_eq!(document["points"].as_array().unwrap().len(), 1, "what was found is written");
    let text = membrane(&["run", PLATES, "--at", "hbar=0.9", "--at", "hbar=-0.5"]).exits(1);
    assert!(text.out.contains("\nIncomplete: ") && text.out.contains(" 0.9 "), "{}", text.out);
}

#[test]
fn set_changes_parameters_in_their_unit_and_keys() {
    let run = |sets: &[&str]| {
        let mut arguments = vec!["run", "problems/two_cones.ron", "--at", "dbar=0.3", "--format", "json"];
        sets.iter().for_each(|s| arguments.extend(["--set", s]));
        membrane(&arguments).exits(0).json()
    };
    let force = |document: &Value| document["points"][0]["quantities"]["force"].as_f64().unwrap();
    let plain = run(&[]);
    let degrees = run(&["cone_angle=20*2"]);
    assert_eq!(degrees["points"][0]["quantities"]["cone_angle"], 40.0);
    assert!((force(&degrees) / force(&plain) - 1.0).abs() < 1e-9);
    assert!((force(&run(&["G=3"])) / force(&plain) - 3.0).abs() < 1e-7);
    let several = run(&["r0=3", "r0=2", "accuracy=1e-7"]);
    assert_eq!(several["problem"]["parameters"]["r0"], 2);
    assert_eq!(several["problem"]["accuracy"], 1e-7);
    assert!((force(&several) / force(&plain) - 1.0).abs() < 1e-7);
    let other = run(&["material=MooneyRivlin(c1: 0.5, c2: 0.05)"]);
    assert!((force(&other) / force(&plain) - 1.0).abs() > 1e-3);
    assert!(other["points"][0]["quantities"].get("tip_coefficient").is_none());
}

#[test]
fn set_refuses_with_the_list_of_keys() {
    let err = membrane(&["run", PLATES, "--set", "r1=3", "--set", "hbar=0.5"]).exits(2).err;
    for part in ["`r1`", "did you mean `r0`?", "parameters: G, r0", "material", "--at hbar=0.5"] {
        assert!(err.contains(part), "{part} is missing: {err}");
    }
    let err = membrane(&["run", PLATES, "--set", "material=Rubber(1)"]).exits(2).err;
    assert!(err.contains("--set material") && err.contains("NeoHookean"), "{err}");
    assert!(membrane(&["run", PLATES, "--set", "r0=2*"]).exits(2).err.contains("r0"));
}

#[test]
fn settings_that_are_wrong_are_all_reported_at_once() {
    let cone = "problems/cone_on_flat.ron";
    let sets = ["r0=0.5", "G=-1", "cone_angle=95", "r2=1"];
    let arguments: Vec<&str> = ["run", cone].into_iter().chain(sets.iter().flat_map(|set| ["--set", set])).collect();
    let err = membrane(&arguments).exits(2).err;
    for part in ["initial sphere of radius 0.5", "shear modulus must be positive", "not 95.000000 degrees", "`r2`"] {
        assert!(err.contains(part), "{part} is missing: {err}");
    }
    assert_eq!(err.matches("error[").count(), 4, "{err}");
}

#[test]
fn out_writes_whole_files_and_nothing_else() {
    let directory = directory("out");
    let out = directory.join("a/b");
    let path = out.to_str().unwrap();
    let ran = membrane(&["run", PLATES, "--set", SHORT, "--out", path, "--profiles"]).exits(0);
    assert!(ran.out.is_empty());
    assert!(ran.err.contains("2 states in ") && ran.err.contains("branch.csv"), "{}", ran.err);
    let mut names: Vec<String> =
        fs::read_dir(&out).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    assert_eq!(names, ["branch.csv", "profiles.csv", "result.json"]);

    let result: Value = serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
    let branch = fs::read_to_string(out.join("branch.csv")).unwrap();
    let lines: Vec<Vec<&str>> = branch.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[0][..3], ["point", "reason", "stage"]);
    for (name, cell) in lines[0].iter().zip(&lines[2]).skip(3) {
        let point = &result["points"][1];
        let expected = match name.strip_prefix("err_") {
            Some(name) => &point["certificate"]["error"][name],
            None => &point["quantities"][name],
        };
        assert_eq!(cell.parse::<f64>().unwrap(), expected.as_f64().unwrap(), "{name}: the same bits");
    }

    let profiles = fs::read_to_string(out.join("profiles.csv")).unwrap();
    let mut lines = profiles.lines();
    assert_eq!(lines.next(), Some("point,segment,phi,S,u,h,tau,lambda,mu,w_l,w_m,p_c"));
    let rows: Vec<Vec<&str>> = lines.map(|l| l.split(',').collect()).collect();
    let in_json: usize =
        result["points"].as_array().unwrap().iter().map(|p| p["profiles"].as_array().unwrap().len()).sum();
    assert_eq!(rows.len(), in_json);
    assert_eq!(rows[0][..2], ["0", "plate"]);
    assert!(rows.iter().all(|r| r.len() == 12 && (r[1] == "plate") != r[11].is_empty()), "p_c where there is contact");

    // An earlier result is replaced; one that cannot be replaced is an error that leaves no half files.
    membrane(&["run", PLATES, "--at", "hbar=0.7", "--out", path]).exits(0);
    assert_eq!(fs::read_to_string(out.join("branch.csv")).unwrap().lines().count(), 2);
    fs::remove_file(out.join("branch.csv")).unwrap();
    fs::create_dir(out.join("branch.csv")).unwrap();
    assert!(membrane(&["run", PLATES, "--at", "hbar=0.7", "--out", path]).exits(2).err.contains("cannot be written"));
    assert!(fs::read_dir(&out).unwrap().all(|e| !e.unwrap().file_name().to_str().unwrap().contains("tmp")));
    membrane(&["run", PLATES, "--at", "hbar=0.7", "--out", out.join("result.json").to_str().unwrap()]).exits(2);
}

#[test]
fn profiles_are_the_membrane() {
    let document = membrane(&["run", PLATES, "--at", "hbar=0.6", "--profiles", "--format", "json"]).exits(0).json();
    let point = &document["points"][0];
    let q = |name: &str| point["quantities"][name].as_f64().unwrap();
    let rows = point["profiles"].as_array().unwrap();
    let n = |row: &Value, name: &str| row[name].as_f64().unwrap();
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-8, "{a} is not {b}");
    let edge = rows.iter().position(|r| r["segment"] == "side").unwrap();
    for row in &rows[edge - 1..=edge] {
        close(n(row, "phi"), q("phi_c"));
        close(n(row, "u"), q("u_c"));
        close(n(row, "h"), -0.6 * 2.0);
        close(n(row, "tau"), 0.0);
    }
    for row in &rows[..edge] {
        close(n(row, "p_c"), q("p_f")); // flat: the plate carries the pressure of the fluid
        close(n(row, "h"), -1.2);
    }
    let last = rows.last().unwrap();
    close(n(last, "u"), q("u_max"));
    close(n(last, "h"), 0.0);
    close(n(last, "tau"), std::f64::consts::FRAC_PI_2);
    assert!(rows[edge..].iter().all(|r| r["p_c"].is_null()));
    // Heights in between are those of the meridian: chords are no longer than arcs, and nearly as long.
    for pair in rows[edge..].windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let chord = (n(b, "u") - n(a, "u")).hypot(n(b, "h") - n(a, "h"));
        let arc = 0.5 * (n(a, "lambda") + n(b, "lambda")) * (n(b, "S") - n(a, "S"));
        assert!((chord / arc - 1.0).abs() < 0.05, "{chord} {arc}");
    }
}

#[test]
fn standard_input_is_a_file() {
    let text = fs::read_to_string(PLATES).unwrap();
    fed(&["check", "-"], &text).exits(0);
    assert!(fed(&["run", "-", "--at", "hbar=0.9"], &text).exits(0).out.contains("Flat plates"));
    let err = fed(&["check", "-"], &text.replace("Incompressible", "Incomprssible")).exits(2).err;
    assert!(err.contains("<stdin>:") && err.contains("did you mean `Incompressible`?"), "{err}");
    fed(&["check", "-", "--from", "json"], &text).exits(2);
}

#[test]
fn two_errors_in_one_file_are_reported_together() {
    let directory = directory("two_errors");
    let text = fs::read_to_string(PLATES).unwrap();
    let text = text.replace("\"plate.force\"", "\"plat.force\"").replace("\"side.end.u\"", "\"side.end.radius\"");
    let path = file(&directory, "two.ron", &text);
    let place = |part: &str| 1 + text[..text.find(part).unwrap()].matches('\n').count();
    for command in ["run", "check"] {
        let err = membrane(&[command, &path]).exits(2).err;
        assert!(err.contains("plat.force") && err.contains("side.end.radius"), "{err}");
        assert!(err.contains(&format!("two.ron:{}:", place("plat.force"))), "{err}");
    }
    let ran = membrane(&["check", &path, PLATES, "--format", "json"]).exits(2);
    let document = ran.json();
    let list = document["diagnostics"].as_array().unwrap();
    assert_eq!(list.len(), 2);
    for (diagnostic, part) in list.iter().zip(["plat.force", "side.end.radius"]) {
        assert_eq!(diagnostic["severity"], "error");
        assert_eq!(diagnostic["file"], path);
        assert_eq!(diagnostic["line"], place(part));
        assert!(diagnostic["column"].as_u64().unwrap() > 1);
        assert!(!diagnostic["code"].as_str().unwrap().is_empty() && diagnostic.get("help").is_some());
    }
}

#[test]
fn check_counts_and_says_so() {
    let ran = membrane(&["check", PLATES, "problems/two_cones.ron"]).exits(0);
    assert!(ran.err.is_empty());
    assert_eq!(ran.out.lines().count(), 2);
    let document = membrane(&["check", PLATES, "--format", "json"]).exits(0).json();
    assert_eq!(document["diagnostics"], serde_json::json!([]));
    let (unknowns, conditions) = (&document["ledger"]["unknowns"], &document["ledger"]["conditions"]);
    assert_eq!(unknowns.as_array().unwrap().len(), conditions.as_array().unwrap().len());
    for name in ["deficiency", "dependent", "free", "closing"] {
        assert!(document["rank"].get(name).is_some(), "{name}");
    }
    let missing = fs::read_to_string(PLATES).unwrap().replace("fluid: Incompressible,", "");
    let document = fed(&["check", "-", "--format", "json"], &missing).exits(2).json();
    assert!(!document["diagnostics"].as_array().unwrap().is_empty());
    // The count is there also where it does not close.
    let more = "fluid: Incompressible, constraints: { \"more\": \"side.end.u = 2\" }";
    let many = fs::read_to_string(PLATES).unwrap().replace("fluid: Incompressible", more);
    let document = fed(&["check", "-", "--format", "json"], &many).exits(2).json();
    let count = |what: &str| document["ledger"][what].as_array().unwrap().len();
    assert_eq!(count("unknowns") + 1, count("conditions"), "{}", document["diagnostics"]);
    // Not where a condition could not be read: it would look like a missing one.
    let unread = fs::read_to_string(PLATES).unwrap().replace("fluid: Incompressible", "fluid: Volume(\"nothing\")");
    let document = fed(&["check", "-", "--format", "json"], &unread).exits(2).json();
    assert_eq!(document["ledger"], serde_json::json!({ "unknowns": [], "conditions": [] }));
}

#[test]
fn warnings_are_shown_by_every_command_and_refuse_nothing() {
    let text = fs::read_to_string(PLATES).unwrap().replace("parameters: {", "parameters: { \"spare\": 1,");
    let line = 1 + text[..text.find("\"spare\"").unwrap()].matches('\n').count();
    let said = |err: &str| {
        assert!(err.contains("warning[unused-parameter]") && err.contains("`spare`"), "{err}");
        assert!(err.contains(&format!(":{line}:")), "{err}");
    };
    let ran = fed(&["check", "-"], &text).exits(0);
    said(&ran.err);
    assert!(ran.out.contains("independent"), "{}", ran.out);
    said(&fed(&["run", "-", "--set", SHORT], &text).exits(0).err);
    said(&fed(&["explain", "-"], &text).exits(0).err);
    let document = fed(&["check", "-", "--format", "json"], &text).exits(0).json();
    let list = document["diagnostics"].as_array().unwrap();
    assert_eq!(list.len(), 1);
    assert_eq!((&list[0]["severity"], &list[0]["line"]), (&Value::from("warning"), &Value::from(line)));
    // Beside an error it is reported as well.
    let document = fed(&["check", "-", "--format", "json"], &text.replace("plate.force", "plat.force")).exits(2).json();
    assert_eq!(document["diagnostics"].as_array().unwrap().len(), 2);
}

#[test]
fn hostile_files_are_refused_within_seconds() {
    let directory = directory("hostile");
    fs::create_dir(directory.join("directory.ron")).unwrap();
    let utf16: Vec<u8> = fs::read_to_string(PLATES).unwrap().encode_utf16().flat_map(u16::to_le_bytes).collect();
    let paths = [
        (directory.join("missing.ron").to_str().unwrap().to_owned(), "unreadable"),
        (directory.join("directory.ron").to_str().unwrap().to_owned(), "directory"),
        (file(&directory, "empty.ron", ""), "empty-file"),
        (file(&directory, "empty.json", " \n"), "empty-file"),
        (file(&directory, "wide.ron", [b"\xff\xfe".to_vec(), utf16].concat()), "not-utf8"),
        (file(&directory, "large.ron", vec![b' '; 30_000_000]), "file-too-large"),
        (file(&directory, "open.ron", "(".repeat(10_000_000)), "too-deep"),
        (file(&directory, "open.json", "[".repeat(10_000_000)), "too-deep"),
        (file(&directory, "problem.toml", "a = 1"), "unknown-extension"),
        (file(&directory, "noise.ron", [0xf0, 0x9f, 0x00, 0xff]), "not-utf8"),
    ];
    for (path, code) in &paths {
        for command in ["run", "check", "explain"] {
            let begun = Instant::now();
            let ran = membrane(&[command, path]).exits(2);
            assert!(ran.err.contains(&format!("error[{code}]")), "{path}: {}", ran.err);
            assert!(ran.err.len() < 5000 && ran.out.is_empty());
            assert!(begun.elapsed() < Duration::from_secs(5), "{path}");
        }
    }
    let all: Vec<&str> = ["check", "--format", "json"].into_iter().chain(paths.iter().map(|p| p.0.as_str())).collect();
    let document = membrane(&all).exits(2).json();
    let list = document["diagnostics"].as_array().unwrap();
    assert!(paths.iter().all(|p| list.iter().any(|d| d["file"] == p.0 && d["code"] == p.1)));
}

#[test]
fn convert_keeps_the_values_both_ways() {
    let directory = directory("convert");
    let (json, ron) = (directory.join("a.json"), directory.join("b.ron"));
    let (json, ron) = (json.to_str().unwrap(), ron.to_str().unwrap());
    for problem in ["problems/flat_plates.ron", "problems/sphere_inflation.ron"] {
        membrane(&["convert", problem, json]).exits(0);
        membrane(&["convert", json, ron]).exits(0);
        let result = |path: &str| membrane(&["run", path, "--format", "json"]).exits(0).json();
        let (a, b) = (result(problem), result(ron));
        assert_eq!(a["problem"], b["problem"]);
        assert_eq!(a["points"][0]["quantities"], b["points"][0]["quantities"]);
    }
    membrane(&["convert", ron, ron]).exits(2);
    membrane(&["convert", ron, directory.join("c.txt").to_str().unwrap()]).exits(2);
    membrane(&["convert", ron, directory.join("no/such/c.json").to_str().unwrap()]).exits(2);
    membrane(&["convert", directory.join("none.ron").to_str().unwrap(), json]).exits(2);
}

#[test]
fn new_writes_a_file_that_runs_and_replaces_none() {
    let directory = directory("new");
    let name = directory.join("my \"balloon\"");
    let name = name.to_str().unwrap();
    let path = format!("{name}.ron");
    membrane(&["new", name]).exits(0);
    membrane(&["check", &path]).exits(0);
    assert!(membrane(&["run", &path]).exits(0).out.starts_with("my \"balloon\"\n"));
    let before = fs::read(&path).unwrap();
    for again in [name, &path] {
        assert!(membrane(&["new", again]).exits(2).err.contains("exists already"));
    }
    assert_eq!(fs::read(&path).unwrap(), before);
    membrane(&["new", directory.join("no/such/a").to_str().unwrap()]).exits(2);
    membrane(&["new", ""]).exits(2);
}

#[test]
fn schema_is_the_one_that_stands_in_the_tree() {
    assert_eq!(membrane(&["schema"]).exits(0).out, fs::read_to_string("schema/membrane.schema.json").unwrap());
}

#[test]
fn explain_lists_what_is_solved() {
    let ran = membrane(&["explain", PLATES]).exits(0);
    insta::assert_snapshot!("explain_flat_plates", rounded(&ran.out));
    assert!(membrane(&["explain", PLATES, "--set", "r0=3"]).exits(0).out.contains("| r0   | 3 "));
}

/// A file whose elements appear by events: what each event changes stands there as well.
#[test]
fn explain_tells_what_an_event_changes() {
    let ran = membrane(&["explain", "problems/micropipette.ron"]).exits(0);
    let start = ran.out.find("## Event").expect("an event");
    let event = &ran.out[start..start + ran.out[start..].find("\n## Branch").expect("the branch comes after it")];
    insta::assert_snapshot!("explain_event_of_micropipette", event);
    assert!(!membrane(&["explain", PLATES]).exits(0).out.contains("## Event"));
}

#[test]
fn a_closed_pipe_is_no_mistake() {
    let long = "branch=(control: \"hbar\", from: 0.98, to: 0.9, steps: 100)";
    let mut child = command(&["run", PLATES, "--set", long, "--format", "json", "--profiles"]).spawn().unwrap();
    let mut reader = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    reader.read_line(&mut line).unwrap();
    drop(reader);
    assert_eq!(line, "{\n");
    let mut err = String::new();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{err}");
    assert!(err.is_empty(), "{err}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_writes_what_it_found() {
    let directory = directory("interrupt");
    let out = directory.join("out");
    let endless = "branch=(control: \"hbar\", from: 0.98, to: 0.4, steps: 1000000)";
    let child = command(&["run", PLATES, "--set", endless, "--out", out.to_str().unwrap()]).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("interrupted") && err.contains("states in "), "{err}");
    let result: Value = serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(result["status"], "incomplete");
    let lines = fs::read_to_string(out.join("branch.csv")).unwrap().lines().count();
    assert_eq!(lines, 1 + result["points"].as_array().unwrap().len());
    assert!(lines > 1);
}
