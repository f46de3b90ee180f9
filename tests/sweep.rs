//! Sweeps as their users meet them: what a grid and a list mean, files that survive the end of their process at any moment, parts
//! that make the whole, and what is said of what cannot be.

mod common;

use common::program::{Ran, command, directory, fed, file, membrane};
use serde_json::{Value, json};
use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::process::Child;
use std::time::{Duration, Instant};

const PLATES: &str = "problems/flat_plates.ron";
const CONE: &str = "problems/cone_on_flat.ron";

/// The rows of a text of lines.
fn rows(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

/// The rows that are states of a case.
fn states(rows: &[Value], case: usize) -> Vec<&Value> {
    rows.iter().filter(|r| r["case"] == case && r["kind"] != "case").collect()
}

/// The last row of a case.
fn verdict(rows: &[Value], case: usize) -> &Value {
    rows.iter().find(|r| r["case"] == case && r["kind"] == "case").unwrap_or_else(|| panic!("no case {case}"))
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A sweep of some cases of some states each, into a directory.
fn sweep<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["run", CONE, "--sweep", "r0=1.2..2:3", "--sweep", "cone_angle=0,20,40"];
    arguments.extend(["--at", "dbar=0.7", "--at", "dbar=0.5", "--out", out.to_str().unwrap()]);
    arguments.extend(more);
    arguments
}

// What a sweep means -------------------------------------------------------------------------------------------------

#[test]
fn a_grid_is_all_combinations_and_each_is_a_run_of_its_own() {
    let grid = ["--sweep", "r0=1.5,2", "--sweep", "cone_angle=0..40:3", "--at", "dbar=0.5", "--format", "json"];
    let found = rows(&membrane(&[&["run", CONE], &grid[..]].concat()).exits(0).out);
    assert_eq!(found.len(), 12, "a state and a last row for each");
    let mut numbers = HashSet::new();
    for (case, (r0, angle)) in
        [(1.5, 0.0), (1.5, 20.0), (1.5, 40.0), (2.0, 0.0), (2.0, 20.0), (2.0, 40.0)].into_iter().enumerate()
    {
        let state = states(&found, case)[0];
        assert_eq!(state["set"], json!({ "r0": r0, "cone_angle": angle }));
        assert_eq!((&state["kind"], &state["at"]), (&json!("at"), &json!({ "name": "dbar", "value": 0.5 })));
        assert_eq!(state["admissible"], true);
        assert!(state["error"]["force"].as_f64().unwrap() < 1e-9 * state["quantities"]["force"].as_f64().unwrap());
        let last = verdict(&found, case);
        assert_eq!((&last["status"], &last["states"], &last["cases"]), (&json!("complete"), &json!(1), &json!(6)));
        let (r0, angle) = (format!("r0={r0}"), format!("cone_angle={angle}"));
        let alone = ["run", CONE, "--set", &r0, "--set", &angle, "--at", "dbar=0.5", "--format", "json"];
        let alone = membrane(&alone).exits(0).json();
        assert_eq!(state["quantities"], alone["points"][0]["quantities"], "every digit of a run of its own");
        assert_eq!(state["error"], alone["points"][0]["certificate"]["error"]);
        numbers.insert(state["quantities"]["force"].to_string());
    }
    assert_eq!(numbers.len(), 6, "the cases differ");
}

#[test]
fn spacings_have_both_ends() {
    let values = |option: &str| -> Vec<f64> {
        let arguments = ["run", PLATES, "--sweep", option, "--at", "hbar=0.9", "--format", "json"];
        let found = rows(&membrane(&arguments).exits(0).out);
        found.iter().filter(|r| r["kind"] == "at").map(|r| r["quantities"]["r0"].as_f64().unwrap()).collect()
    };
    assert_eq!(values("r0=1.5..2:3"), [1.5, 1.75, 2.0]);
    assert_eq!(values("r0=1.5, 3/2 , 2*sqrt(1)"), [1.5, 1.5, 2.0]);
    let log = values("r0=1.25..5:3:log");
    assert_eq!((log[0], log[2]), (1.25, 5.0));
    assert!((log[1] - 2.5).abs() < 1e-14, "{log:?}");
}

/// A problem with a sweep in its file.
fn with_sweep(sweep: &str) -> String {
    text(Path::new(PLATES)).replace("outputs: {", &format!("sweep: {sweep},\n    outputs: {{"))
}

const SHORT: &str = "branch=(control: \"hbar\", at: [0.9, 0.8])";

#[test]
fn cases_change_parameters_and_keys_of_the_root() {
    let list = "Cases([\n{},\n{ \"material\": Skalak(shear_modulus: \"G\", area_ratio: 1), \"r0\": 1.5 },\n\
                { \"fluid\": Compressible(bulk_modulus: 5), \"accuracy\": 1e-7, \"r0\": \"3/2\" }])";
    let text = with_sweep(list);
    let found = rows(&fed(&["run", "-", "--set", SHORT, "--format", "json"], &text).exits(0).out);
    assert_eq!(states(&found, 1)[0]["set"]["material"], json!({ "Skalak": { "shear_modulus": "G", "area_ratio": 1 } }));
    let set = [
        vec![],
        vec!["--set", "material=Skalak(shear_modulus: \"G\", area_ratio: 1)", "--set", "r0=1.5"],
        vec!["--set", "fluid=Compressible(bulk_modulus: 5)", "--set", "accuracy=1e-7", "--set", "r0=1.5"],
    ];
    let mut seen = vec![];
    for (case, set) in set.iter().enumerate() {
        let alone =
            membrane(&[&["run", PLATES, "--set", SHORT, "--format", "json"], &set[..]].concat()).exits(0).json();
        let found = states(&found, case);
        assert_eq!(found.len(), 2);
        for (row, point) in found.iter().zip(alone["points"].as_array().unwrap()) {
            assert_eq!(row["quantities"], point["quantities"], "case {case}");
            assert_eq!(row["kind"], point["reason"]);
        }
        seen.push(found[0]["quantities"]["force"].as_f64().unwrap());
    }
    assert!(seen[0] != seen[1] && seen[1] != seen[2] && seen[0] != seen[2], "{seen:?}");

    // Written as RON or JSON it is the same sweep.
    let directory = directory("sweep_convert");
    let (ron, json) = (file(&directory, "a.ron", &text), directory.join("b.json").to_str().unwrap().to_owned());
    membrane(&["convert", &ron, &json]).exits(0);
    let again = membrane(&["run", &json, "--set", SHORT, "--format", "json"]).exits(0);
    assert_eq!(rows(&again.out), found);
    assert!(membrane(&["explain", &ron]).exits(0).out.contains("each of 3 cases"));
    assert!(membrane(&["check", &ron]).exits(0).out.contains(", 3 cases"));

    // An option replaces the sweep of the file.
    let other = fed(&["run", "-", "--sweep", "r0=1.7", "--at", "hbar=0.9", "--format", "json"], &text).exits(0);
    assert_eq!(rows(&other.out).len(), 2);
}

#[test]
fn results_do_not_depend_on_threads() {
    let directory = directory("sweep_threads");
    let (one, many) = (directory.join("one"), directory.join("many"));
    membrane(&sweep(&one, &["--threads", "1"])).exits(0);
    membrane(&sweep(&many, &["--threads", "5"])).exits(0);
    let written = text(&one.join("sweep.jsonl"));
    assert_eq!(written, text(&many.join("sweep.jsonl")));
    assert_eq!(rows(&written).len(), 9 * 3);
    // The same without a file, in the same order.
    let print = |threads| {
        let arguments: Vec<&str> = sweep(&one, &["--threads", threads, "--format", "json"]);
        let arguments: Vec<&str> =
            arguments.into_iter().filter(|a| *a != "--out" && *a != one.to_str().unwrap()).collect();
        membrane(&arguments).exits(0).out
    };
    assert_eq!(print("1"), written);
    assert_eq!(print("5"), written);
    // Digits do show: another value in its last bit gives other rows.
    let nudged = ["--sweep", "r0=1.2,1.6,2.0000000000000004", "--sweep", "cone_angle=0,20,40"];
    let arguments = [&["run", CONE, "--at", "dbar=0.7", "--at", "dbar=0.5", "--format", "json"], &nudged[..]].concat();
    let nudged = rows(&membrane(&arguments).exits(0).out);
    let numbers = |rows: &[Value], case| states(rows, case)[1]["quantities"].to_string();
    assert_eq!(numbers(&nudged, 0), numbers(&rows(&written), 0));
    assert_ne!(numbers(&nudged, 8), numbers(&rows(&written), 8));
}

#[test]
fn a_table_for_people() {
    let run = ["run", CONE, "--sweep", "r0=1.5,2", "--at", "dbar=0.5"];
    let out = membrane(&run).exits(0).out;
    assert!(out.lines().all(|line| line.chars().count() <= 120), "{out}");
    assert!(out.contains("2 states of 2 cases.") && out.contains("Complete: "), "{out}");
    let force = out.lines().find(|line| line.trim().starts_with("1 ")).unwrap();
    assert!(force.contains("4.060065"), "{out}");
    let wrong = membrane(&["run", CONE, "--sweep", "r0=0.5,2", "--at", "dbar=0.5"]).exits(1).out;
    assert!(wrong.contains("refused") && wrong.contains("Incomplete: ") && wrong.contains("1 cases (0)"), "{wrong}");
}

// What fails ---------------------------------------------------------------------------------------------------------

#[test]
fn a_case_that_fails_is_a_row_with_its_reason_and_stops_no_other() {
    let out = directory("sweep_fails");
    let path = out.to_str().unwrap();
    let sweep = ["run", PLATES, "--sweep", "r0=0.5,2,3", "--at", "hbar=0.9"];
    let ran = membrane(&[&sweep[..], &["--at", "force=30", "--out", path]].concat()).exits(1);
    assert!(ran.err.contains("2 cases were not, or not wholly, solved"), "{}", ran.err);
    let found = rows(&text(&out.join("sweep.jsonl")));
    let first = verdict(&found, 0);
    assert_eq!((&first["status"], &first["states"]), (&json!("refused"), &json!(0)));
    assert!(first["message"].as_str().unwrap().contains("radius 0.5"), "{first}");
    let second = verdict(&found, 1);
    assert_eq!((&second["status"], &second["states"]), (&json!("incomplete"), &json!(1)));
    assert!(second["message"].as_str().unwrap().contains("force = 30 is never met"), "{second}");
    assert_eq!(states(&found, 1).len(), 1, "what was found is there");
    assert_eq!((&verdict(&found, 2)["status"], states(&found, 2).len()), (&json!("complete"), 2));
    // Nothing of it is tried again, and the code is the same.
    let again = [&sweep[..], &["--at", "force=30", "--out", path, "--resume"]].concat();
    assert!(membrane(&again).exits(1).err.contains("(3 were there)"));
    // Without what fails all is well.
    membrane(&["run", PLATES, "--sweep", "r0=2,3", "--at", "hbar=0.9", "--format", "json"]).exits(0);
}

#[test]
fn check_sees_wrong_cases_at_their_places() {
    let line = |text: &str, part: &str| 1 + text[..text.find(part).unwrap()].matches('\n').count();
    let check = |text: &str| {
        let list = fed(&["check", "-", "--format", "json"], text).exits(2).json()["diagnostics"].clone();
        list.as_array().unwrap().clone()
    };
    // A name, a number, a key, a value that is impossible, a constant that is.
    let text = with_sweep(
        "Cases([\n{ \"r0\": 1.5 },\n{ \"r1\": 1.5 },\n{ \"r0\": \"1.5*x\" },\n{ \"materiel\": Skalak(shear_modulus: 1) }])",
    );
    let found = check(&text);
    assert_eq!(found.len(), 1, "words come first: {found:?}");
    assert_eq!((&found[0]["code"], &found[0]["line"]), (&json!("unknown-key"), &json!(line(&text, "\"materiel\""))));
    assert!(found[0]["help"].as_str().unwrap().contains("did you mean `material`?"));

    let text = with_sweep("Cases([\n{ \"r0\": 1.5 },\n{ \"r1\": 1.5 },\n{ \"r0\": \"1.5*x\" },\n{ \"hbar\": 2 }])");
    let found = check(&text);
    let places: Vec<_> = found.iter().map(|d| d["line"].as_u64().unwrap() as usize).collect();
    assert_eq!(places, [line(&text, "\"r1\""), line(&text, "1.5*x"), line(&text, "\"hbar\": 2")], "{found:?}");
    assert!(found[0]["help"].as_str().unwrap().contains("allowed: G, r0"), "{found:?}");
    assert!(found[2]["help"].as_str().unwrap().contains("--at"), "{found:?}");
    fed(&["run", "-"], &text).exits(2);

    let text = with_sweep(
        "Cases([\n{ \"r0\": 1.5 },\n{ \"r0\": 0.5 },\n{ \"material\": NeoHookean(shear_modulus:\n -2) }, { \"r0\": 0.5 }])",
    );
    let found = check(&text);
    let places: Vec<_> = found.iter().map(|d| d["line"].as_u64().unwrap() as usize).collect();
    assert_eq!(places, [line(&text, "0.5 }"), line(&text, "-2")], "{found:?}");
    assert!(found[0]["help"].as_str().unwrap().contains("in case 1 (r0 = 0.5), and in 1 more"), "{found:?}");
    // The same where nothing is wrong.
    let text = with_sweep("Cases([\n{ \"r0\": 1.5 },\n{ \"material\": NeoHookean(shear_modulus:\n 2) }])");
    let ran = fed(&["check", "-"], &text).exits(0);
    assert!(ran.err.is_empty() && ran.out.contains("2 cases"), "{} {}", ran.out, ran.err);
}

#[test]
fn what_cannot_be_a_sweep_is_refused_with_what_could() {
    for (arguments, parts) in [
        (&["--sweep", "r1=1,2"][..], &["error[unknown-name]", "`r1`", "did you mean `r0`?", "allowed: G, r0"][..]),
        (&["--sweep", "hbar=0.5,0.6"], &["error[unknown-name]", "--at"]),
        (&["--sweep", "material=1,2"], &["error[unknown-name]", "Cases"]),
        (&["--sweep", "r0=1.5,,2"], &["error[malformed-sweep]", "a value is missing", "r0=1.1..2:10"]),
        (&["--sweep", "r0=1.5..2"], &["error[malformed-sweep]", "from..to:count"]),
        (&["--sweep", "r0=1.5..2:x"], &["error[malformed-sweep]", "whole number"]),
        (&["--sweep", "r0=1.5..2:3:lin"], &["error[malformed-sweep]", "`lin`"]),
        (&["--sweep", "r0=1.5..2:0"], &["error[out-of-range]", "from 1 to 1000000"]),
        (&["--sweep", "r0=1.5..2:1"], &["error[one-value]"]),
        (&["--sweep", "r0=-1..2:5:log"], &["error[log-spacing]"]),
        (&["--sweep", "r0=1.5,2*y"], &["error[unknown-name]", "`y`"]),
        (&["--sweep", "r0=1,2", "--sweep", "r0=3"], &["error[malformed-sweep]", "swept twice"]),
        (&["--sweep", "r0=1..2:1000", "--sweep", "G=1..2:1001"], &["error[too-many-cases]", "1000000"]),
        (&["--set", "sweep=Cases([])"], &["error[no-cases]"]),
        (&["--set", "sweep=Grid({})"], &["error[no-cases]"]),
        (&["--set", "sweep=Grid({ \"r0\": Values([]) })"], &["error[no-cases]", "`r0`"]),
        (&["--set", "sweep=Grid({ \"r0\": Linear(from: \"1[deg]\", to: 2, count: 3) })"], &["error[unit-misplaced]"]),
        (&["--sweep", "r0=2", "--shard", "3/2"], &["there is no part 3 of 2"]),
        (&["--sweep", "r0=2", "--shard", "0/2"], &["there is no part 0 of 2"]),
        (&["--sweep", "r0=2", "--shard", "2"], &["such as 2/4"]),
        (&["--sweep", "r0=2", "--threads", "0"], &["--threads"]),
        (&["--sweep", "r0=2", "--resume"], &["error[no-file]", "--out DIR"]),
        (&["--sweep", "r0=2", "--resume", "--overwrite"], &["cannot be used with"]),
        (&["--shard", "1/2"], &["error[no-sweep]", "--shard"]),
        (&["--threads", "2"], &["error[no-sweep]", "--threads"]),
    ] {
        let ran = membrane(&[&["run", PLATES], arguments].concat()).exits(2);
        assert!(ran.out.is_empty(), "{}", ran.out);
        for part in parts {
            assert!(ran.err.contains(part), "{arguments:?}: {part} is missing: {}", ran.err);
        }
    }
    membrane(&["run", PLATES, "--sweep", "r0=2", "--shard", "1/2", "--threads", "2", "--at", "hbar=0.9"]).exits(0);
}

// Files --------------------------------------------------------------------------------------------------------------

#[test]
fn four_processes_write_what_one_would() {
    let directory = directory("sweep_shards");
    let (whole, parts) = (directory.join("whole"), directory.join("parts"));
    membrane(&sweep(&whole, &[])).exits(0);
    let shards = ["1/4", "2/4", "3/4", "4/4"];
    let children: Vec<Child> =
        shards.iter().map(|shard| command(&sweep(&parts, &["--shard", shard])).spawn().unwrap()).collect();
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let merge = |more: &[&str]| membrane(&[&["merge", parts.to_str().unwrap()], more].concat());
    let ran = merge(&[]).exits(0);
    assert!(ran.err.contains("9 cases of 4 parts"), "{}", ran.err);
    let merged = parts.join("sweep.jsonl");
    assert_eq!(text(&merged), text(&whole.join("sweep.jsonl")), "every digit");
    assert_eq!(text(&parts.join("problem.json")), text(&whole.join("problem.json")));
    // A finished sweep, as if one process had written it.
    let again = membrane(&sweep(&parts, &["--resume"])).exits(0);
    assert!(again.err.contains("(9 were there)"), "{}", again.err);

    // What does not belong together is no sweep; what is there is not touched without being asked.
    assert!(merge(&[]).exits(2).err.contains("--overwrite"));
    let third = parts.join("sweep-3-of-4.jsonl");
    let kept = text(&third);
    let refused = |part: &str| {
        let err = merge(&["--overwrite"]).exits(2).err;
        assert!(err.contains(part), "{part} is missing: {err}");
        assert_eq!(text(&merged), text(&whole.join("sweep.jsonl")));
    };
    fs::remove_file(&third).unwrap();
    refused("--shard 3/4");
    let lines: Vec<&str> = kept.lines().collect();
    fs::write(&third, lines[..5].join("\n")).unwrap();
    refused("--shard 3/4 --resume");
    fs::write(&third, [&lines[3..], &lines[..3]].concat().join("\n") + "\n").unwrap();
    refused("case 6 where case 2 should be");
    let foreign = kept.replace(rows(&kept)[0]["problem"].as_str().unwrap(), "0123456789abcdef");
    fs::write(&third, &foreign).unwrap();
    refused("another problem");
    fs::write(&third, kept.replace("\"kind\":\"case\"", "\"kind\":\"cas")).unwrap();
    refused("line 3: this is no row");
    let extra = parts.join("sweep-1-of-2.jsonl");
    fs::write(&third, &kept).unwrap();
    fs::write(&extra, &kept).unwrap();
    refused("parts of 2 and parts of 4");
    fs::remove_file(&extra).unwrap();
    // A digit that is another shows in the whole.
    let digit = kept.find("\"force\":").unwrap() + 12;
    let other = if &kept[digit..=digit] == "1" { "2" } else { "1" };
    fs::write(&third, format!("{}{other}{}", &kept[..digit], &kept[digit + 1..])).unwrap();
    merge(&["--overwrite"]).exits(0);
    assert_ne!(text(&merged), text(&whole.join("sweep.jsonl")));
    assert!(membrane(&["merge", directory.to_str().unwrap()]).exits(2).err.contains("there are no files"));
}

/// Enough cases that a process is in the middle of them for a while.
fn long<'a>(out: &'a Path, more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["run", PLATES, "--sweep", "r0=1.2..3:200", "--at", "hbar=0.9", "--at", "force=1"];
    arguments.extend(["--threads", "3", "--out", out.to_str().unwrap()]);
    arguments.extend(more);
    arguments
}

