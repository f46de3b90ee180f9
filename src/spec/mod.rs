//! What is said: the words of a problem file, read from text.
//!
//! `text -> tree of values with places -> Problem`, with all errors at once and each at its place in the text. This
//! layer knows which words exist ([`Problem`]) and nothing of what they mean: formulas stay text, names are not looked
//! up, nothing is counted or solved. Later layers name places by JSON pointer ([`crate::diagnostic::Place`]), and the
//! [`Document`] finds them in the text.
//!
//! [`Source`] and [`Origin`] hold texts and places, `reader` reads RON and JSON alike, [`schema`] says what a tree may
//! contain, [`convert`] writes a problem as text.

pub mod body;
pub mod convert;
pub mod matter;
pub mod meridian;
mod origin;
pub mod problem;
pub mod quantity;
pub(crate) mod reader;
pub mod schema;

use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::diagnostic::{Diagnostic, Locate, Located, Place, closest};
use origin::{Node, Parts, token, tokens};

pub use body::{Body, Face, Facing, Shape};
pub use matter::{Area, Fluid, Inflation, Initial, Material, OgdenTerm, Reference, Substrate, Traction, Wrinkling};
pub use meridian::{Appears, ContactLaw, ContactSearch, Element, KinkLaw};
pub use origin::{Origin, Source, Syntax};
pub use problem::{Branch, Case, Expectation, Figure, Problem, Scale, Spacing, Sweep, Units, Values};
pub use quantity::{Count, Equation, FormatVersion, Formula, Name, Number, Tolerance};
pub use schema::schema_text;

/// Bytes that a problem file may have.
pub const MAX_BYTES: u64 = 16 * 1024 * 1024;

/// A problem with the text it was read from.
#[derive(Clone, Debug)]
pub struct Document {
    /// The texts and where in them values stand.
    pub origin: Origin,
    /// The tree of values, as written.
    pub value: Value,
    /// The problem.
    pub problem: Problem,
}

/// A text that is not a problem, with all that is wrong with it.
#[derive(Clone, Debug)]
pub struct Rejected {
    /// The texts and, as far as they could be read, where in them values stand.
    pub origin: Origin,
    /// What is wrong, at least one error.
    pub diagnostics: Vec<Diagnostic>,
}

impl Locate for Document {
    fn locate(&self, place: &Place) -> Option<Located<'_>> {
        self.origin.locate(place)
    }
    fn file(&self) -> &str {
        self.origin.file()
    }
}

impl Locate for Rejected {
    fn locate(&self, place: &Place) -> Option<Located<'_>> {
        self.origin.locate(place)
    }
    fn file(&self) -> &str {
        self.origin.file()
    }
}

impl Rejected {
    fn new(source: Source, diagnostic: Diagnostic) -> Box<Rejected> {
        Box::new(Rejected { origin: Origin::new(source), diagnostics: vec![diagnostic] })
    }
}

impl Document {
    /// Reads a problem from a text.
    ///
    /// # Errors
    ///
    /// All errors of syntax and, where the text could be followed to its end, of words and types.
    pub fn read(source: Source) -> Result<Document, Box<Rejected>> {
        let reading = reader::read(&source.text, source.syntax, 0, true);
        let origin = Origin::new(source);
        match reading.tree {
            Some((value, node)) => {
                Document::from_tree(Origin { root: Some(node), ..origin }, value, reading.diagnostics)
            }
            None => Err(Box::new(Rejected { origin, diagnostics: reading.diagnostics })),
        }
    }

    /// Reads a problem from a file, or from standard input where the path is `-`; see [`load`].
    ///
    /// # Errors
    ///
    /// Those of [`load`] and of [`Document::read`].
    pub fn load(path: &str, syntax: Option<Syntax>) -> Result<Document, Box<Rejected>> {
        Document::read(load(path, syntax)?)
    }

    /// The same document with another value at a JSON pointer, read from a text such as an option's argument. The value
    /// at the pointer may be new; what surrounds it must exist. Complaints about it show that text.
    ///
    /// # Errors
    ///
    /// Errors of the text, and of the document as it then stands.
    pub fn replace(&self, pointer: &str, source: Source) -> Result<Document, Box<Rejected>> {
        let index = self.origin.sources.len();
        let reading = reader::read(&source.text, source.syntax, index, false);
        let Some((value, node)) = reading.tree.filter(|_| reading.diagnostics.is_empty()) else {
            return Err(Box::new(Rejected { origin: Origin::new(source), diagnostics: reading.diagnostics }));
        };
        let mut document = self.clone();
        let mut path: Vec<String> = tokens(pointer).collect();
        let missing = |source: Source| {
            let message = format!("there is nothing at `{pointer}` that could be set");
            Err(Rejected::new(source, Diagnostic::error("unknown-key", message)))
        };
        let Some(last) = path.pop() else { return missing(source) };
        let around: String = path.iter().map(|name| token(name)).collect();
        let root = document.origin.root.as_mut();
        let outer = root.and_then(|root| path.iter().try_fold(root, |node, name| node.part_mut(name)));
        match (document.value.pointer_mut(&around), outer) {
            (Some(Value::Object(map)), Some(Node { parts: Parts::Keyed(parts), .. })) => {
                map.insert(last.clone(), value);
                parts.insert(last, node);
            }
            (Some(Value::Array(list)), Some(Node { parts: Parts::List(parts), .. })) => {
                let place = last.parse::<usize>().ok().filter(|&i| i < list.len() && i < parts.len());
                let Some(place) = place else { return missing(source) };
                list[place] = value;
                parts[place] = node;
            }
            _ => return missing(source),
        }
        document.origin.sources.push(source);
        Document::from_tree(document.origin, document.value, Vec::new())
    }

