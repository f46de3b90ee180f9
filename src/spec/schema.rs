//! The JSON Schema of problem files, made from the types, and what a value tree violates of it.
//!
//! The schema is walked along the tree: enums are told apart by their one key, and all errors of a file are found at
//! once, each at its place. A full validator ([`judge`]) agrees on what is valid; tests hold them together, and it is
//! asked where the walk and the types differ (it takes milliseconds to get ready, the walk takes none).

use std::sync::OnceLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::{Map, Value};

use super::origin::{Node, Parts, Written, token};
use super::problem::Problem;
use super::reader::MAX_COMPLAINTS;
use crate::diagnostic::{Diagnostic, Place, allowed, closest, short, suggest};

/// Where the schema says that it lives.
const ID: &str = "membrane.schema.json";

/// The schema as a value (draft 2020-12).
pub fn schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let strip = RecursiveTransform(|schema: &mut Schema| {
            schema.remove("format");
        });
        let generator = SchemaSettings::draft2020_12().with_transform(strip).into_generator();
        generator.into_root_schema_for::<Problem>().to_value()
    })
}

/// The schema as text, as it stands in `schema/membrane.schema.json`.
pub fn schema_text() -> String {
    let mut text = serde_json::to_string_pretty(schema()).unwrap_or_default();
    text.push('\n');
    text
}

/// The keys that a problem file may have at its root, in the order of the format.
pub fn root_keys() -> impl Iterator<Item = &'static str> + Clone {
    let properties = schema().get("properties").and_then(Value::as_object);
    properties.into_iter().flat_map(|properties| properties.keys().map(String::as_str))
}

/// Whether the schema admits a value, by a full validator of draft 2020-12.
///
/// # Errors
///
/// A description of the violations, made for schema experts; [`Document::read`](super::Document::read) makes one for
/// users.
pub fn judge(value: &Value) -> Result<(), String> {
    struct Compiled {
        schemas: boon::Schemas,
        index: boon::SchemaIndex,
    }
    static COMPILED: OnceLock<Result<Compiled, String>> = OnceLock::new();
    let compiled = COMPILED.get_or_init(|| {
        let mut schemas = boon::Schemas::new();
        let mut compiler = boon::Compiler::new();
        let url = format!("membrane:///{ID}");
        compiler.add_resource(&url, schema().clone()).map_err(|error| format!("{error:#}"))?;
        let index = compiler.compile(&url, &mut schemas).map_err(|error| format!("{error:#}"))?;
        Ok(Compiled { schemas, index })
    });
    let Compiled { schemas, index } = compiled.as_ref().map_err(String::clone)?;
    schemas.validate(value, *index).map_err(|error| error.to_string())
}

/// All that a tree violates of the schema, each at its place.
pub(crate) fn explain(value: &Value, node: &Node) -> Vec<Diagnostic> {
    let mut walk = Walk { path: Vec::new(), diagnostics: Vec::new() };
    walk.check(schema(), value, Some(node));
    walk.diagnostics
}

struct Walk {
    path: Vec<String>,
    diagnostics: Vec<Diagnostic>,
}

/// A schema behind its references.
fn resolve(mut schema: &Value) -> &Value {
    while let Some(reference) = schema.get("$ref").and_then(Value::as_str) {
        let target = reference.strip_prefix('#').and_then(|pointer| self::schema().pointer(pointer));
        match target {
            Some(target) => schema = target,
            None => break,
        }
    }
    schema
}

/// What an enum's schema allows.
#[derive(Default)]
struct Variants<'s> {
    units: Vec<&'s str>,
    tagged: Vec<(&'s str, &'s Value)>,
}

