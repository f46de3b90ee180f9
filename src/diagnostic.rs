//! Complaints about a problem: what is wrong, where it stands in the text, and what would be right.
//!
//! A diagnostic names places by JSON pointer; whoever holds the text resolves them ([`Locate`]). Nothing here knows
//! what a problem file contains.

use std::ops::Range;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use serde_json::{Value, json};

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The problem cannot be solved as it stands.
    Error,
    /// It can, but is probably not what was meant.
    Warning,
}

/// A place in a problem file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The value at this JSON pointer.
    Pointer(String),
    /// The key of the value at this JSON pointer.
    Key(String),
    /// A byte range inside the string at this JSON pointer, such as a name in a formula.
    Within(String, Range<usize>),
    /// A byte range of the file's text.
    Bytes(Range<usize>),
    /// The file as a whole.
    None,
}

/// A place with what there is to say about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub at: Place,
    /// A few words; may be empty.
    pub text: String,
}

/// One complaint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Stable name of the kind of complaint, kebab-case, such as `unknown-key`.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// Where; the first is the place that is reported as line and column.
    pub labels: Vec<Label>,
    /// What would be right.
    pub help: Option<String>,
}

impl Diagnostic {
    /// An error without a place yet.
    pub fn error(code: &'static str, message: impl Into<String>) -> Self {
        Diagnostic { code, severity: Severity::Error, message: message.into(), labels: Vec::new(), help: None }
    }

    /// A warning without a place yet.
    pub fn warning(code: &'static str, message: impl Into<String>) -> Self {
        Diagnostic { severity: Severity::Warning, ..Diagnostic::error(code, message) }
    }

    /// Adds a label at the value at a JSON pointer.
    pub fn at(self, pointer: impl Into<String>, text: impl Into<String>) -> Self {
        self.label(Place::Pointer(pointer.into()), text)
    }

    /// Adds a label at the key of the value at a JSON pointer.
    pub fn at_key(self, pointer: impl Into<String>, text: impl Into<String>) -> Self {
        self.label(Place::Key(pointer.into()), text)
    }

    /// Adds a label at a byte range inside the string at a JSON pointer.
    pub fn within(self, pointer: impl Into<String>, range: Range<usize>, text: impl Into<String>) -> Self {
        self.label(Place::Within(pointer.into(), range), text)
    }

    /// Adds a label at any place.
    pub fn label(mut self, at: Place, text: impl Into<String>) -> Self {
        self.labels.push(Label { at, text: text.into() });
        self
    }

    /// Says what would be right. Several helps stand on lines of their own.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        let help = help.into();
        match &mut self.help {
            Some(before) if !help.is_empty() => {
                before.push('\n');
                before.push_str(&help);
            }
            None if !help.is_empty() => self.help = Some(help),
            _ => {}
        }
        self
    }
}

/// A place found in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Located<'a> {
    /// Name of the text, as the user knows it (a path, or what an option is called).
    pub file: &'a str,
    /// The whole text.
    pub text: &'a str,
    /// The place as a byte range of it, on character boundaries.
    pub range: Range<usize>,
}

/// Finds places in texts.
pub trait Locate {
    /// Where a place is; the nearest enclosing one where the text does not hold it, nothing for [`Place::None`].
    fn locate(&self, place: &Place) -> Option<Located<'_>>;
    /// The name of the main text.
    fn file(&self) -> &str;
}

/// Complaints with the texts that they are about.
pub type Complaints = (Box<dyn Locate>, Vec<Diagnostic>);

/// Line and column of a byte offset, both from 1, the column in characters.
pub fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let offset = text.floor_char_boundary(offset);
    let start = text[..offset].rfind('\n').map_or(0, |i| i + 1);
    let line = 1 + text.as_bytes()[..start].iter().filter(|&&byte| byte == b'\n').count();
    (line, 1 + text[start..offset].chars().count())
}

/// The diagnostics as JSON objects `{code, severity, message, file, line, column, help}`; line and column are null
/// where a complaint has no place.
pub fn to_json(diagnostics: &[Diagnostic], places: &dyn Locate) -> Vec<Value> {
    let object = |diagnostic: &Diagnostic| {
        let located = diagnostic.labels.iter().find_map(|label| places.locate(&label.at));
        let file = located.as_ref().map_or(places.file(), |at| at.file);
        let (line, column) = match &located {
            Some(at) => {
                let (line, column) = line_column(at.text, at.range.start);
                (Some(line), Some(column))
            }
            None => (None, None),
        };
        let severity = match diagnostic.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        json!({
            "code": diagnostic.code, "severity": severity, "message": diagnostic.message,
            "file": file, "line": line, "column": column, "help": diagnostic.help,
        })
    };
    diagnostics.iter().map(object).collect()
}

