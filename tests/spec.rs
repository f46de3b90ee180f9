//! Problem files as text: what is read, what is refused and how, and that both syntaxes say the same.

use std::fs;
use std::time::{Duration, Instant};

use membrane::diagnostic::{Place, line_column, render, to_json};
use membrane::model;
use membrane::spec::{Document, Number, Origin, Problem, Rejected, Source, Syntax, convert, load, schema};
use proptest::prelude::*;
use serde_json::{Value, json};

fn source(text: &str, syntax: Syntax) -> Source {
    let name = if syntax == Syntax::Ron { "problem.ron" } else { "problem.json" };
    Source { name: name.into(), text: text.into(), syntax }
}

fn read(text: &str, syntax: Syntax) -> Result<Document, Box<Rejected>> {
    Document::read(source(text, syntax))
}

fn shown(rejected: &Rejected) -> String {
    render(&rejected.diagnostics, rejected, false)
}

fn must(text: &str, syntax: Syntax) -> Document {
    read(text, syntax).unwrap_or_else(|rejected| panic!("{}", shown(&rejected)))
}

fn examples() -> Vec<(String, String)> {
    let mut files: Vec<(String, String)> = fs::read_dir("tests/data/spec")
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .map(|path| (path.file_name().unwrap().to_string_lossy().into_owned(), fs::read_to_string(path).unwrap()))
        .collect();
    files.sort();
    assert_eq!(files.len(), 27);
    files
}

fn example(name: &str) -> String {
    examples().into_iter().find(|(file, _)| file == name).unwrap().1
}

/// Two examples write `law: Frictionless`, which is the default.
fn without_default_laws(value: &Value) -> Value {
    match value {
        Value::Object(map) => {
            let keep = |(key, value): &(&String, &Value)| !(*key == "law" && *value == "Frictionless");
            Value::Object(map.iter().filter(keep).map(|(k, v)| (k.clone(), without_default_laws(v))).collect())
        }
        Value::Array(list) => list.iter().map(without_default_laws).collect(),
        other => other.clone(),
    }
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(convert::extensions())
}

#[test]
fn examples_round_trip_through_both_syntaxes() {
    for (name, text) in examples() {
        let document = must(&text, Syntax::Ron);
        let json = convert::write(&document.problem, Syntax::Json).unwrap();
        let from_json = must(&json, Syntax::Json);
        assert_eq!(document.problem, from_json.problem, "{name}");
        let ron = convert::write(&from_json.problem, Syntax::Ron).unwrap();
        let from_ron = must(&ron, Syntax::Ron);
        assert_eq!(document.problem, from_ron.problem, "{name}");
        // Order counts too, which equality of maps does not see.
        assert_eq!(convert::write(&from_ron.problem, Syntax::Json).unwrap(), json, "{name}");
        // Nothing is added to what was written, and nothing left out but defaults.
        assert_eq!(without_default_laws(&document.value), from_json.value, "{name}");
    }
}

#[test]
fn the_ron_crate_reads_the_same() {
    for (name, text) in examples() {
        let document = must(&text, Syntax::Ron);
        let oracle: Problem = options().from_str(&text).unwrap();
        assert_eq!(document.problem, oracle, "{name}");
        let written = convert::write(&document.problem, Syntax::Ron).unwrap();
        let oracle: Problem = options().from_str(&written).unwrap();
        assert_eq!(document.problem, oracle, "{name}");
        let value: Value = serde_json::from_str(&convert::write(&document.problem, Syntax::Json).unwrap()).unwrap();
        assert_eq!(without_default_laws(&document.value), value, "{name}");
    }
}