impl<'s> Variants<'s> {
    /// The variants, where all branches are such.
    fn of(branches: &[&'s Value]) -> Option<Variants<'s>> {
        let mut variants = Variants::default();
        for branch in branches {
            if let Some(name) = branch.get("const").and_then(Value::as_str) {
                variants.units.push(name);
            } else if let Some(names) = branch.get("enum").and_then(Value::as_array) {
                variants.units.extend(names.iter().filter_map(Value::as_str));
            } else {
                let required = branch.get("required").and_then(Value::as_array).filter(|keys| keys.len() == 1)?;
                let properties = branch.get("properties").and_then(Value::as_object).filter(|keys| keys.len() == 1)?;
                let (name, inner) = properties.iter().next()?;
                if branch.get("additionalProperties") != Some(&Value::Bool(false)) || required[0] != name.as_str() {
                    return None;
                }
                variants.tagged.push((name, inner));
            }
        }
        Some(variants)
    }

    fn names(&self) -> Vec<&'s str> {
        self.units.iter().copied().chain(self.tagged.iter().map(|(name, _)| *name)).collect()
    }

    /// Whether these are alternative keys of a struct rather than names of variants.
    fn keys(&self) -> bool {
        self.names().iter().all(|name| name.starts_with(|c: char| c.is_lowercase()))
    }
}

impl Walk {
    fn pointer(&self) -> String {
        self.path.iter().map(|name| token(name)).collect()
    }

    fn full(&self) -> bool {
        self.diagnostics.len() >= MAX_COMPLAINTS
    }

    fn say(&mut self, diagnostic: Diagnostic) {
        if !self.full() {
            self.diagnostics.push(diagnostic);
        }
    }

    /// How the value around the current place is called in messages.
    fn owner(&self) -> String {
        match self.path.iter().rev().find(|name| name.parse::<usize>().is_err()) {
            Some(name) => format!("`{}`", short(name)),
            None => "the problem file".into(),
        }
    }

    fn down(&mut self, name: &str, schema: &Value, value: &Value, node: Option<&Node>) {
        self.path.push(name.to_owned());
        self.check(schema, value, node.and_then(|node| node.part(name)));
        self.path.pop();
    }

    fn wrong_type(&mut self, expected: &str, value: &Value, node: Option<&Node>) {
        let label = match (value, node) {
            (Value::Object(map), Some(Node { written: Written::Variant, .. })) => match map.keys().next() {
                Some(name) => format!("found `{}(..)`", short(name)),
                None => "found something else".into(),
            },
            _ => format!("found {}", found(value)),
        };
        let message = format!("expected {expected}");
        self.say(Diagnostic::error("wrong-type", message).at(self.pointer(), label));
    }

    fn check(&mut self, schema: &Value, value: &Value, node: Option<&Node>) {
        if self.full() || node.is_some_and(|node| node.written == Written::Spoiled) {
            return;
        }
        let schema = resolve(schema);
        let expected = expectation(schema);
        for keyword in ["oneOf", "anyOf"] {
            if let Some(branches) = schema.get(keyword).and_then(Value::as_array) {
                return self.choose(branches, &expected, value, node);
            }
        }
        let types = types(schema);
        if !types.is_empty() && !types.iter().any(|name| is(value, name)) {
            return self.wrong_type(&expected, value, node);
        }
        if schema.get("const").is_some_and(|only| !same(only, value)) {
            return self.say(Diagnostic::error("wrong-value", format!("expected {expected}")).at(self.pointer(), ""));
        }
        if let Some(names) = schema.get("enum").and_then(Value::as_array) {
            let names: Vec<&str> = names.iter().filter_map(Value::as_str).collect();
            return match value.as_str() {
                Some(name) if names.contains(&name) => {}
                Some(name) => self.unknown_variant(name, &names, &expected, false),
                None => self.wrong_type(&expected, value, node),
            };
        }
        match value {
            Value::Object(map) => self.object(schema, map, &expected, node),
            Value::Array(list) => self.array(schema, list, &expected, node),
            Value::Number(number) => self.number(schema, number.as_f64().unwrap_or(0.0), &expected),
            Value::String(text) => {
                if let Some(Node { written: Written::Word, .. }) = node {
                    let label = format!("write \"{}\"", short(text));
                    self.say(
                        Diagnostic::error("missing-quotes", format!("`{}` stands without quotes", short(text)))
                            .at(self.pointer(), label)
                            .help(format!("expected {expected}")),
                    );
                }
            }
            _ => {}
        }
    }

