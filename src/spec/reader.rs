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

use std::ops::Range;

use indexmap::IndexMap;
use indexmap::map::Entry;
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

/// How an item of a list ended.
enum Next {
    Item,
    Close,
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

    // Characters -----------------------------------------------------------------------------------------------------

    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn peek_char(&self) -> Option<char> {
        self.text.get(self.at..).and_then(|rest| rest.chars().next())
    }

    fn eat(&mut self, byte: u8) -> bool {
        let found = self.peek() == Some(byte);
        self.at += usize::from(found);
        found
    }

    fn ron(&self) -> bool {
        self.syntax == Syntax::Ron
    }

    /// Skips blanks and comments.
    fn blank(&mut self) -> Out<()> {
        loop {
            match self.peek() {
                Some(b' ' | b'\t' | b'\n' | b'\r') => self.at += 1,
                Some(b'/') if matches!(self.bytes.get(self.at + 1), Some(b'/' | b'*')) => self.comment()?,
                Some(byte) if byte == 0x0b || byte == 0x0c || byte >= 0x80 => match self.peek_char() {
                    Some(c) if c.is_whitespace() && self.ron() => self.at += c.len_utf8(),
                    _ => return Ok(()),
                },
                _ => return Ok(()),
            }
        }
    }

    fn comment(&mut self) -> Out<()> {
        let start = self.at;
        if !self.ron() {
            self.complain(start..start + 2, "syntax", "JSON has no comments", "")?;
        }
        if self.bytes[self.at + 1] == b'/' {
            self.at = self.text[self.at..].find('\n').map_or(self.bytes.len(), |i| self.at + i + 1);
            return Ok(());
        }
        let mut open = 0usize;
        while let Some(byte) = self.peek() {
            match (byte, self.bytes.get(self.at + 1)) {
                (b'/', Some(b'*')) => (open, self.at) = (open + 1, self.at + 2),
                (b'*', Some(b'/')) => {
                    (open, self.at) = (open - 1, self.at + 2);
                    if open == 0 {
                        return Ok(());
                    }
                }
                _ => self.at += 1,
            }
        }
        self.stop(start..start + 2, "syntax", "this comment does not end", "opened here")
    }

    /// The word that starts here; empty where there is none.
    fn word_range(&mut self) -> Range<usize> {
        let start = self.at;
        while let Some(c) = self.peek_char() {
            if c == '_' || c.is_alphanumeric() && (self.at > start || !c.is_ascii_digit()) {
                self.at += c.len_utf8();
            } else {
                break;
            }
        }
        start..self.at
    }

    // Complaints -----------------------------------------------------------------------------------------------------

    fn report(&mut self, diagnostic: Diagnostic) -> Out<()> {
        self.diagnostics.push(diagnostic);
        if self.diagnostics.len() < MAX_COMPLAINTS {
            return Ok(());
        }
        self.diagnostics.push(Diagnostic::error("too-many-errors", "there are more errors than are reported"));
        Err(Stop)
    }

    fn complain(&mut self, at: Range<usize>, code: &'static str, message: &str, label: &str) -> Out<()> {
        self.report(Diagnostic::error(code, message).label(Place::Bytes(at), label))
    }

    fn stop<T>(&mut self, at: Range<usize>, code: &'static str, message: &str, label: &str) -> Out<T> {
        self.complain(at, code, message, label)?;
        Err(Stop)
    }

    // Values ---------------------------------------------------------------------------------------------------------

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