    fn from_tree(origin: Origin, value: Value, mut diagnostics: Vec<Diagnostic>) -> Result<Document, Box<Rejected>> {
        if let Some(root) = &origin.root {
            diagnostics.extend(schema::explain(&value, root));
        }
        if diagnostics.is_empty() {
            match Problem::deserialize(&value) {
                Ok(problem) => return Ok(Document { origin, value, problem }),
                Err(error) => {
                    let judged = schema::judge(&value).err().unwrap_or_default();
                    diagnostics.push(Diagnostic::error("not-a-problem", error.to_string()).help(judged));
                }
            }
        }
        // In the order of the text.
        let place = |diagnostic: &Diagnostic| {
            let at = diagnostic.labels.first().and_then(|label| origin.locate(&label.at));
            at.map_or(0, |at| at.range.start)
        };
        diagnostics.sort_by_cached_key(place);
        Err(Box::new(Rejected { origin, diagnostics }))
    }
}

/// Reads the text of a problem file, or of standard input where the path is `-`. The syntax is that of the file's
/// extension unless given; standard input is RON unless given.
///
/// # Errors
///
/// A file that is missing, a directory, empty, larger than [`MAX_BYTES`], not UTF-8, or of an unknown extension.
pub fn load(path: &str, syntax: Option<Syntax>) -> Result<Source, Box<Rejected>> {
    let standard_input = path == "-";
    let name = if standard_input { "<stdin>" } else { path };
    let source = |text: String, syntax| Source { name: name.into(), text, syntax };
    let refuse = |diagnostic| Err(Rejected::new(source(String::new(), Syntax::Ron), diagnostic));
    let unreadable = |error: std::io::Error| {
        Rejected::new(
            source(String::new(), Syntax::Ron),
            Diagnostic::error("unreadable", format!("the file cannot be read: {error}")),
        )
    };
    let extension = Path::new(path).extension().map(|extension| extension.to_string_lossy().to_lowercase());
    let known = match extension.as_deref() {
        Some("ron") => Some(Syntax::Ron),
        Some("json") => Some(Syntax::Json),
        _ => None,
    };
    let mut bytes = Vec::new();
    if standard_input {
        std::io::stdin().lock().take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    } else {
        let metadata = std::fs::metadata(path).map_err(unreadable)?;
        if metadata.is_dir() {
            return refuse(Diagnostic::error("directory", "this is a directory, not a problem file"));
        }
        if syntax.is_none() && known.is_none() {
            let message = match &extension {
                Some(extension) => format!("the extension `.{extension}` is not known"),
                None => "the file has no extension".into(),
            };
            let mut diagnostic = Diagnostic::error("unknown-extension", message);
            if let Some(meant) = extension.as_deref().and_then(|name| closest(name, ["ron", "json"])) {
                diagnostic = diagnostic.help(format!("did you mean `.{meant}`?"));
            }
            return refuse(diagnostic.help("problem files end in .ron or .json"));
        }
        if metadata.len() > MAX_BYTES {
            return refuse(too_large());
        }
        File::open(path).and_then(|file| file.take(MAX_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    }
    if bytes.len() as u64 > MAX_BYTES {
        return refuse(too_large());
    }
    match decode(bytes) {
        Ok(text) if text.trim().is_empty() => refuse(Diagnostic::error("empty-file", "there is nothing in the file")),
        Ok(text) => Ok(source(text, syntax.or(known).unwrap_or(Syntax::Ron))),
        Err(message) => refuse(Diagnostic::error("not-utf8", message).help("save the file as UTF-8")),
    }
}

fn too_large() -> Diagnostic {
    Diagnostic::error("file-too-large", "the file is larger than 16 MB, which is more than a problem file may be")
}

/// UTF-8 without its byte order mark, or what else it seems to be.
fn decode(mut bytes: Vec<u8>) -> Result<String, String> {
    let named = |name: &str| Err(format!("the file is written in {name}, not in UTF-8"));
    match bytes.as_slice() {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => return named("UTF-32"),
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => return named("UTF-16"),
        [0xef, 0xbb, 0xbf, ..] => drop(bytes.drain(..3)),
        [0, second, ..] | [second, 0, ..] if *second != 0 => return named("what seems to be UTF-16"),
        _ => {}
    }
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count();
        format!("the file is not UTF-8: line {line}, byte {valid} of the file")
    })
}

/// Whether a key has the value that it has when it is left out.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