    fn choose(&mut self, branches: &[Value], expected: &str, value: &Value, node: Option<&Node>) {
        let nothing = |branch: &&Value| branch.get("type").and_then(Value::as_str) == Some("null");
        let branches: Vec<&Value> = branches.iter().map(resolve).collect();
        if value.is_null() && branches.iter().any(nothing) {
            return;
        }
        let branches: Vec<&Value> = branches.into_iter().filter(|branch| !nothing(branch)).collect();
        if let [only] = branches[..] {
            return self.check(only, value, node);
        }
        if let Some(variants) = Variants::of(&branches) {
            return self.variant(&variants, expected, value, node);
        }
        let fits = |branch: &&&Value| types(branch).iter().any(|name| is(value, name));
        match branches.iter().find(fits) {
            Some(branch) => self.check_as(branch, expected, value, node),
            None => self.wrong_type(expected, value, node),
        }
    }

    /// Checks against one of several branches, which has no name of its own.
    fn check_as(&mut self, branch: &Value, expected: &str, value: &Value, node: Option<&Node>) {
        let said = self.diagnostics.len();
        self.check(branch, value, node);
        for diagnostic in &mut self.diagnostics[said..] {
            if diagnostic.code == "missing-quotes" {
                diagnostic.help = Some(format!("expected {expected}"));
            }
        }
    }

    fn unknown_variant(&mut self, name: &str, names: &[&str], expected: &str, on_key: bool) {
        let pointer = self.pointer();
        let diagnostic = Diagnostic::error("unknown-variant", format!("`{}` is not {expected}", short(name)));
        let place = if on_key { Place::Key(pointer + &token(name)) } else { Place::Pointer(pointer) };
        let diagnostic = diagnostic.label(place, "not known here").help(suggest(name, names.iter().copied()));
        self.say(diagnostic);
    }

    fn variant(&mut self, variants: &Variants, expected: &str, value: &Value, node: Option<&Node>) {
        let names = variants.names();
        match value {
            Value::String(name) => {
                if variants.units.contains(&name.as_str()) {
                    return;
                }
                if !variants.keys()
                    && let Some((name, inner)) = variants.tagged.iter().find(|(tag, _)| tag == name)
                {
                    let keys = usage(name, inner);
                    self.say(
                        Diagnostic::error("missing-key", format!("`{name}` stands without what belongs to it"))
                            .at(self.pointer(), format!("write {keys}")),
                    );
                    return;
                }
                if variants.keys() {
                    return self.wrong_type(expected, value, node);
                }
                self.unknown_variant(name, &names, expected, false);
            }
            Value::Object(map) if map.len() == 1 => {
                let Some((name, inner)) = map.iter().next() else { return };
                if let Some((_, schema)) = variants.tagged.iter().find(|(tag, _)| tag == name) {
                    return self.down(name, schema, inner, node);
                }
                let pointer = self.pointer();
                if variants.units.contains(&name.as_str()) {
                    return self.say(
                        Diagnostic::error("unknown-key", format!("nothing belongs to `{name}`"))
                            .label(Place::Key(pointer + &token(name)), format!("write `{name}` alone")),
                    );
                }
                let written = node.map(|node| node.written);
                if !variants.keys() && matches!(written, Some(Written::Struct | Written::Map)) {
                    return self.nameless(expected, &names);
                }
                self.unknown_variant(name, &names, expected, true);
            }
            Value::Object(_) if variants.keys() => {
                self.say(
                    Diagnostic::error("one-of", format!("expected exactly {expected}"))
                        .at(self.pointer(), format!("found {}", found(value))),
                );
            }
            Value::Object(_) => self.nameless(expected, &names),
            _ => {
                self.wrong_type(expected, value, node);
                if let Some(last) = self.diagnostics.last_mut() {
                    last.help = Some(allowed(names));
                }
            }
        }
    }

