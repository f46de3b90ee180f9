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

/// The source files below a directory, without their own tests and comments.
fn sources(directory: &str, found: &mut Vec<String>) {
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path().to_str().unwrap().to_owned();
        if std::path::Path::new(&path).is_dir() {
            sources(&path, found);
        } else if path.ends_with(".rs") && !path.ends_with("tests.rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let text = text.split("#[cfg(test)]\nmod tests").next().unwrap();
            found.push(text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n"));
        }
    }
}

/// The codes of complaints in a source text: what a complaint is made with, and every text of words joined by hyphens.
fn codes(text: &str, found: &mut BTreeSet<String>) {
    let quoted = |rest: &str| {
        let (word, _) = rest.trim_start().strip_prefix('"')?.split_once('"')?;
        let kebab = word.split('-').all(|part| !part.is_empty() && part.bytes().all(|b| b.is_ascii_lowercase()));
        kebab.then(|| word.to_owned())
    };
    for maker in ["Diagnostic::error(", "Diagnostic::warning(", "ExprError::new(", "refuse("] {
        found.extend(text.split(maker).skip(1).filter_map(quoted));
    }
    found.extend(text.match_indices('"').filter_map(|(i, _)| quoted(&text[i..])).filter(|word| word.contains('-')));
    // Not a code: a word of what `explain` writes.
    found.remove("over-pressure");
}

#[test]
fn the_guide_says_what_to_do_about_every_complaint() {
    let (mut texts, mut wanted) = (vec![], BTreeSet::new());
    sources("src", &mut texts);
    texts.iter().for_each(|text| codes(text, &mut wanted));
    wanted.extend(membrane::expr::CODES.iter().map(|(code, _)| (*code).to_owned()));
    assert!(wanted.len() > 100, "{wanted:?}");
    let guide = std::fs::read_to_string("docs/guide.md").unwrap();
    let table = guide.split("| code | means").nth(1).expect("a table of complaints");
    let missing =
        |table: &str| wanted.iter().filter(|c| !table.contains(&format!("`{c}`"))).cloned().collect::<Vec<_>>();
    assert!(missing(table).is_empty(), "docs/guide.md does not explain {:?}", missing(table));
    // What is left out is noticed.
    assert_eq!(missing(&table.replace("`no-first-touch`", "")), ["no-first-touch"]);
}

#[test]
fn the_links_of_the_documentation_lead_somewhere() {
    for (page, directory) in [("README.md", "."), ("docs/guide.md", "docs")] {
        let text = std::fs::read_to_string(page).unwrap();
        for target in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
            let there = std::path::Path::new(directory).join(target);
            assert!(target.starts_with("http") || there.exists(), "{page}: no {target}");
        }
    }
}
