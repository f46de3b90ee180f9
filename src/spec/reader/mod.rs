//! Text to a tree of values, with the place of every value and key.
//!
//! Reads JSON and the part of RON that problem files use, without knowing what they should contain. Enums come out
//! externally tagged, so that both syntaxes give the same tree:
//!
//! | RON | tree |
//! |---|---|
//! | `Plane` | `"Plane"` |
//! | `Cone(inclination: 1)` | `{"Cone": {"inclination": 1}}` |
//! | `Energy("..")`, `Pair(1, 2)` | `{"Energy": ".."}`, `{"Pair": [1, 2]}` |
//! | `(a: 1)`, `{"a": 1}` | `{"a": 1}` |
//! | `(1, 2)`, `[1, 2]` | `[1, 2]` |
//! | `Some(x)`, `x`; `None` | `x`; `null` |
//!
//! RON's comments (nested), trailing commas, raw strings and `_` in numbers are read; hexadecimal numbers, number
//! suffixes, ranges, characters and byte strings are not. Time and memory are linear in the length of the text: nesting
//! ends at [`MAX_DEPTH`], values at [`MAX_VALUES`], complaints at [`MAX_COMPLAINTS`].

mod brackets;
mod characters;
mod literals;

use std::ops::Range;

use indexmap::IndexMap;
use serde_json::{Map, Value};

use super::origin::{Node, Parts, Syntax, Written};
use crate::diagnostic::{Diagnostic, Place, short};

/// Brackets within brackets that a file may have.
pub const MAX_DEPTH: usize = 64;
/// Values that a file may hold.
pub const MAX_VALUES: usize = 200_000;
/// Complaints after which reading ends.
pub const MAX_COMPLAINTS: usize = 50;

/// What makes a formula of what stands before.
const OPERATORS: &[u8] = b"+-*/^.%";

/// What was read.
pub(crate) struct Reading {
    /// The tree and the places of its values; nothing where the text could not be followed to its end.
    pub tree: Option<(Value, Node)>,
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a text; `source` is what the places get as their source, `whole` whether it is a whole file.
pub(crate) fn read(text: &str, syntax: Syntax, source: usize, whole: bool) -> Reading {
    let mut reader =
        Reader { text, bytes: text.as_bytes(), at: 0, syntax, source, depth: 0, values: 0, diagnostics: Vec::new() };
    let tree = reader.document(whole).ok();
    Reading { tree, diagnostics: reader.diagnostics }
}

/// Reading cannot go on; why has been said.
struct Stop;

type Out<T> = Result<T, Stop>;
type Tree = (Value, Node);

struct Reader<'a> {
    text: &'a str,
    bytes: &'a [u8],
    at: usize,
    syntax: Syntax,
    source: usize,
    depth: usize,
    values: usize,
    diagnostics: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn document(&mut self, whole: bool) -> Out<Tree> {
        self.blank()?;
        let schema = if whole && self.syntax == Syntax::Ron { self.attributes()? } else { None };
        if self.at == self.bytes.len() {
            return self.stop(self.at..self.at, "empty-file", "there is nothing in the file", "");
        }
        let start = self.at;
        let mut tree = self.value()?;
        self.blank()?;
        if self.at < self.bytes.len() {
            let end = self.at + self.peek_char().map_or(0, char::len_utf8);
            return self.stop(self.at..end, "trailing-text", "the value ends before this", "not read any more");
        }
        if whole && tree.1.written == Written::Variant {
            tree = self.unwrap_root(tree, start)?;
        }
        if let (Some((text, key, node)), Value::Object(map), Parts::Keyed(parts)) =
            (schema, &mut tree.0, &mut tree.1.parts)
        {
            map.shift_insert(0, "$schema".into(), Value::String(text));
            parts.shift_insert(0, "$schema".into(), Node { key: Some(key), ..node });
        }
        Ok(tree)
    }

    /// `Problem( .. )` around the whole file is let pass; any other name is not.
    fn unwrap_root(&mut self, (value, node): Tree, start: usize) -> Out<Tree> {
        let (Value::Object(map), Parts::Keyed(parts)) = (value, node.parts) else { return Err(Stop) };
        match (map.into_iter().next(), parts.into_iter().next()) {
            (Some((name, value)), Some((_, inner))) => {
                if name != "Problem" {
                    let range = start..start + name.len();
                    self.report(
                        Diagnostic::error("named-root", format!("the file starts with `{}`", short(&name)))
                            .label(Place::Bytes(range), "leave this name out")
                            .help("a problem file is `( .. )`"),
                    )?;
                }
                Ok((value, Node { key: None, ..inner }))
            }
            _ => Err(Stop),
        }
    }