#[test]
fn words_that_no_example_uses() {
    let text = r##"
#![schema = "membrane.schema.json"]
#![enable(implicit_some)]
Problem(
    format: 1.0, title: r#"a "raw" title"#, about: Some("\u{e9}\x41\n/* no comment */"), units: None,
    parameters: { "a": 1_000, "b": +.5, "c": -0.0, "d": 1e3, "e": 18446744073709551615, "f": 123456789012345678901234 },
    reference: Cylinder(radius: 1, length: 2),
    material: Ogden([(shear_modulus: 0.6, exponent: 1.3), (0.01, "-2")]), // short form
    wrinkling: Forbid, initial: Inflated(pressure: Some(0.1)), fluid: Osmotic(osmotic_pressure: 1,),
    tractions: { "own": SelfRepulsion(coupling: 1, debye_length: 1, on: ["side"]) },
    bodies: { "tool": (shape: Faces(from: (0, 0), faces: [
        Arc(name: "nose", through: (0.5, 0.1), to: (1, 1), edge: "rim"),
        Curve(name: "side", u: "1 + t", d: "t", t: (0, 1)),
    ]), facing: Down, h: 0), "bowl": (shape: Paraboloid(radius: 1, hollow: true), facing: Up, h: 0) },
    meridian: [
        End(conditions: { "free": "w_l = 0" }), Free(name: "a"), Smooth, Contact(on: "bowl", law: NoSlip, name: "b"),
        Kink(at: "tool.rim", law: Capstan(friction: 0.1)), Free(name: "c"), Kink(at: "tool.rim", law: StuckAt("phi = 1")),
    ],
    sweep: Cases([{ "a": 1 }, { "material": Skalak(shear_modulus: "a", area_ratio: 1), "a": 2, "b": "3[deg]" }, {}]),
    outputs: {}, accuracy: 1e-8,
    figures: { "f": Response(x: "a", y: ["b"], scale: LogLog, sweep: Grid({ "a": Log(from: 1, to: 10, count: 3) })) },
    expect: [(values: { "a": 1 }, relative: 0.1, source: "none", refuted: "wrong")],
)"##;
    let document = must(text, Syntax::Ron);
    assert_eq!(document.problem.schema.as_deref(), Some("membrane.schema.json"));
    assert_eq!(document.problem.about.as_deref(), Some("\u{e9}A\n/* no comment */"));
    assert_eq!(document.problem.parameters["a"], Number::Value(1000.0));
    assert!(matches!(document.problem.parameters["c"], Number::Value(zero) if zero.is_sign_negative()));
    for syntax in [Syntax::Ron, Syntax::Json] {
        let written = convert::write(&document.problem, syntax).unwrap();
        let again = must(&written, syntax);
        assert_eq!(again.problem, document.problem);
        assert!(matches!(again.problem.parameters["c"], Number::Value(zero) if zero.is_sign_negative()));
    }
    let oracle: Problem = options().from_str(&text.replace("#![schema = \"membrane.schema.json\"]", "")).unwrap();
    assert_eq!(oracle, Problem { schema: None, ..document.problem });
    let json = must(
        "{\"$schema\": \"s\", \"format\": 1, \"title\": \"\\ud83d\\ude00\\u00e9\\/\", \"about\": null, \
        \"reference\": {\"Sphere\": {\"radius\": 1}}, \"material\": {\"Energy\": \"w\"}, \"initial\": \"Unloaded\", \
        \"outputs\": {}}",
        Syntax::Json,
    );
    assert_eq!(json.problem.title, "\u{1f600}\u{e9}/");
}

// The schema ---------------------------------------------------------------------------------------------------------

#[test]
fn the_schema_that_ships_is_that_of_the_types() {
    let text = fs::read_to_string("schema/membrane.schema.json").unwrap_or_default();
    assert!(
        text == schema::schema_text(),
        "schema/membrane.schema.json is not that of the types; write it again by \
         `cargo run -- schema > schema/membrane.schema.json`, or with WRITE_SCHEMA=1 by `cargo test --test spec write_schema`"
    );
}

#[test]
fn write_schema() {
    if std::env::var_os("WRITE_SCHEMA").is_some() {
        fs::create_dir_all("schema").unwrap();
        fs::write("schema/membrane.schema.json", schema::schema_text()).unwrap();
    }
}

#[test]
fn the_schema_describes_every_key_and_variant() {
    fn walk(schema: &Value, path: &str, bare: &mut Vec<String>) {
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            for (name, inner) in properties {
                let variant = name.starts_with(char::is_uppercase);
                if !variant && inner.get("description").is_none() && schema.get("description").is_none() {
                    bare.push(format!("{path}/{name}"));
                }
                walk(inner, &format!("{path}/{name}"), bare);
            }
        }
        for branch in schema.get("oneOf").and_then(Value::as_array).into_iter().flatten() {
            if branch.get("description").is_none() {
                bare.push(format!("{path}: {branch}"));
            }
            walk(branch, path, bare);
        }
        for (name, inner) in schema.get("$defs").and_then(Value::as_object).into_iter().flatten() {
            walk(inner, name, bare);
        }
    }
    let mut bare = Vec::new();
    walk(schema::schema(), "", &mut bare);
    bare.retain(|path| !path.starts_with("OgdenTerm"));
    assert!(bare.is_empty(), "without a description: {bare:#?}");
    assert!(!schema::schema_text().contains("\"format\": \"double\""));
}