    fn nameless(&mut self, expected: &str, names: &[&str]) {
        self.say(
            Diagnostic::error("unknown-variant", format!("expected {expected}"))
                .at(self.pointer(), "its name is missing before the bracket")
                .help(allowed(names.iter().copied())),
        );
    }

    fn brackets(&mut self, expected: &str, node: Option<&Node>, good: &[Written], write: &str) {
        let Some(node) = node else { return };
        let empty = match &node.parts {
            Parts::None => true,
            Parts::List(list) => list.is_empty(),
            Parts::Keyed(map) => map.is_empty(),
        };
        let variant_alone = node.written == Written::Variant && good.contains(&Written::Map);
        if !good.contains(&node.written) && node.written != Written::Json && !(empty && node.written == Written::Struct)
            || variant_alone
        {
            let message = format!("expected {expected}, written `{write}`");
            self.say(Diagnostic::error("wrong-brackets", message).at(self.pointer(), "the wrong brackets"));
        }
    }

    fn object(&mut self, schema: &Value, map: &Map<String, Value>, expected: &str, node: Option<&Node>) {
        let empty = Map::new();
        let schema_is_closed = schema.get("additionalProperties") == Some(&Value::Bool(false));
        let properties = schema.get("properties").and_then(Value::as_object).unwrap_or(&empty);
        match schema.get("additionalProperties") {
            Some(Value::Bool(false)) => {
                if let Some(Node { written: Written::Variant, .. }) = node
                    && let Some(name) = map.keys().next()
                    && !properties.contains_key(name)
                {
                    return self.wrong_type(expected, &Value::Object(map.clone()), node);
                }
                self.brackets(expected, node, &[Written::Struct, Written::Variant], "(key: value, ..)");
                for (name, value) in map {
                    match properties.get(name) {
                        Some(schema) => self.down(name, schema, value, node),
                        None => self.unknown_key(name, properties),
                    }
                    if self.full() {
                        return;
                    }
                }
            }
            Some(schema @ Value::Object(_)) => {
                self.brackets(expected, node, &[Written::Map], "{ \"name\": value, .. }");
                for (name, value) in map {
                    match properties.get(name) {
                        Some(schema) => self.down(name, schema, value, node),
                        // What cannot be a value of a free name is meant for one of the keys.
                        None if !properties.is_empty() && (value.is_object() || value.is_array()) => {
                            self.unknown_key(name, properties);
                        }
                        None => self.down(name, schema, value, node),
                    }
                    if self.full() {
                        return;
                    }
                }
            }
            _ => {}
        }
        let required = schema.get("required").and_then(Value::as_array);
        let required = required.into_iter().flatten().filter_map(Value::as_str);
        // A key that is only misspelled has been reported as such.
        let unknown = map.keys().filter(|name| schema_is_closed && !properties.contains_key(*name));
        let meant: Vec<&str> = unknown.filter_map(|name| closest(name, key_names(properties))).collect();
        let missing: Vec<&str> = required.filter(|name| !map.contains_key(*name) && !meant.contains(name)).collect();
        if !missing.is_empty() {
            let keys = if missing.len() == 1 { "key" } else { "keys" };
            let message = format!("{} lacks the {keys} {}", self.owner(), list(&missing));
            let mut diagnostic = Diagnostic::error("missing-key", message).at_key(self.pointer(), "");
            for name in missing {
                if let Some(text) = properties.get(name).and_then(|schema| schema.get("description")?.as_str()) {
                    diagnostic = diagnostic.help(format!("{name}: {}", text.replace('\n', " ")));
                }
            }
            self.say(diagnostic);
        }
    }

    fn unknown_key(&mut self, name: &str, properties: &Map<String, Value>) {
        let message = format!("{} has no key `{}`", self.owner(), short(name));
        self.say(
            Diagnostic::error("unknown-key", message)
                .label(Place::Key(self.pointer() + &token(name)), "not known here")
                .help(suggest(name, key_names(properties))),
        );
    }

