//! Where values stand in the text they were read from.

use std::ops::Range;

use indexmap::IndexMap;

use crate::diagnostic::{Locate, Located, Place};

/// How a text is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Syntax {
    /// Rusty Object Notation.
    Ron,
    /// JSON.
    Json,
}

/// A text with its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// As the user knows it: a path, `<stdin>`, or an option such as `--set material`.
    pub name: String,
    /// The text.
    pub text: String,
    /// How it is written.
    pub syntax: Syntax,
}

/// How a value is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Written {
    /// Between quotes without an escape: byte i of the string is byte i + 1 of the text.
    Quoted,
    /// Between quotes, with escapes.
    Escaped,
    /// As a raw string whose content starts after so many bytes.
    Raw(usize),
    /// As a bare word.
    Word,
    /// A number, truth value or nothing.
    Scalar,
    /// Something about which a complaint has been made, so that the value means nothing.
    Spoiled,
    /// `[..]` in RON.
    List,
    /// `(a, b)` in RON.
    Tuple,
    /// `{..}` in RON.
    Map,
    /// `(a: b)` in RON.
    Struct,
    /// `Name(..)` in RON.
    Variant,
    /// `[..]` or `{..}` in JSON.
    Json,
}

/// The parts of a value.
#[derive(Clone, Debug)]
pub(crate) enum Parts {
    None,
    List(Vec<Node>),
    Keyed(IndexMap<String, Node>),
}

/// A value's place and those of its parts.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// Which source it is in.
    pub source: usize,
    pub span: Range<usize>,
    pub key: Option<Range<usize>>,
    pub written: Written,
    pub parts: Parts,
}

impl Node {
    /// The part with this name or position.
    pub fn part(&self, token: &str) -> Option<&Node> {
        match &self.parts {
            Parts::None => None,
            Parts::List(list) => token.parse::<usize>().ok().and_then(|i| list.get(i)),
            Parts::Keyed(map) => map.get(token),
        }
    }

    /// The same, to be changed.
    pub fn part_mut(&mut self, token: &str) -> Option<&mut Node> {
        match &mut self.parts {
            Parts::None => None,
            Parts::List(list) => token.parse::<usize>().ok().and_then(|i| list.get_mut(i)),
            Parts::Keyed(map) => map.get_mut(token),
        }
    }
}

/// The texts a document was read from and where in them its values stand.
#[derive(Clone, Debug)]
pub struct Origin {
    pub(crate) sources: Vec<Source>,
    pub(crate) root: Option<Node>,
}

impl Origin {
    /// A text of whose values nothing is known.
    pub fn new(source: Source) -> Origin {
        Origin { sources: vec![source], root: None }
    }

    /// The main text.
    pub fn source(&self) -> &Source {
        &self.sources[0]
    }

    /// The byte range of the value at a JSON pointer in its text, where the text holds one.
    pub fn value(&self, pointer: &str) -> Option<Range<usize>> {
        self.find(pointer).and_then(|(node, exact)| exact.then(|| node.span.clone()))
    }

    /// The byte range of the key of the value at a JSON pointer, where the text holds one.
    pub fn key(&self, pointer: &str) -> Option<Range<usize>> {
        self.find(pointer).and_then(|(node, exact)| if exact { node.key.clone() } else { None })
    }

    /// The node at a pointer, or the nearest one around it (then false).
    fn find(&self, pointer: &str) -> Option<(&Node, bool)> {
        let mut node = self.root.as_ref()?;
        for token in tokens(pointer) {
            match node.part(&token) {
                Some(part) => node = part,
                None => return Some((node, false)),
            }
        }
        Some((node, true))
    }
}

/// The tokens of a JSON pointer, unescaped.
pub(crate) fn tokens(pointer: &str) -> impl Iterator<Item = String> + '_ {
    pointer.split('/').skip(1).map(|token| token.replace("~1", "/").replace("~0", "~"))
}

/// A token of a JSON pointer with its slash, escaped.
pub(crate) fn token(name: &str) -> String {
    format!("/{}", name.replace('~', "~0").replace('/', "~1"))
}

impl Locate for Origin {
    fn locate(&self, place: &Place) -> Option<Located<'_>> {
        let (source, range) = match place {
            Place::None => return None,
            Place::Bytes(range) => (0, range.clone()),
            Place::Pointer(pointer) => {
                let (node, exact) = self.find(pointer)?;
                let range = if exact { node.span.clone() } else { handle(node) };
                (node.source, range)
            }
            Place::Key(pointer) => {
                let (node, _) = self.find(pointer)?;
                (node.source, handle(node))
            }
            Place::Within(pointer, inner) => {
                let (node, exact) = self.find(pointer)?;
                (node.source, if exact { within(node, inner) } else { handle(node) })
            }
        };
        let source = self.sources.get(source)?;
        let start = source.text.floor_char_boundary(range.start);
        let end = source.text.ceil_char_boundary(range.end).max(start);
        Some(Located { file: &source.name, text: &source.text, range: start..end })
    }

    fn file(&self) -> &str {
        &self.sources[0].name
    }
}

/// What to point at for a value as a whole: its key, else its opening bracket.
fn handle(node: &Node) -> Range<usize> {
    match &node.key {
        Some(key) => key.clone(),
        None if matches!(node.parts, Parts::None) => node.span.clone(),
        None => node.span.start..node.span.end.min(node.span.start + 1),
    }
}

/// A range inside a string, in the text; the whole string where escapes stand between.
fn within(node: &Node, inner: &Range<usize>) -> Range<usize> {
    let (before, after) = match node.written {
        Written::Quoted => (1, 1),
        Written::Raw(before) => (before, before - 1),
        Written::Word => (0, 0),
        _ => return node.span.clone(),
    };
    let end = node.span.end.saturating_sub(after);
    let start = (node.span.start + before).saturating_add(inner.start).min(end);
    start..(node.span.start + before).saturating_add(inner.end).clamp(start, end)
}