#[test]
fn the_judge_admits_the_examples() {
    for (name, text) in examples() {
        assert_eq!(schema::judge(&must(&text, Syntax::Ron).value), Ok(()), "{name}");
    }
}

/// Every value of a tree in turn becomes something else.
fn mutations(value: &Value) -> Vec<Value> {
    let replacements = [
        Value::Null,
        json!(true),
        json!(-1),
        json!(0.5),
        json!(2.0),
        json!("text"),
        json!("Pole"),
        json!("Plane"),
        json!([]),
        json!([1, "a"]),
        json!({}),
        json!({ "radius": 1 }),
        json!({ "Sphere": { "radius": 1 } }),
        json!({ "Values": [1] }),
    ];
    let mut all: Vec<Value> = replacements.into();
    match value {
        Value::Object(map) => {
            for (key, inner) in map {
                let mut less = map.clone();
                less.shift_remove(key);
                all.push(Value::Object(less.clone()));
                less.insert(format!("{key}x"), inner.clone());
                all.push(Value::Object(less));
                for inner in mutations(inner) {
                    let mut map = map.clone();
                    map.insert(key.clone(), inner);
                    all.push(Value::Object(map));
                }
            }
        }
        Value::Array(list) => {
            for i in 0..list.len() {
                let mut less = list.clone();
                less.remove(i);
                all.push(Value::Array(less));
                for inner in mutations(&list[i]) {
                    let mut list = list.clone();
                    list[i] = inner;
                    all.push(Value::Array(list));
                }
            }
        }
        _ => {}
    }
    all
}

/// The walk along the schema, the judge and the types must agree on what is valid; serde alone takes tuples for structs.
#[test]
fn the_walk_and_the_judge_agree_on_what_is_valid() {
    let (mut good, mut bad) = (0, 0);
    for (name, text) in examples() {
        for value in mutations(&must(&text, Syntax::Ron).value) {
            let text = value.to_string();
            let ours = read(&text, Syntax::Json);
            let judged = schema::judge(&value);
            assert_eq!(
                ours.is_ok(),
                judged.is_ok(),
                "{name}: {text}\n{judged:?}\n{}",
                ours.err().map_or(String::new(), |r| shown(&r))
            );
            match ours {
                Ok(_) => good += 1,
                Err(rejected) => {
                    bad += 1;
                    assert!(rejected.diagnostics.iter().all(|d| d.code != "not-a-problem"), "{}", shown(&rejected));
                }
            }
        }
    }
    assert!(good > 1_000 && bad > 10_000, "{good} {bad}");
}

// What is refused ----------------------------------------------------------------------------------------------------

/// A problem in which one line can be spoiled.
fn with(line: &str) -> String {
    let mut lines = vec![
        "    format: 1,",
        "    title: \"t\",",
        "    parameters: { \"G\": 1 },",
        "    reference: Sphere(radius: 1),",
        "    material: NeoHookean(shear_modulus: \"G\"),",
        "    initial: Unloaded,",
        "    bodies: { \"cone\": (shape: Cone(inclination: 1), facing: Up, h: 0) },",
        "    outputs: { \"a\": \"G\" },",
    ];
    let key = |line: &str| line.split(':').next().unwrap().trim().to_owned();
    match lines.iter().position(|&old| key(old) == key(line)) {
        Some(i) => lines[i] = line,
        None => lines.push(line),
    }
    format!("(\n{}\n)\n", lines.join("\n"))
}

fn refused(text: &str, syntax: Syntax) -> String {
    match read(text, syntax) {
        Ok(document) => panic!("read: {:?}", document.problem),
        Err(rejected) => shown(&rejected),
    }
}