    /// `( .. )`: keys and values, or values alone. Empty, it has no keys.
    fn round(&mut self) -> Out<Tree> {
        let open = self.at;
        self.at += 1;
        self.deeper(open)?;
        let mut map = Map::new();
        let mut keyed = IndexMap::new();
        let mut list = Vec::new();
        let mut nodes = Vec::new();
        let mut has_keys = None;
        let mut first = true;
        while let Next::Item = self.next(open, b')', &mut first)? {
            let start = self.at;
            let mut key = None;
            let item = match self.peek() {
                Some(b'"') => {
                    let (name, node) = self.string()?;
                    self.blank()?;
                    if matches!(self.peek(), Some(b':' | b'=')) {
                        self.complain(
                            node.span.clone(),
                            "quoted-key",
                            "the format's own keys have no quotes",
                            "leave the quotes out, or write `{ .. }` for names that you invent",
                        )?;
                        key = name.as_str().map(|name| (name.to_owned(), node.span));
                        None
                    } else {
                        self.count()?;
                        Some((name, node))
                    }
                }
                Some(b'r') if self.raw_hashes().is_some() => Some(self.value()?),
                Some(b) if b.is_ascii_alphabetic() || b == b'_' || b >= 0x80 => {
                    let word = self.word_range();
                    if word.is_empty() {
                        Some(self.value()?)
                    } else {
                        self.blank()?;
                        if matches!(self.peek(), Some(b':' | b'=')) {
                            key = Some((self.text[word.clone()].to_owned(), word));
                            None
                        } else {
                            self.count()?;
                            Some(self.word(word)?)
                        }
                    }
                }
                _ => Some(self.value()?),
            };
            match (item, key) {
                (Some((value, node)), _) => {
                    if has_keys == Some(true) {
                        self.complain(
                            start..node.span.end,
                            "missing-key-name",
                            "this value has no key",
                            "write `key: value`",
                        )?;
                    } else {
                        has_keys = Some(false);
                        list.push(value);
                        nodes.push(node);
                    }
                }
                (None, Some((name, range))) => {
                    let (value, node) = self.keyed(&range)?;
                    if has_keys == Some(false) {
                        self.complain(
                            range,
                            "missing-key-name",
                            "some values here have a key, some do not",
                            "has a key",
                        )?;
                    } else {
                        has_keys = Some(true);
                        self.insert(&mut map, &mut keyed, name, value, node)?;
                    }
                }
                (None, None) => return Err(Stop),
            }
        }
        self.depth -= 1;
        let span = open..self.at;
        let (value, written, parts) = if has_keys == Some(false) {
            (Value::Array(list), Written::Tuple, Parts::List(nodes))
        } else {
            (Value::Object(map), Written::Struct, Parts::Keyed(keyed))
        };
        Ok((value, Node { source: self.source, span, key: None, written, parts }))
    }

    fn list(&mut self) -> Out<Tree> {
        let open = self.at;
        self.at += 1;
        self.deeper(open)?;
        let (mut list, mut nodes, mut first) = (Vec::new(), Vec::new(), true);
        while let Next::Item = self.next(open, b']', &mut first)? {
            let (value, node) = self.value()?;
            list.push(value);
            nodes.push(node);
        }
        self.depth -= 1;
        let written = if self.ron() { Written::List } else { Written::Json };
        let node = Node { source: self.source, span: open..self.at, key: None, written, parts: Parts::List(nodes) };
        Ok((Value::Array(list), node))
    }

    fn map(&mut self) -> Out<Tree> {
        let open = self.at;
        self.at += 1;
        self.deeper(open)?;
        let (mut map, mut keyed, mut first) = (Map::new(), IndexMap::new(), true);
        while let Next::Item = self.next(open, b'}', &mut first)? {
            let start = self.at;
            let name = if self.peek() == Some(b'"') {
                self.string()?.0
            } else if self.ron() && self.peek() == Some(b'r') && self.raw_hashes().is_some() {
                self.raw_string()?.0
            } else {
                let mut word = self.word_range();
                if word.is_empty() {
                    let end = start + self.peek_char().map_or(0, char::len_utf8);
                    word = start..end;
                    return self.stop(word, "syntax", "a key in quotes should stand here", "not a key");
                }
                let help = if self.ron() { "names that you invent stand in quotes" } else { "quotes are missing" };
                self.complain(word.clone(), "unquoted-key", "keys in `{ .. }` have quotes", help)?;
                Value::String(self.text[word].into())
            };
            let key = start..self.at;
            self.blank()?;
            let (value, node) = self.keyed(&key)?;
            if let Value::String(name) = name {
                self.insert(&mut map, &mut keyed, name, value, node)?;
            }
        }
        self.depth -= 1;
        let written = if self.ron() { Written::Map } else { Written::Json };
        let node = Node { source: self.source, span: open..self.at, key: None, written, parts: Parts::Keyed(keyed) };
        Ok((Value::Object(map), node))
    }

    /// `: value` behind a key.
    fn keyed(&mut self, key: &Range<usize>) -> Out<Tree> {
        if self.peek() == Some(b'=') {
            self.complain(self.at..self.at + 1, "syntax", "a key is followed by `:`", "write `:`")?;
            self.at += 1;
        } else if !self.eat(b':') {
            return self.stop(key.clone(), "syntax", "this key has no value", "`:` and a value should follow");
        }
        self.blank()?;
        if matches!(self.peek(), Some(b',' | b')' | b']' | b'}')) {
            return self.stop(key.clone(), "syntax", "this key has no value", "a value should follow");
        }
        let (value, node) = self.value()?;
        Ok((value, Node { key: Some(key.clone()), ..node }))
    }