/// Waits until a process has written something.
fn begun(file: &Path) {
    let begin = Instant::now();
    while fs::metadata(file).map_or(0, |m| m.len()) < 20_000 {
        assert!(begin.elapsed() < Duration::from_secs(60), "nothing is written");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_process_that_is_killed_loses_what_was_in_flight() {
    let directory = directory("sweep_killed");
    let (whole, out) = (directory.join("whole"), directory.join("out"));
    membrane(&long(&whole, &[])).exits(0);
    let whole = text(&whole.join("sweep.jsonl"));
    let path = out.join("sweep.jsonl");

    // With --resume there need not be a file.
    let mut child = command(&long(&out, &["--resume"])).spawn().unwrap();
    begun(&path);
    child.kill().unwrap();
    child.wait().unwrap();
    let left = text(&path);
    let complete = left.lines().filter(|line| line.contains("\"kind\":\"case\"")).count();
    assert!(complete > 0 && complete < 200, "killed in the middle: {complete}");
    assert!(left.lines().filter(|line| line.ends_with('}')).all(|line| whole.lines().any(|l| l == line)));

    // Not without being asked, and not with another problem.
    let refused = |arguments: &[&str], code: &str| {
        let ran = membrane(arguments).exits(2);
        assert!(ran.err.contains(&format!("error[{code}]")), "{}", ran.err);
        assert_eq!(text(&path), left, "left as it was");
    };
    refused(&long(&out, &[]), "exists");
    refused(&long(&out, &["--resume", "--set", "G=2"]), "another-problem");
    refused(&long(&out, &["--resume", "--at", "hbar=0.8"]), "another-problem");
    let locked = fs::File::open(&path).unwrap();
    locked.lock().unwrap();
    refused(&long(&out, &["--resume"]), "busy");
    drop(locked);

    // A case without its last row, and half a row, as a process leaves them that is stopped while it writes.
    let row: Vec<&str> = whole.lines().filter(|line| !left.contains(line)).take(2).collect();
    fs::write(&path, format!("{left}{}\n{}", row[0], &row[1][..row[1].len() / 2])).unwrap();
    let ran = membrane(&long(&out, &["--resume"])).exits(0);
    assert!(ran.err.contains(&format!("200 cases ({complete} were there)")), "{}", ran.err);
    assert_eq!(text(&path), whole, "every digit of a run that nobody stopped");

    // A row that was changed is not taken for one.
    let damaged = whole.replacen("{\"case\":3,", "{\"case\":3;", 1);
    fs::write(&path, &damaged).unwrap();
    let line = 1 + whole.lines().position(|line| line.starts_with("{\"case\":3,")).unwrap();
    let err = membrane(&long(&out, &["--resume"])).exits(2).err;
    assert!(err.contains("error[damaged]") && err.contains(&format!("line {line}:")), "{err}");
    let twice = whole.clone() + &whole.lines().take(3).collect::<Vec<_>>().join("\n") + "\n";
    fs::write(&path, &twice).unwrap();
    assert!(membrane(&long(&out, &["--resume"])).exits(2).err.contains("here twice"));
    assert_eq!(text(&path), twice);
    membrane(&long(&out, &["--overwrite"])).exits(0);
    assert_eq!(text(&path), whole);
}

#[cfg(unix)]
#[test]
fn an_interrupted_sweep_says_so_and_can_go_on() {
    let directory = directory("sweep_interrupted");
    let out = directory.join("out");
    let child = command(&long(&out, &["--overwrite"])).spawn().unwrap();
    begun(&out.join("sweep.jsonl"));
    assert!(std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(130), "{err}");
    assert!(err.contains("interrupted") && err.contains("of 200 cases") && err.contains("--resume"), "{err}");
    let left = rows(&text(&out.join("sweep.jsonl")));
    assert_eq!(left.last().unwrap()["kind"], "case", "no half case");
    let Ran { err, .. } = membrane(&long(&out, &["--resume"])).exits(0);
    assert!(err.contains("200 cases ("), "{err}");
    assert_eq!(rows(&text(&out.join("sweep.jsonl"))).len(), 600);
}

#[test]
fn a_part_without_cases_is_no_mistake() {
    let out = directory("sweep_many_parts");
    let path = out.to_str().unwrap();
    for shard in ["1/3", "2/3", "3/3"] {
        membrane(&["run", PLATES, "--sweep", "r0=2,3", "--at", "hbar=0.9", "--out", path, "--shard", shard]).exits(0);
    }
    assert!(membrane(&["merge", path]).exits(0).err.contains("2 cases of 3 parts"));
}

// Three laws ---------------------------------------------------------------------------------------------------------

const LAWS: &str = "problems/micropipette_laws.ron";

/// Pressure and length of aspiration where the cap first touches the wall, and where the pressure is greatest.
fn critical(rows: &[Value], case: usize) -> [(f64, f64); 2] {
    let at = |row: &Value| {
        let number = |name: &str| row["quantities"][name].as_f64().unwrap();
        (number("dP"), number("L"))
    };
    let found = states(rows, case);
    let touch: Vec<&&Value> = found.iter().filter(|r| r["kind"] == "touch" && r["of"] == "pipette.wall").collect();
    let folds = found.iter().filter(|r| r["kind"] == "fold" && r["of"] == "dP").map(|r| at(r));
    assert_eq!(touch.len(), 1, "case {case}");
    [at(touch[0]), folds.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_else(|| panic!("case {case}: no maximum"))]
}

fn laws(set: &[&str]) -> Vec<Value> {
    let set: Vec<&str> = set.iter().flat_map(|set| ["--set", set]).collect();
    rows(&membrane(&[&["run", LAWS, "--format", "json"], &set[..]].concat()).exits(0).out)
}

/// The pressure at which the cap touches the wall is the greatest for the neo-Hookean law, nearly, and for no other.
#[test]
fn that_the_wall_limits_the_pressure_is_a_property_of_the_neo_hookean_law() {
    let found = laws(&[]);
    assert!(found.iter().filter(|r| r["kind"] != "case").all(|r| r["admissible"] == true));
    let materials = ["NeoHookean", "MooneyRivlin", "Skalak"];
    for (case, material) in materials.iter().enumerate() {
        assert!(verdict(&found, case)["set"]["material"].get(material).is_some(), "{case}");
        let [(p, touched), (most, at)] = critical(&found, case);
        println!("{material}: p = {p} at L = {touched}, p' = {most} at L = {at}, p'/p - 1 = {:.1e}", most / p - 1.0);
        if *material == "NeoHookean" {
            assert!(most >= p && most / p - 1.0 < 3e-4, "{p} {most}");
            assert!((at - touched).abs() < 0.02 * touched);
        } else {
            assert!(most / p > 1.3, "{material}: {p} {most}");
            assert!(at > 3.0 * touched, "{material}: {touched} {at}");
        }
    }
    // Already a twentieth of the second constant moves the maximum far up the pipette, and nearly doubles it.
    let [_, (liquid, _)] = critical(&found, 0);
    let slight = "sweep=Cases([{ \"material\": MooneyRivlin(c1: \"G/2.1\", c2: \"0.05*G/2.1\") }])";
    let [(p, touched), (most, at)] = critical(&laws(&[slight]), 0);
    assert!(most / liquid > 1.7 && most / p > 1.3 && at > 3.0 * touched, "{p} {touched} {most} {at}");
}

#[test]
fn critical_pressures_are_those_of_the_reference() {
    let data: Value = serde_json::from_str(include_str!("data/reference/micropipette.json")).unwrap();
    let mut compared = 0;
    // At the end of the longest branches places on the membrane are known to no more than this.
    let critical = |case: &Value, law| {
        let set = [format!("r0={}", case["r0"]), "accuracy=1e-6".into()];
        critical(&laws(&set.each_ref().map(String::as_str)), law)
    };
    for case in data["critical_pressures"].as_array().unwrap().iter().filter(|c| c["rhobar"] == 0.58) {
        assert_eq!(case["material"], "neo-Hookean");
        let [(p, touched), (most, _)] = critical(case, 0);
        let greatest = &case["maxima"][0];
        for (name, found, expected) in
            [("p", p, &case["p_contact"]), ("L at p", touched, &case["L_contact"]), ("p'", most, &greatest["dP"])]
        {
            let miss = (found / expected.as_f64().unwrap() - 1.0).abs();
            println!("r0 = {}: {name} = {found}, misses by {miss:.1e}", case["r0"]);
            assert!(miss < 1e-9, "r0 = {}: {name} = {found}, {expected} expected", case["r0"]);
            compared += 1;
        }
        // Another law is no match.
        let [(other, _), _] = critical(case, 1);
        assert!((other / case["p_contact"].as_f64().unwrap() - 1.0).abs() > 1e-2);
    }
    assert_eq!(compared, 9);

    // States of the same Mooney-Rivlin law, C1 = 0.5, C2 = 0.05.
    for case in data["cases"].as_array().unwrap().iter().filter(|c| c["material"] == "Mooney-Rivlin") {
        let (rhobar, at) = (format!("rhobar={}", case["rhobar"]), format!("L={}", case["L"]));
        let run = ["run", LAWS, "--set", "G=1.1", "--set", &rhobar, "--at", &at, "--format", "json"];
        let found = rows(&membrane(&run).exits(0).out);
        let pressure = |case: usize| states(&found, case)[0]["quantities"]["dP"].as_f64().unwrap();
        let expected = case["dP"].as_f64().unwrap();
        assert!((pressure(1) / expected - 1.0).abs() < 1e-9, "{} {expected}", pressure(1));
        assert!((pressure(0) / expected - 1.0).abs() > 1e-2, "{} {expected}", pressure(0));
        compared += 1;
    }
    assert_eq!(compared, 11);
}