#[test]
fn what_is_refused_in_ron() {
    let lines = [
        ("unknown_key", "    branch: (control: \"a\", limit_pionts: [\"a\"]),"),
        ("unknown_key_of_a_variant", "    bodies: { \"cone\": (shape: Cone(inclinaton: 1), facing: Up, h: 0) },"),
        ("unknown_root_key", "    materials: NeoHookean(shear_modulus: 1),"),
        ("unknown_variant", "    material: NeoHookian(shear_modulus: 1),"),
        ("unknown_unit_variant", "    wrinkling: Relaxed,"),
        ("variant_without_keys", "    reference: Sphere,"),
        ("unit_variant_with_keys", "    initial: Unloaded(radius: 1),"),
        ("variant_name_missing", "    reference: (radius: 1),"),
        ("duplicate_key", "    parameters: { \"G\": 1, \"r0\": 1.1, \"G\": 3 },"),
        ("duplicate_field", "    branch: (control: \"a\", to: 1, to: 2),"),
        ("wrong_type", "    parameters: { \"G\": [1, 2], \"H\": true, \"I\": Plane(a: 1) },"),
        ("wrong_type_of_text", "    title: 3,"),
        ("wrong_type_of_list", "    meridian: Pole,"),
        ("nan", "    parameters: { \"G\": NaN, \"H\": inf, \"I\": -inf },"),
        ("too_large_a_number", "    parameters: { \"G\": 1e400 },"),
        ("odd_numbers", "    parameters: { \"a\": 0x10, \"b\": 3u8, \"c\": 0..5, \"d\": 40deg, \"e\": 1.2.3 },"),
        ("unit_without_quotes", "    parameters: { \"G\": 40[deg], \"H\": 8 },"),
        ("formula_without_quotes", "    parameters: { \"G\": 2*r0*(1 + x), \"H\": cone.force, \"I\": -G },"),
        ("name_without_quotes", "    branch: (control: a, to: G),"),
        ("key_without_quotes", "    parameters: { G: 1 },"),
        ("key_with_quotes", "    reference: Sphere(\"radius\": 1),"),
        ("wrong_brackets", "    parameters: (G: 1), meridian: (Pole, Pole), units: { \"length\": \"m\" },"),
        ("missing_keys", "    bodies: { \"cone\": (facing: Up) },"),
        ("missing_key_in_a_list", "    expect: [(values: {\n \"a\": 1 }, relative: 1e-9)],"),
        ("one_of", "    initial: Inflated(radius: 1, volume: 2),"),
        ("one_of_nothing", "    initial: Inflated(),"),
        ("out_of_range", "    branch: (control: \"a\", steps: 0), accuracy: -1,"),
        ("not_whole", "    branch: (control: \"a\", steps: 1.5),"),
        ("tuple_length", "    reference: Meridian(rho0: \"t\", h0: \"t\", t: (0, 1, 2)),"),
        ("format_of_the_future", "    format: 2,"),
        ("missing_comma", "    title: \"t\" about: \"b\" accuracy: 1,"),
        ("missing_colon", "    title \"t\","),
        ("missing_value", "    title: , accuracy: 1,"),
        ("two_commas", "    title: \"t\",, accuracy: 1,"),
        ("wrong_closing", "    meridian: [Pole, Pole),"),
        ("unclosed_string", "    title: \"t,"),
        ("unclosed_comment", "    title: \"t\", /* never /* ending */"),
        ("single_quotes", "    title: 't',"),
        ("bad_escape", "    title: \"\\q \\u{110000} \\x4\","),
        ("key_of_a_tuple", "    reference: Meridian(rho0: 1, 2),"),
        ("two_errors", "    material: NeoHookian(shear_modulus: 1), accuracy: \"high\", fluid: Pressure(),"),
        ("syntax_and_words", "    parameters: { \"G\": 1, \"G\": 1e400 }, wrinkling: Relaxed,"),
    ];
    for (name, line) in lines {
        insta::assert_snapshot!(name, format!("{line}\n\n{}", refused(&with(line), Syntax::Ron)));
    }
    let texts = [
        ("empty", ""),
        ("only_comments", "// nothing\n"),
        ("other_root", "Membrane(format: 1)"),
        ("root_list", "[1, 2]"),
        ("root_word", "hello"),
        ("nothing_given", "()"),
        ("not_closed", "(\n    format: 1,\n    bodies: { \"a\": (\n"),
        ("trailing", "(format: 1) (format: 2)"),
        ("json_in_ron", "{ \"format\": 1 }"),
        ("bad_attribute", "#![feature(x)]\n()"),
        ("markup", "<xml/>"),
    ];
    for (name, text) in texts {
        insta::assert_snapshot!(name, format!("{text}\n\n{}", refused(text, Syntax::Ron)));
    }
}

