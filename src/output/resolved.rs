//! The problem as it was solved: everything that its file leaves out written down. Read again, it is the same problem.

use crate::model::Model;
use crate::spec::Problem;
use serde_json::{Map, Value, json};

/// The keys of the root in their order, with what they are where the file does not have them.
fn root(model: &Model) -> [(&'static str, Option<Value>); 23] {
    let (map, list) = (|| Some(json!({})), || Some(json!([])));
    [
        ("$schema", None),
        ("format", None),
        ("title", None),
        ("about", None),
        ("units", None),
        ("parameters", map()),
        ("unknowns", map()),
        ("definitions", map()),
        ("reference", None),
        ("material", None),
        ("wrinkling", Some(json!("Report"))),
        ("initial", None),
        ("fluid", None),
        ("tractions", map()),
        ("bodies", map()),
        ("contact", Some(json!("Listed"))),
        ("meridian", None),
        ("constraints", map()),
        ("branch", None),
        ("outputs", map()),
        ("accuracy", Some(json!(model.accuracy))),
        ("identities", map()),
        ("expect", list()),
    ]
}

/// What the parts of an enumeration are where the file does not say.
const VARIANTS: [(&str, &str, &str); 9] = [
    ("Contact", "law", "\"Frictionless\""),
    ("Free", "outside_pressure", "0"),
    ("Kink", "law", "\"Frictionless\""),
    ("Cone", "hollow", "false"),
    ("Sphere", "hollow", "false"),
    ("Paraboloid", "hollow", "false"),
    ("Cylinder", "hollow", "false"),
    ("Osmotic", "excluded_volume", "0"),
    ("Joint", "conditions", "{}"),
];

/// The problem with its defaults.
pub fn resolved(problem: &Problem, model: &Model) -> Value {
    let mut said = match serde_json::to_value(problem) {
        Ok(Value::Object(map)) => map,
        _ => Map::new(),
    };
    let mut full = Map::new();
    for (key, default) in root(model) {
        if let Some(value) = said.remove(key).or(default) {
            full.insert(key.into(), value);
        }
    }
    full.append(&mut said);
    for body in full.get_mut("bodies").and_then(Value::as_object_mut).into_iter().flat_map(|b| b.values_mut()) {
        if let Some(shape) = body.get_mut("shape") {
            fill(shape);
        }
    }
    for element in full.get_mut("meridian").and_then(Value::as_array_mut).into_iter().flatten() {
        fill(element);
        if let Some(Value::Object(contact)) = element.get_mut("Contact")
            && let Some(on) = contact.get("on").cloned()
        {
            contact.entry("name").or_insert(on);
        }
    }
    if let Some(fluid) = full.get_mut("fluid") {
        fill(fluid);
    }
    if let Some(Value::Object(branch)) = full.get_mut("branch") {
        branch.entry("spacing").or_insert(json!("Linear"));
        if branch.contains_key("to") && !branch.contains_key("at") {
            branch.entry("steps").or_insert(json!(20));
        }
        branch.entry("limit_points").or_insert(json!([]));
        branch.entry("stops").or_insert(json!({}));
    }
    Value::Object(full)
}

/// Adds the defaults of one member of an enumeration.
fn fill(value: &mut Value) {
    for (variant, key, default) in VARIANTS {
        if let Some(Value::Object(fields)) = value.get_mut(variant) {
            fields.entry(key).or_insert_with(|| serde_json::from_str(default).unwrap_or(Value::Null));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model;
    use crate::spec::{Document, Source, Syntax};

    #[test]
    fn read_again_it_is_the_same_problem_and_says_all() {
        let mut seen = 0;
        for entry in std::fs::read_dir("problems").unwrap() {
            let path = entry.unwrap().path();
            let name = path.to_str().unwrap();
            if !name.ends_with(".ron") {
                continue;
            }
            seen += 1;
            let document = Document::load(name, None).unwrap();
            let model = model::resolve(&document.problem).unwrap();
            let full = resolved(&document.problem, &model);
            let source = Source { name: "full".into(), text: full.to_string(), syntax: Syntax::Json };
            let again = Document::read(source).unwrap();
            let model = model::resolve(&again.problem).unwrap();
            assert_eq!(full, resolved(&again.problem, &model), "{name}");
            assert_eq!(again.problem.outputs, document.problem.outputs);
            assert_eq!(full["accuracy"], json!(document.problem.accuracy.map_or(1e-9, |a| a.get())));
        }
        assert!(seen >= 4);
    }
}