/// The diagnostics as text for people: message, source lines with labels under the places, help.
pub fn render(diagnostics: &[Diagnostic], places: &dyn Locate, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let renderer = renderer.decor_style(DecorStyle::Ascii);
    let mut out = String::new();
    for diagnostic in diagnostics {
        out.push_str(&render_one(diagnostic, places, &renderer));
        out.push_str("\n\n");
    }
    out
}

/// Characters shown to either side of a label in a line that is longer.
const WINDOW: usize = 160;
/// Lines further apart than this are shown as separate excerpts.
const FAR: usize = 20_000;

/// Some lines of a text with the labels in them.
struct Excerpt<'a> {
    file: &'a str,
    text: &'a str,
    lines: Range<usize>,
    labels: Vec<(Range<usize>, &'a str, bool)>,
}

fn render_one(diagnostic: &Diagnostic, places: &dyn Locate, renderer: &Renderer) -> String {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut excerpts: Vec<Excerpt> = Vec::new();
    for label in &diagnostic.labels {
        let Some(at) = places.locate(&label.at) else { continue };
        let primary = excerpts.is_empty();
        let range = first_line(at.text, at.range);
        let lines = surroundings(at.text, &range);
        let range = range.start..range.end.min(lines.end);
        let near = |excerpt: &&mut Excerpt| {
            let joined = excerpt.lines.start.min(lines.start)..excerpt.lines.end.max(lines.end);
            std::ptr::eq(excerpt.text, at.text)
                && joined.len() < FAR
                && at.text[joined].split('\n').all(|line| line.len() <= 2 * WINDOW)
        };
        match excerpts.iter_mut().find(near) {
            Some(excerpt) => {
                excerpt.lines = excerpt.lines.start.min(lines.start)..excerpt.lines.end.max(lines.end);
                excerpt.labels.push((range, &label.text, primary));
            }
            None => excerpts.push(Excerpt {
                file: at.file,
                text: at.text,
                lines,
                labels: vec![(range, &label.text, primary)],
            }),
        }
    }
    let title = if excerpts.is_empty() {
        format!("{}: {}", places.file(), diagnostic.message)
    } else {
        diagnostic.message.clone()
    };
    let mut group = Group::with_title(level.primary_title(title).id(diagnostic.code));
    for excerpt in &excerpts {
        let start = excerpt.lines.start;
        let (line, column) = line_column(excerpt.text, start);
        let cut = column > 1;
        let annotations = excerpt.labels.iter().map(|(range, text, primary)| {
            let kind = if *primary { AnnotationKind::Primary } else { AnnotationKind::Context };
            let annotation = kind.span(range.start - start..range.end - start);
            if text.is_empty() { annotation } else { annotation.label(*text) }
        });
        let path =
            if cut { format!("{} (from column {column} of line {line})", excerpt.file) } else { excerpt.file.into() };
        let snippet = Snippet::source(&excerpt.text[excerpt.lines.clone()]).line_start(line).path(path);
        group = group.element(snippet.annotations(annotations));
    }
    if let Some(help) = &diagnostic.help {
        group = group.element(Level::HELP.message(help.as_str()));
    }
    renderer.render(&[group])
}

/// The part of a range that is on its first line.
fn first_line(text: &str, range: Range<usize>) -> Range<usize> {
    let end = text[range.clone()].find(['\n', '\r']).map_or(range.end, |i| range.start + i);
    range.start..end
}

/// The line that holds a range within one line, or what surrounds the range where the line is long.
fn surroundings(text: &str, range: &Range<usize>) -> Range<usize> {
    let from = text.floor_char_boundary(range.start.saturating_sub(WINDOW));
    let to = text.ceil_char_boundary((range.end.min(range.start + WINDOW) + WINDOW).min(text.len()));
    let start = text[from..range.start].rfind('\n').map_or(from, |i| from + i + 1);
    let end = text[range.start..to].find('\n').map_or(to, |i| range.start + i);
    start..end
}