#[test]
fn what_is_refused_in_json() {
    let texts = [
        ("json_comment", "{ // no\n \"format\": 1 }"),
        ("json_trailing_comma", "{ \"format\": 1, }"),
        ("json_word", "{ \"format\": one, \"title\": NaN }"),
        ("json_key_without_quotes", "{ format: 1 }"),
        ("json_numbers", "{ \"format\": 01, \"title\": +1, \"about\": .5 }"),
        ("json_half_surrogate", "{ \"title\": \"\\ud83d \\u12\" }"),
        ("json_newline_in_string", "{ \"title\": \"a\nb\" }"),
        ("json_round", "( \"title\": 1 )"),
        ("json_duplicate", "{ \"title\": \"a\", \"title\": \"b\" }"),
        (
            "json_unknown_variant",
            "{ \"format\": 1, \"title\": \"\", \"reference\": {\"Spere\": {\"radius\": 1}}, \
            \"material\": {\"Varga\": {\"shear_modulus\": []}}, \"initial\": \"Unloded\", \"outputs\": {} }",
        ),
    ];
    for (name, text) in texts {
        insta::assert_snapshot!(name, format!("{text}\n\n{}", refused(text, Syntax::Json)));
    }
}

#[test]
fn errors_as_json_have_lines_and_columns() {
    let text = with("    title: \"\u{e9}\", acuracy: 1,");
    let rejected = read(&text, Syntax::Ron).unwrap_err();
    let all = to_json(&rejected.diagnostics, &*rejected);
    assert_eq!(all.len(), 1);
    assert_eq!((&all[0]["code"], &all[0]["severity"]), (&json!("unknown-key"), &json!("error")));
    assert_eq!((&all[0]["file"], &all[0]["line"], &all[0]["column"]), (&json!("problem.ron"), &json!(3), &json!(17)));
    assert!(all[0]["help"].as_str().unwrap().starts_with("did you mean `accuracy`?"));
}

// Files --------------------------------------------------------------------------------------------------------------

#[test]
fn files_that_are_refused() {
    let directory = std::env::temp_dir().join(format!("membrane-spec-{}", std::process::id()));
    fs::create_dir_all(directory.join("folder.ron")).unwrap();
    let utf16: Vec<u8> = "\u{feff}(format: 1)".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let bare_utf16: Vec<u8> = "(format: 1)".encode_utf16().flat_map(u16::to_be_bytes).collect();
    let files: [(&str, &[u8], &str); 10] = [
        ("empty.ron", b"", "empty-file"),
        ("blank.json", b" \n", "empty-file"),
        ("utf16.ron", &utf16, "UTF-16"),
        ("bare.ron", &bare_utf16, "UTF-16"),
        ("latin.ron", b"(title: \"caf\xe9\")", "not-utf8"),
        ("nul.ron", b"\0\0\0", "not the start of a value"),
        ("text.jsn", b"{}", "did you mean `.json`?"),
        ("text", b"{}", "no extension"),
        ("large.ron", &vec![b' '; 30_000_000], "16 MB"),
        ("bom.ron", b"\xef\xbb\xbf()", "missing-key"),
    ];
    for (name, bytes, expected) in files {
        let path = directory.join(name);
        fs::write(&path, bytes).unwrap();
        let rejected = Document::load(path.to_str().unwrap(), None).unwrap_err();
        let text = shown(&rejected);
        assert!(text.contains(expected), "{name}: {text}");
        assert!(text.contains(name), "{name}: {text}");
        assert_eq!(rejected.diagnostics.len(), 1);
    }
    let path = |name: &str| directory.join(name).to_str().unwrap().to_owned();
    assert!(shown(&load(&path("folder.ron"), None).unwrap_err()).contains("directory"));
    assert!(shown(&load(&path("missing.ron"), None).unwrap_err()).contains("cannot be read"));
    let good = example("cone_on_flat.ron");
    fs::write(path("good.RON"), format!("\u{feff}{}", good.replace('\n', "\r\n"))).unwrap();
    assert_eq!(Document::load(&path("good.RON"), None).unwrap().problem, must(&good, Syntax::Ron).problem);
    fs::write(path("good.txt"), &good).unwrap();
    assert!(Document::load(&path("good.txt"), Some(Syntax::Ron)).is_ok());
    fs::remove_dir_all(&directory).unwrap();
}