    fn insert(
        &mut self,
        map: &mut Map<String, Value>,
        nodes: &mut IndexMap<String, Node>,
        name: String,
        value: Value,
        node: Node,
    ) -> Out<()> {
        match nodes.entry(name) {
            Entry::Vacant(place) => {
                map.insert(place.key().clone(), value);
                place.insert(node);
                Ok(())
            }
            Entry::Occupied(place) => {
                let message = format!("the key `{}` is given twice", short(place.key()));
                let again = node.key.unwrap_or(node.span);
                let first = place.get().key.clone().unwrap_or_else(|| place.get().span.clone());
                self.report(
                    Diagnostic::error("duplicate-key", message)
                        .label(Place::Bytes(again), "given again")
                        .label(Place::Bytes(first), "given first"),
                )
            }
        }
    }

    /// Goes to the next item of a bracket or past its end.
    fn next(&mut self, open: usize, close: u8, first: &mut bool) -> Out<Next> {
        self.blank()?;
        if !std::mem::replace(first, false) {
            self.separator()?;
        }
        match self.peek() {
            Some(byte) if byte == close => {
                self.at += 1;
                Ok(Next::Close)
            }
            Some(byte @ (b')' | b']' | b'}')) => {
                let message = format!("`{}` does not close `{}`", char::from(byte), char::from(self.bytes[open]));
                self.report(
                    Diagnostic::error("syntax", message)
                        .label(Place::Bytes(self.at..self.at + 1), format!("`{}` expected", char::from(close)))
                        .label(Place::Bytes(open..open + 1), "opened here"),
                )?;
                Err(Stop)
            }
            None => {
                let message = format!("`{}` is not closed", char::from(self.bytes[open]));
                self.stop(open..open + 1, "syntax", &message, "opened here")
            }
            Some(b',') => self.stop(self.at..self.at + 1, "syntax", "nothing stands before this comma", ""),
            Some(_) => Ok(Next::Item),
        }
    }

    /// The comma behind an item.
    fn separator(&mut self) -> Out<()> {
        let start = self.at;
        match self.peek() {
            None | Some(b')' | b']' | b'}') => Ok(()),
            Some(b',') => {
                self.at += 1;
                self.blank()?;
                if !self.ron() && matches!(self.peek(), Some(b']' | b'}')) {
                    self.complain(start..start + 1, "syntax", "JSON has no comma after the last item", "")?;
                }
                Ok(())
            }
            Some(b';') => {
                self.complain(start..start + 1, "syntax", "items are separated by commas", "write `,`")?;
                self.at += 1;
                self.blank()
            }
            Some(byte) if OPERATORS.contains(&byte) => {
                self.formula(start)?;
                self.separator()
            }
            Some(byte) if matches!(byte, b'"' | b'(' | b'[' | b'{' | b'_') || byte.is_ascii_alphanumeric() => {
                self.complain(start..start + 1, "missing-comma", "a comma is missing", "before this")
            }
            Some(_) => {
                let end = start + self.peek_char().map_or(0, char::len_utf8);
                self.stop(start..end, "syntax", "a comma or a closing bracket should stand here", "not expected")
            }
        }
    }

    /// Where an operator follows, skips what looks like the rest of a formula on this line, and complains that the
    /// formula, which starts at `start`, has no quotes.
    fn formula(&mut self, start: usize) -> Out<Option<Tree>> {
        self.blank()?;
        if !self.peek().is_some_and(|byte| OPERATORS.contains(&byte)) {
            return Ok(None);
        }
        let mut open = 0usize;
        while let Some(byte) = self.peek() {
            match byte {
                b'\n' | b'"' | b'{' | b'}' => break,
                b'(' | b'[' => open += 1,
                b')' | b']' if open == 0 => break,
                b')' | b']' => open -= 1,
                b',' if open == 0 => break,
                _ => {}
            }
            self.at += 1;
        }
        let range = start..start + self.text[start..self.at].trim_end().len();
        self.complain(range, "unquoted-formula", "formulas and dotted names stand in quotes", "quotes are missing")?;
        self.blank()?;
        Ok(Some(self.leaf(Value::from(1), start, Written::Spoiled)))
    }

    // Numbers --------------------------------------------------------------------------------------------------------

