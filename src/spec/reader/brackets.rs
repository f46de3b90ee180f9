//! What stands in brackets: lists, maps and structs, their keys and commas, and formulas that lack their quotes.

use super::{OPERATORS, Out, Reader, Stop, Tree};
use crate::diagnostic::{Diagnostic, Place, short};
use crate::spec::origin::{Node, Parts, Written};
use indexmap::IndexMap;
use indexmap::map::Entry;
use serde_json::{Map, Value};
use std::ops::Range;

/// How an item of a list ended.
enum Next {
    Item,
    Close,
}

impl Reader<'_> {
    /// `( .. )`: keys and values, or values alone. Empty, it has no keys.
    pub(super) fn round(&mut self) -> Out<Tree> {
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

    pub(super) fn list(&mut self) -> Out<Tree> {
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

    pub(super) fn map(&mut self) -> Out<Tree> {
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
    pub(super) fn keyed(&mut self, key: &Range<usize>) -> Out<Tree> {
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

    pub(super) fn insert(
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
    pub(super) fn separator(&mut self) -> Out<()> {
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
    pub(super) fn formula(&mut self, start: usize) -> Out<Option<Tree>> {
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
}