/// Megabytes of anything are read or refused in linear time.
/// What an expectation sets must be a parameter or a top-level key, or it is an error at its place.
#[test]
fn settings_of_expectations_exist() {
    let text = fs::read_to_string("problems/flat_plates.ron").unwrap();
    let expect =
        |set: &str| format!("expect: [(set: {{ {set} }}, values: {{ \"p_f\": 1 }}, relative: 1, source: \"\"), ");
    let with = |set: &str| must(&text.replacen("expect: [", &expect(set), 1), Syntax::Ron);
    let right = with("\"r0\": 1.5, \"material\": \"NeoHookean(shear_modulus: 2)\"");
    assert!(model::resolve(&right.problem).is_ok());
    let wrong = with("\"r1\": 1.5, \"G\": 1, \"hbar\": 0.5");
    let diagnostics = model::resolve(&wrong.problem).unwrap_err().diagnostics;
    let list = to_json(&diagnostics, &wrong);
    assert_eq!(list.len(), 2, "{list:?}");
    let line = 1 + text[..text.find("expect: [").unwrap()].matches('\n').count();
    for (found, parts) in list.iter().zip([
        ["`r1`", "did you mean `r0`?", "parameters: G, r0", "material"],
        ["`hbar`", "is an unknown", "named in `at`", "parameters: G, r0"],
    ]) {
        assert_eq!((&found["code"], &found["line"]), (&json!("unknown-key"), &json!(line)), "{found}");
        let said = format!("{}\n{}", found["message"], found["help"]);
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
}

#[test]
fn hostile_texts_are_refused_quickly() {
    let many = 1_000_000;
    let key = "k".repeat(many);
    let texts = [
        ("(".repeat(many), Syntax::Ron),
        ("[".repeat(many), Syntax::Json),
        ("a(".repeat(many), Syntax::Ron),
        ("Some(".repeat(many), Syntax::Ron),
        ("/*".repeat(many), Syntax::Ron),
        (format!("{}{}()", "/*".repeat(many), "*/".repeat(many)), Syntax::Ron),
        (format!("[{}]", "1,".repeat(many)), Syntax::Ron),
        (format!("({})", "a,".repeat(many)), Syntax::Ron),
        (format!("({})", "a:1,".repeat(many)), Syntax::Ron),
        (format!("({})", "a ".repeat(many)), Syntax::Ron),
        (format!("({})", "a/**/".repeat(many)), Syntax::Ron),
        (format!("(title: {})", "a.b".repeat(many)), Syntax::Ron),
        (format!("(title: \"{}\")", "\\q".repeat(many)), Syntax::Ron),
        (format!("(title: \"{}\")", "\\n".repeat(many)), Syntax::Ron),
        (format!("(title: r{}\"{}", "#".repeat(many), "\"#".repeat(many)), Syntax::Ron),
        (format!("(title: {})", "r\"".repeat(many)), Syntax::Ron),
        (format!("(title: {})", "9".repeat(many)), Syntax::Ron),
        (format!("(title: {}e{})", "9".repeat(many), "9".repeat(many)), Syntax::Ron),
        (format!("({key}: 1, {key}: {key}, {key}x: {key}(1))"), Syntax::Ron),
        (format!("{{\"{key}\": [{}]}}", "{\"a\": 1},".repeat(60_000)), Syntax::Ron),
        (format!("(format: 2, parameters: {{\"{key}\": [{}]}})", "1,".repeat(90_000)), Syntax::Ron),
        (format!("(meridian: [{}])", "Pole(1),".repeat(60_000)), Syntax::Ron),
        ("\n".repeat(many), Syntax::Ron),
        ("\u{1f600}".repeat(many), Syntax::Ron),
        ("\"".repeat(many), Syntax::Json),
        ("{\"a\":".repeat(many), Syntax::Json),
    ];
    for (text, syntax) in texts {
        let start = Instant::now();
        let rejected = read(&text, syntax).unwrap_err();
        let (shown, json) = (shown(&rejected), to_json(&rejected.diagnostics, &*rejected));
        let beginning: String = text.chars().take(20).collect();
        assert!(!rejected.diagnostics.is_empty() && rejected.diagnostics.len() <= 51, "{beginning}");
        assert_eq!(json.len(), rejected.diagnostics.len());
        assert!(shown.len() < 200_000, "{beginning}: {} bytes of complaints", shown.len());
        assert!(start.elapsed() < Duration::from_secs(5), "{beginning}: {:?}", start.elapsed());
    }
}

// Places -------------------------------------------------------------------------------------------------------------

#[test]
fn places_are_found_in_the_text() {
    let text = example("micropipette.ron");
    let document = must(&text, Syntax::Ron);
    let at = |pointer: &str| &text[document.origin.value(pointer).unwrap()];
    assert_eq!(at("/reference"), "Sphere(radius: 1)");
    assert_eq!(at("/reference/Sphere"), "(radius: 1)");
    assert_eq!(&text[document.origin.key("/reference/Sphere").unwrap()], "Sphere");
    assert_eq!(at("/meridian/1/Free/name"), "\"cap\"");
    assert_eq!(at("/meridian/2/Contact/appears/When"), "\"cap.end.tau = 90[deg]\"");
    assert_eq!(at("/branch/stops/end of aspiration"), "\"tau_out = 90[deg]\"");
    assert_eq!(&text[document.origin.key("/outputs/L_over_rho").unwrap()], "\"L_over_rho\"");
    assert_eq!(document.origin.value("/nowhere"), None);
    // Every value of the tree has its text.
    fn walk(value: &Value, pointer: String, origin: &Origin) {
        let range = origin.value(&pointer).unwrap_or_else(|| panic!("{pointer}"));
        let written = &origin.source().text[range];
        match value {
            Value::String(text) => assert!(written == text || written == format!("\"{text}\""), "{pointer}"),
            Value::Number(number) => assert_eq!(written.parse::<f64>().ok(), number.as_f64(), "{pointer}"),
            Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| walk(v, format!("{pointer}/{i}"), origin)),
            Value::Object(map) => map.iter().for_each(|(k, v)| {
                walk(v, format!("{pointer}/{}", k.replace('~', "~0").replace('/', "~1")), origin);
            }),
            _ => {}
        }
    }
    for (_, text) in examples() {
        let document = must(&text, Syntax::Ron);
        walk(&document.value, String::new(), &document.origin);
    }
}