    fn number(&mut self) -> Out<Tree> {
        let start = self.at;
        let mut last = 0;
        while let Some(byte) = self.peek() {
            let sign = matches!(byte, b'+' | b'-') && (self.at == start || matches!(last, b'e' | b'E'));
            if !(sign || byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.')) {
                break;
            }
            last = byte;
            self.at += 1;
        }
        let span = start..self.at;
        let token = &self.text[span.clone()];
        let placeholder = Value::from(1);
        if self.peek() == Some(b'[') && token.bytes().any(|byte| byte.is_ascii_digit()) {
            let end = self.text[self.at..].find([']', '\n', ',']).map_or(self.bytes.len(), |i| self.at + i);
            self.at = end;
            self.eat(b']');
            let example = short(&self.text[start..self.at]);
            let diagnostic = Diagnostic::error("unquoted-unit", "a number with a unit stands in quotes");
            self.report(diagnostic.label(Place::Bytes(start..self.at), format!("write \"{example}\"")))?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        }
        let plain: String = if self.ron() { token.replace('_', "") } else { token.into() };
        if !decimal(&plain) || token.starts_with('_') {
            let unsigned = plain.trim_start_matches(['+', '-']);
            let (code, message, label) = match unsigned.as_bytes() {
                [b'0', b'x' | b'X' | b'b' | b'o', ..] => ("bad-number", "numbers are written in decimal", ""),
                [b'i' | b'I', b'n', ..] | [b'N', b'a', ..] => {
                    ("non-finite", "numbers are finite", "not a finite number")
                }
                [b'a'..=b'z' | b'A'..=b'Z', ..] => {
                    ("unquoted-formula", "formulas and dotted names stand in quotes", "quotes are missing")
                }
                _ if plain.contains("..") => ("bad-number", "there are no ranges", "not a number"),
                _ => ("bad-number", "this is not a number", "a number with a unit is written \"40[deg]\""),
            };
            self.complain(span, code, message, label)?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        }
        if !self.ron() && !json_decimal(token) {
            self.complain(span.clone(), "syntax", "JSON does not write a number like this", "")?;
        }
        let value = if plain.bytes().all(|byte| byte.is_ascii_digit() || matches!(byte, b'+' | b'-')) {
            match (plain.parse::<u64>(), plain.parse::<i64>()) {
                (Ok(value), _) if !plain.starts_with('-') => Some(Value::from(value)),
                (_, Ok(value)) if value != 0 => Some(Value::from(value)),
                _ => None,
            }
        } else {
            None
        };
        let value =
            value.or_else(|| plain.parse::<f64>().ok().and_then(serde_json::Number::from_f64).map(Value::Number));
        let Some(value) = value else {
            self.complain(span, "non-finite", "the number is too large", "beyond 1.8e308")?;
            return Ok(self.leaf(placeholder, start, Written::Spoiled));
        };
        let tree = self.leaf(value, start, Written::Scalar);
        Ok(self.formula(start)?.unwrap_or(tree))
    }

    // Strings --------------------------------------------------------------------------------------------------------

    fn string(&mut self) -> Out<Tree> {
        let start = self.at;
        self.at += 1;
        let mut text = String::new();
        let mut written = Written::Quoted;
        loop {
            let rest = &self.bytes[self.at..];
            let Some(i) = rest.iter().position(|&byte| matches!(byte, b'"' | b'\\') || byte < 0x20) else {
                self.at = self.bytes.len();
                return self.stop(start..start + 1, "syntax", "this string does not end", "opened here");
            };
            text.push_str(&self.text[self.at..self.at + i]);
            self.at += i;
            match rest[i] {
                b'"' => break,
                b'\\' => {
                    written = Written::Escaped;
                    let escape = self.at;
                    match self.escape() {
                        Some(c) => text.push(c),
                        None => {
                            self.at = self.text.ceil_char_boundary(self.at.max(escape + 1));
                            self.complain(
                                escape..self.at,
                                "bad-escape",
                                "this escape is not known",
                                "write \\\\ for \\",
                            )?;
                            text.push('\u{fffd}');
                        }
                    }
                }
                byte => {
                    if !self.ron() {
                        let at = self.at..self.at + 1;
                        self.complain(
                            at,
                            "syntax",
                            "JSON strings have no control characters",
                            "write it as an escape",
                        )?;
                    }
                    text.push(char::from(byte));
                    self.at += 1;
                }
            }
        }
        self.at += 1;
        Ok(self.leaf(Value::String(text), start, written))
    }