/// The candidate that is most like a name, where one is like enough to have been meant.
pub fn closest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = name.chars().count();
    if length == 0 || length > 64 {
        return None;
    }
    let lower = name.to_lowercase();
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        let other = candidate.chars().count();
        if other > 64 || other.abs_diff(length) > 4 {
            continue;
        }
        let distance = if candidate.to_lowercase() == lower { 0 } else { edits(name, candidate) };
        let allowed = (length.max(other) / 3).max(1);
        if distance <= allowed && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

/// Insertions, deletions, replacements and swaps of neighbours that lead from one word to another.
fn edits(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut last: Vec<usize> = Vec::new();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut next = vec![i + 1; b.len() + 1];
        for j in 0..b.len() {
            let replaced = row[j] + usize::from(a[i] != b[j]);
            next[j + 1] = replaced.min(row[j + 1] + 1).min(next[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                next[j + 1] = next[j + 1].min(last[j - 1] + 1);
            }
        }
        last = std::mem::replace(&mut row, next);
    }
    row[b.len()]
}

/// `allowed: a, b, c`: the names that may stand at a place; at most 40 of them, long ones cut.
pub fn allowed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.into_iter().collect();
    if names.is_empty() {
        return "nothing is allowed here".into();
    }
    let mut text = String::from("allowed: ");
    for (i, name) in names.iter().take(40).enumerate() {
        if i > 0 {
            text.push_str(", ");
        }
        text.push_str(&short(name));
    }
    if names.len() > 40 {
        text.push_str(&format!(" and {} more", names.len() - 40));
    }
    text
}

/// The help for a name that does not exist: did-you-mean, then the names that do.
pub fn suggest<'a>(name: &str, names: impl IntoIterator<Item = &'a str> + Clone) -> String {
    match closest(name, names.clone()) {
        Some(meant) => format!("did you mean `{}`?\n{}", short(meant), allowed(names)),
        None => allowed(names),
    }
}

/// A word from a file for use in a message: without control characters, and cut where it is long.
pub fn short(word: &str) -> String {
    let mut text: String = word.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.len() < word.len() && word.chars().nth(60).is_some() {
        text.push_str("..");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Text(&'static str);
    impl Locate for Text {
        fn locate(&self, place: &Place) -> Option<Located<'_>> {
            match place {
                Place::Bytes(range) => Some(Located { file: "a.ron", text: self.0, range: range.clone() }),
                _ => None,
            }
        }
        fn file(&self) -> &str {
            "a.ron"
        }
    }

    #[test]
    fn closest_finds_slips_and_nothing_else() {
        let names = ["inclination", "tip_radius", "hollow", "G"];
        assert_eq!(closest("inclinaton", names), Some("inclination"));
        assert_eq!(closest("inlcination", names), Some("inclination"));
        assert_eq!(closest("HOLLOW", names), Some("hollow"));
        assert_eq!(closest("g", names), Some("G"));
        assert_eq!(closest("steps", names), None);
        assert_eq!(closest(&"x".repeat(100_000), names), None);
    }

    #[test]
    fn edits_count_a_swap_once() {
        assert_eq!(edits("ab", "ba"), 1);
        assert_eq!(edits("kitten", "sitting"), 3);
        assert_eq!(edits("", "abc"), 3);
    }

    #[test]
    fn columns_are_characters() {
        assert_eq!(line_column("a\n\u{e9}\u{e9}x", 6), (2, 3));
        assert_eq!(line_column("", 5), (1, 1));
    }

    #[test]
    fn rendering_survives_any_range() {
        let text = Text("\u{e9}(\r\n a: \"\u{1F600}\", b: 2,\n)\n");
        let boundaries: Vec<usize> = (0..=text.0.len()).filter(|&i| text.0.is_char_boundary(i)).collect();
        for &start in &boundaries {
            for &end in boundaries.iter().filter(|&&end| end >= start) {
                let diagnostic = Diagnostic::error("x", "m").label(Place::Bytes(start..end), "here");
                assert!(render(&[diagnostic], &text, false).contains("here"));
            }
        }
    }

    #[test]
    fn long_lines_are_shown_in_part() {
        let text: &'static str = Box::leak("x".repeat(1_000_000).into_boxed_str());
        let diagnostic = Diagnostic::error("x", "m")
            .label(Place::Bytes(500_000..500_004), "here")
            .label(Place::Bytes(5..999_999), "there");
        let shown = render(&[diagnostic], &Text(text), false);
        assert!(shown.len() < 5_000, "{}", shown.len());
    }
}