#[test]
fn places_inside_strings() {
    use membrane::diagnostic::Locate;
    let text = with("    outputs: { \"a\": \"G*cone\", \"b\": \"\\x47 + cone\", \"c\": r#\"cone\"#, \"d/~\": 1 },");
    let document = must(&text, Syntax::Ron);
    let at = |place: Place| document.locate(&place).map(|at| at.text[at.range].to_owned());
    assert_eq!(at(Place::Within("/outputs/a".into(), 2..6)).as_deref(), Some("cone"));
    assert_eq!(at(Place::Within("/outputs/a".into(), 2..900)).as_deref(), Some("cone"));
    assert_eq!(at(Place::Within("/outputs/a".into(), usize::MAX..usize::MAX)).as_deref(), Some(""));
    assert_eq!(at(Place::Within("/outputs/b".into(), 4..8)).as_deref(), Some("\"\\x47 + cone\""));
    assert_eq!(at(Place::Within("/outputs/c".into(), 0..4)).as_deref(), Some("cone"));
    assert_eq!(at(Place::Key("/outputs/d~1~0".into())).as_deref(), Some("\"d/~\""));
    assert_eq!(at(Place::Key("/branch/control".into())).as_deref(), Some("("));
    assert_eq!(at(Place::Pointer("/outputs/z".into())).as_deref(), Some("outputs"));
    assert_eq!(at(Place::None), None);
    assert_eq!(line_column(&text, document.origin.value("/outputs/c").unwrap().start), (9, 56));
}

#[test]
fn values_can_be_replaced() {
    let document = must(&example("cone_on_flat.ron"), Syntax::Ron);
    let option = |text: &str| Source { name: "--set".into(), text: text.into(), syntax: Syntax::Ron };
    let set = document.replace("/material", option("MooneyRivlin(c1: 0.5, c2: 0.05)")).unwrap();
    let set = set.replace("/parameters/cone_angle", option("\"60[deg]\"")).unwrap();
    let set = set.replace("/accuracy", option("1e-8")).unwrap();
    assert_eq!(set.problem.parameters["cone_angle"], Number::from("60[deg]"));
    assert_eq!(set.problem.accuracy.unwrap().get(), 1e-8);
    assert_eq!(document.problem.accuracy, None);
    insta::assert_snapshot!(
        "set_unknown_key",
        shown(&set.replace("/material", option("Gent(shear_moduls: 1)")).unwrap_err())
    );
    insta::assert_snapshot!("set_syntax", shown(&set.replace("/material", option("Gent(")).unwrap_err()));
    insta::assert_snapshot!("set_root_key", shown(&set.replace("/materail", option("1")).unwrap_err()));
    assert!(set.replace("/bodies/tool/h", option("1")).is_err());
    assert!(set.replace("", option("1")).is_err());
    assert!(set.replace("/meridian/9", option("Pole")).is_err());
    assert!(set.replace("/meridian/0", option("Mirror(h: 0)")).is_ok());
}

// Against random input -----------------------------------------------------------------------------------------------