    /// The character that an escape stands for. Where there is none, the position is somewhere in the escape.
    fn escape(&mut self) -> Option<char> {
        self.at += 1;
        let byte = self.peek()?;
        if !byte.is_ascii() {
            return None;
        }
        self.at += 1;
        match (byte, self.syntax) {
            (b'"' | b'\\', _) => Some(char::from(byte)),
            (b'n', _) => Some('\n'),
            (b'r', _) => Some('\r'),
            (b't', _) => Some('\t'),
            (b'/', Syntax::Json) => Some('/'),
            (b'b', Syntax::Json) => Some('\u{8}'),
            (b'f', Syntax::Json) => Some('\u{c}'),
            (b'u', Syntax::Json) => {
                let high = self.hex(4)?;
                if !(0xd800..0xdc00).contains(&high) {
                    return char::from_u32(high);
                }
                if !(self.eat(b'\\') && self.eat(b'u')) {
                    return None;
                }
                let low = self.hex(4)?;
                if !(0xdc00..0xe000).contains(&low) {
                    return None;
                }
                char::from_u32(0x10000 + ((high - 0xd800) << 10) + (low - 0xdc00))
            }
            (b'0', Syntax::Ron) => Some('\0'),
            (b'\'', Syntax::Ron) => Some('\''),
            (b'x', Syntax::Ron) => char::from_u32(self.hex(2)?),
            (b'u', Syntax::Ron) => {
                if !self.eat(b'{') {
                    return None;
                }
                let digits = self.bytes[self.at..].iter().take(7).take_while(|byte| byte.is_ascii_hexdigit()).count();
                if !(1..=6).contains(&digits) {
                    return None;
                }
                let code = self.hex(digits)?;
                if self.eat(b'}') { char::from_u32(code) } else { None }
            }
            _ => None,
        }
    }

    fn hex(&mut self, digits: usize) -> Option<u32> {
        let text = self.bytes.get(self.at..self.at + digits)?;
        if !text.iter().all(u8::is_ascii_hexdigit) {
            return None;
        }
        let code = u32::from_str_radix(std::str::from_utf8(text).ok()?, 16).ok()?;
        self.at += digits;
        Some(code)
    }

    /// The number of `#` of the raw string that starts here, where one does.
    fn raw_hashes(&self) -> Option<usize> {
        let rest = self.bytes.get(self.at + 1..)?;
        let hashes = rest.iter().take_while(|&&byte| byte == b'#').count();
        (rest.get(hashes) == Some(&b'"')).then_some(hashes)
    }

    fn raw_string(&mut self) -> Out<Tree> {
        let start = self.at;
        let hashes = self.raw_hashes().unwrap_or(0);
        let content = start + hashes + 2;
        let mut at = content;
        while let Some(i) = self.text[at..].find('"') {
            let end = at + i;
            let closing = self.bytes[end + 1..].iter().take(hashes).take_while(|&&byte| byte == b'#').count();
            if closing == hashes {
                self.at = end + 1 + hashes;
                let text = Value::String(self.text[content..end].into());
                return Ok(self.leaf(text, start, Written::Raw(hashes + 2)));
            }
            at = end + 1;
        }
        self.stop(start..content, "syntax", "this raw string does not end", "opened here")
    }

    fn single_quoted(&mut self) -> Out<Tree> {
        let start = self.at;
        let line = self.text[start + 1..].find(['\'', '\n']).map(|i| start + 1 + i);
        let Some(end) = line.filter(|&end| self.bytes[end] == b'\'') else {
            return self.stop(start..start + 1, "syntax", "text stands between \"double quotes\"", "");
        };
        self.at = end + 1;
        self.complain(start..self.at, "single-quotes", "text stands between \"double quotes\"", "")?;
        Ok(self.leaf(Value::String(self.text[start + 1..end].into()), start, Written::Quoted))
    }
}

/// Whether this is a decimal number: `1`, `+1.`, `.5`, `1e-3`.
fn decimal(token: &str) -> bool {
    let token = token.strip_prefix(['+', '-']).unwrap_or(token);
    let (mantissa, exponent) = match token.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (token, None),
    };
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let mantissa = (digits(whole) || whole.is_empty()) && (digits(fraction) || fraction.is_empty());
    let some = !(whole.is_empty() && fraction.is_empty());
    mantissa && some && exponent.is_none_or(|exponent| digits(exponent.strip_prefix(['+', '-']).unwrap_or(exponent)))
}

/// Whether a decimal number is written as JSON has it.
fn json_decimal(token: &str) -> bool {
    let token = token.strip_prefix('-').unwrap_or(token);
    let mantissa = token.split(['e', 'E']).next().unwrap_or("");
    let (whole, fraction) = mantissa.split_once('.').map_or((mantissa, None), |(whole, rest)| (whole, Some(rest)));
    let plain = |byte: u8| byte.is_ascii_digit();
    !whole.is_empty()
        && whole.bytes().all(plain)
        && (whole == "0" || !whole.starts_with('0'))
        && fraction.is_none_or(|fraction| !fraction.is_empty())
}