    /// The lines `#![..]` at the top of a RON file: `schema` is kept, `enable` and `type` are skipped.
    fn attributes(&mut self) -> Out<Option<(String, Range<usize>, Node)>> {
        let mut schema = None;
        while self.bytes[self.at..].starts_with(b"#") {
            let start = self.at;
            self.at += 1;
            for expected in [b'!', b'['] {
                self.blank()?;
                if !self.eat(expected) {
                    return self.stop(start..self.at, "syntax", "an attribute is written `#![name = \"..\"]`", "");
                }
            }
            self.blank()?;
            let key = self.word_range();
            self.blank()?;
            match &self.text[key.clone()] {
                "enable" => {
                    while self.peek().is_some_and(|byte| byte != b']') {
                        self.at += 1;
                    }
                }
                "schema" | "type" if self.eat(b'=') => {
                    self.blank()?;
                    let (value, node) = self.value()?;
                    if let (Value::String(text), "schema") = (value, &self.text[key.clone()]) {
                        schema = Some((text, key, node));
                    }
                }
                _ => {
                    return self.stop(key, "syntax", "the attributes are schema, type and enable", "");
                }
            }
            self.blank()?;
            if !self.eat(b']') {
                return self.stop(start..self.at, "syntax", "the attribute lacks its `]`", "");
            }
            self.blank()?;
        }
        Ok(schema)
    }

    fn leaf(&self, value: Value, start: usize, written: Written) -> Tree {
        (value, Node { source: self.source, span: start..self.at, key: None, written, parts: Parts::None })
    }

    fn count(&mut self) -> Out<()> {
        self.values += 1;
        if self.values > MAX_VALUES {
            let at = self.at..self.at;
            return self.stop(at, "too-many-values", "the file holds more than 200000 values", "not read any more");
        }
        Ok(())
    }

    fn deeper(&mut self, open: usize) -> Out<()> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return self.stop(open..open + 1, "too-deep", "brackets are nested more than 64 deep", "the 65th");
        }
        Ok(())
    }

    fn value(&mut self) -> Out<Tree> {
        self.count()?;
        let start = self.at;
        match self.peek() {
            None => self.stop(start..start, "syntax", "the text ends where a value should stand", "a value is missing"),
            Some(b'"') => self.string(),
            Some(b'r') if self.ron() && self.raw_hashes().is_some() => self.raw_string(),
            Some(b'(') if self.ron() => self.round(),
            Some(b'[') => self.list(),
            Some(b'{') => self.map(),
            Some(b'\'') => self.single_quoted(),
            Some(b'0'..=b'9' | b'+' | b'-' | b'.') => self.number(),
            Some(_) => {
                let word = self.word_range();
                if word.is_empty() {
                    let end = start + self.peek_char().map_or(0, char::len_utf8);
                    return self.stop(start..end, "syntax", "a value should stand here", "not the start of a value");
                }
                self.word(word)
            }
        }
    }

    /// A value that starts with this word, which has been passed.
    fn word(&mut self, word: Range<usize>) -> Out<Tree> {
        let name = &self.text[word.clone()];
        let start = word.start;
        match name {
            "true" | "false" => return Ok(self.leaf(Value::Bool(name == "true"), start, Written::Scalar)),
            "null" if !self.ron() => return Ok(self.leaf(Value::Null, start, Written::Scalar)),
            "None" if self.ron() => return Ok(self.leaf(Value::Null, start, Written::Scalar)),
            "inf" | "NaN" | "Infinity" => {
                self.complain(word, "non-finite", "numbers are finite", "not a finite number")?;
                return Ok(self.leaf(Value::from(1), start, Written::Spoiled));
            }
            _ => {}
        }
        if !self.ron() {
            let message = format!("`{}` stands without quotes", short(name));
            let diagnostic = Diagnostic::error("syntax", message).label(Place::Bytes(word), "quotes are missing");
            self.report(diagnostic)?;
            return Ok(self.leaf(Value::String(name.into()), start, Written::Spoiled));
        }
        if let Some(spoiled) = self.formula(start)? {
            return Ok(spoiled);
        }
        if self.peek() != Some(b'(') {
            return Ok((
                Value::String(name.into()),
                Node { source: self.source, span: word, key: None, written: Written::Word, parts: Parts::None },
            ));
        }
        let open = self.at;
        let (value, mut inner) = self.round()?;
        // One value without a key is the thing itself, not a tuple of one.
        let (value, inner) = match (value, inner.parts) {
            (Value::Array(mut list), Parts::List(mut nodes)) if list.len() == 1 && nodes.len() == 1 => {
                match (list.pop(), nodes.pop()) {
                    (Some(value), Some(node)) => (value, node),
                    _ => return Err(Stop),
                }
            }
            (value, parts) => {
                inner.parts = parts;
                (value, inner)
            }
        };
        if name == "Some" {
            if inner.span.start == open {
                self.complain(word, "syntax", "`Some` holds one value", "")?;
            }
            return Ok((value, inner));
        }
        let node = Node {
            source: self.source,
            span: start..self.at,
            key: None,
            written: Written::Variant,
            parts: Parts::Keyed(IndexMap::from([(name.to_owned(), Node { key: Some(word), ..inner })])),
        };
        Ok((Value::Object(Map::from_iter([(name.to_owned(), value)])), node))
    }
}