    fn array(&mut self, schema: &Value, list: &[Value], expected: &str, node: Option<&Node>) {
        let prefix = schema.get("prefixItems").and_then(Value::as_array);
        if let Some(prefix) = prefix {
            self.brackets(expected, node, &[Written::Tuple], "(.., ..)");
            if list.len() != prefix.len() {
                let message = format!("expected {} values, found {}", prefix.len(), list.len());
                return self.say(Diagnostic::error("wrong-length", message).at(self.pointer(), ""));
            }
            for (i, (value, schema)) in list.iter().zip(prefix).enumerate() {
                self.down(&i.to_string(), schema, value, node);
            }
        } else if let Some(schema) = schema.get("items") {
            self.brackets(expected, node, &[Written::List], "[.., ..]");
            for (i, value) in list.iter().enumerate() {
                self.down(&i.to_string(), schema, value, node);
                if self.full() {
                    return;
                }
            }
        }
    }

    fn number(&mut self, schema: &Value, value: f64, expected: &str) {
        let bound = |keyword: &str| schema.get(keyword).and_then(Value::as_f64);
        let outside = bound("minimum").is_some_and(|bound| value < bound)
            || bound("maximum").is_some_and(|bound| value > bound)
            || bound("exclusiveMinimum").is_some_and(|bound| value <= bound)
            || bound("exclusiveMaximum").is_some_and(|bound| value >= bound);
        if outside {
            self.say(
                Diagnostic::error("out-of-range", format!("expected {expected}")).at(self.pointer(), "out of range"),
            );
        }
    }
}

/// The keys of a struct that users write.
fn key_names(properties: &Map<String, Value>) -> impl Iterator<Item = &str> + Clone {
    properties.keys().map(String::as_str).filter(|name| !name.starts_with('$'))
}

fn list(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// How a variant is written, from its schema: `Cone(inclination: ..)`.
fn usage(name: &str, inner: &Value) -> String {
    let inner = resolve(inner);
    let required = inner.get("required").and_then(Value::as_array);
    match required {
        Some(keys) => {
            let keys: Vec<String> = keys.iter().filter_map(Value::as_str).map(|key| format!("{key}: ..")).collect();
            format!("{name}({})", keys.join(", "))
        }
        None => format!("{name}(..)"),
    }
}

/// The names of the JSON types that a schema admits.
fn types(schema: &Value) -> Vec<&str> {
    match schema.get("type") {
        Some(Value::String(name)) => vec![name],
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    }
}

fn is(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "number" => value.is_number(),
        "integer" => value.as_f64().is_some_and(|number| number.fract() == 0.0),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        _ => true,
    }
}

/// Equality as JSON Schema has it: numbers by value.
fn same(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a == b,
        _ => a == b,
    }
}

/// What a schema wants, in words.
fn expectation(schema: &Value) -> String {
    if let Some(title) = schema.get("title").and_then(Value::as_str) {
        return title.to_owned();
    }
    let one = |name: &str| match name {
        "object" if schema.get("properties").is_some() => "keys with values",
        "object" => "names with values",
        "array" if schema.get("prefixItems").is_some() => "a tuple",
        "array" => "a list",
        "string" => "a text in quotes",
        "number" => "a number",
        "integer" => "a whole number",
        "boolean" => "true or false",
        _ => "nothing",
    };
    let words: Vec<&str> = types(schema).into_iter().filter(|name| *name != "null").map(one).collect();
    if words.is_empty() { "something else".into() } else { words.join(" or ") }
}

/// What a value is, in words.
fn found(value: &Value) -> String {
    match value {
        Value::Null => "nothing".into(),
        Value::Bool(value) => value.to_string(),
        Value::Number(number) => format!("the number {number}"),
        Value::String(text) => format!("\"{}\"", short(text)),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(map) => match map.len() {
            0 => "nothing in the brackets".into(),
            1..=8 => format!("the keys {}", map.keys().map(|key| short(key)).collect::<Vec<_>>().join(", ")),
            n => format!("{n} keys"),
        },
    }
}