fn text() -> impl Strategy<Value = String> {
    prop_oneof![".{0,8}", "[\"\\\\/#\u{e9}\u{1f600}\n\t'(){}\\[\\],:r*]{0,8}", "[a-z]{1,5}"]
}

fn number() -> impl Strategy<Value = Number> {
    prop_oneof![
        any::<f64>().prop_filter("finite", |x| x.is_finite()).prop_map(Number::Value),
        any::<i32>().prop_map(|i| Number::Value(f64::from(i))),
        text().prop_map(Number::Formula),
    ]
}

/// A random problem: an example with random names, numbers and formulas in it.
fn problem() -> impl Strategy<Value = Problem> {
    let maps = (
        prop::collection::vec((text(), number()), 0..4),
        prop::collection::vec((text(), number()), 0..4),
        prop::collection::vec(number(), 0..4),
        prop::option::of(text()),
        0..27usize,
        (text(), number(), number()),
    );
    maps.prop_map(|(parameters, outputs, values, about, which, (name, from, to))| {
        let (_, text) = &examples()[which];
        let mut problem = must(text, Syntax::Ron).problem;
        problem.parameters = parameters.into_iter().collect();
        problem.outputs = outputs.into_iter().collect();
        problem.title = name.clone();
        problem.about = about;
        if let Some(branch) = &mut problem.branch {
            (branch.control, branch.from, branch.to) = (name.as_str().into(), Some(from.clone()), Some(to.clone()));
            branch.at = Some(values.clone());
        }
        problem.material = membrane::spec::Material::Yeoh(values);
        problem.reference = membrane::spec::Reference::Meridian { rho0: from.clone(), h0: to.clone(), t: (from, to) };
        problem
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Own reader and the ron crate on the same text.
    #[test]
    fn random_problems_are_read_as_by_the_ron_crate(problem in problem()) {
        let pretty = convert::write(&problem, Syntax::Ron).unwrap();
        let compact = options().to_string(&problem).unwrap();
        for text in [pretty, compact] {
            let ours = must(&text, Syntax::Ron).problem;
            let oracle: Problem = options().from_str(&text).unwrap();
            prop_assert_eq!(&ours, &oracle);
            prop_assert_eq!(&ours, &problem);
        }
        let json = convert::write(&problem, Syntax::Json).unwrap();
        prop_assert_eq!(must(&json, Syntax::Json).problem, problem);
    }

    /// A text with some bytes changed is read as by the ron crate, or refused by it too; nothing panics.
    #[test]
    fn spoiled_texts_do_not_slip_through(which in 0..27usize, spoil in prop::collection::vec((any::<prop::sample::Index>(), "[(){}\\[\\],:\"'/*#r.0-9a\\\\\n-]{0,2}"), 1..3)) {
        let mut text = examples()[which].1.clone();
        for (place, with) in spoil {
            let at = place.index(text.len());
            if text.is_char_boundary(at) && text.is_char_boundary(at + 1) {
                text.replace_range(at..at + 1, &with);
            }
        }
        match (read(&text, Syntax::Ron), options().from_str::<Problem>(&text)) {
            (Ok(ours), Ok(oracle)) => prop_assert_eq!(ours.problem, oracle),
            (Ok(_), Err(oracle)) => prop_assert!(false, "the oracle refuses: {oracle}\n{text}"),
            (Err(rejected), _) => prop_assert!(!shown(&rejected).is_empty()),
        }
    }

    /// Any text at all, in both syntaxes.
    #[test]
    fn nothing_panics(text in prop_oneof![".{0,40}", "[(){}\\[\\],:\"'/*#r.0-9a\\\\\n eE+!=\u{e9}-]{0,60}"]) {
        for syntax in [Syntax::Ron, Syntax::Json] {
            if let Err(rejected) = read(&text, syntax) {
                let _ = (render(&rejected.diagnostics, &*rejected, true), to_json(&rejected.diagnostics, &*rejected));
            }
        }
    }

    /// JSON values are read as by serde_json.
    #[test]
    fn json_is_read_as_by_serde_json(title in text(), number in any::<f64>()) {
        let value = json!({ "title": title, "about": null, "x": number, "l": [true, false, -1, 1e-7] });
        let number = number.to_string();
        let rejected = read(&value.to_string(), Syntax::Json).unwrap_err();
        prop_assert!(rejected.diagnostics.iter().all(|d| d.code != "syntax" && d.code != "bad-escape"), "{}", number);
    }
}
