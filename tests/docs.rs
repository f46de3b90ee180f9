//! What the documentation shows is true: every problem in it runs, and the reference of the format leaves no word out.

mod common;

use common::{parse, resolve, run};
use membrane::run::Status;
use membrane::spec::Syntax;
use serde_json::Value;
use std::collections::BTreeSet;

/// The whole problems among the RON blocks of a text: those that are a tuple after their comments.
fn problems(text: &str) -> Vec<String> {
    let blocks = text.split("```ron\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let begins = |block: &&str| {
        let line = block.lines().find(|l| !l.trim().is_empty() && !l.trim().starts_with("//"));
        line.is_some_and(|l| l.starts_with('('))
    };
    blocks.filter(begins).map(str::to_owned).collect()
}

#[test]
fn every_problem_in_the_documentation_runs() {
    let mut pages = vec!["README.md".to_owned()];
    for entry in std::fs::read_dir("docs").unwrap() {
        let path = entry.unwrap().path().to_str().unwrap().to_owned();
        if path.ends_with(".md") {
            pages.push(path);
        }
    }
    for page in pages {
        let found = problems(&std::fs::read_to_string(&page).unwrap());
        // The table of numbers solves the shipped files.
        assert!(!found.is_empty() || page == "docs/thesis.md", "{page} shows no problem");
        for text in found {
            let outcome = run(&resolve(&parse(&page, text, Syntax::Ron)), None);
            assert_eq!(outcome.status, Status::Complete, "{page}");
            for point in &outcome.points {
                let proof = &point.solution.certificate;
                assert!(proof.is_admissible(), "{page}: {proof:?}");
                assert!(proof.identities < 1e-9, "{page}: {proof:?}");
            }
        }
    }
}

/// Keys and variants of the schema.
fn words(schema: &Value, found: &mut BTreeSet<String>) {
    match schema {
        Value::Object(object) => {
            for (key, value) in object {
                match (key.as_str(), value) {
                    ("properties", Value::Object(keys)) => found.extend(keys.keys().cloned()),
                    ("const", Value::String(word)) => drop(found.insert(word.clone())),
                    ("enum", Value::Array(list)) => {
                        found.extend(list.iter().filter_map(|w| w.as_str().map(str::to_owned)))
                    }
                    _ => {}
                }
                words(value, found);
            }
        }
        Value::Array(list) => list.iter().for_each(|value| words(value, found)),
        _ => {}
    }
}

#[test]
fn the_reference_names_every_word_of_the_format() {
    let schema: Value = serde_json::from_str(&membrane::spec::schema_text()).unwrap();
    let mut wanted = BTreeSet::new();
    words(&schema, &mut wanted);
    assert!(wanted.len() > 100, "{wanted:?}");
    let text = std::fs::read_to_string("docs/format.md").unwrap();
    // What stands between backticks, or in blocks.
    let code: String = text.split('`').skip(1).step_by(2).collect::<Vec<_>>().join(" ");
    let present: BTreeSet<&str> = code.split(|c: char| !(c.is_alphanumeric() || "_$".contains(c))).collect();
    let missing: Vec<&String> = wanted.iter().filter(|word| !present.contains(word.as_str())).collect();
    assert!(missing.is_empty(), "docs/format.md does not name {missing:?}");
}

#[test]
fn the_links_of_the_readme_lead_somewhere() {
    let text = std::fs::read_to_string("README.md").unwrap();
    for target in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
        assert!(target.starts_with("http") || std::path::Path::new(target).exists(), "no {target}");
    }
}
