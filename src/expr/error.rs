//! What is wrong with a formula, and where.

use std::ops::Range;

/// A mistake in a formula, with its place in the text of that formula.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// A stable name of the kind of mistake; those of this module are listed in [`CODES`].
    pub code: &'static str,
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// The place, in bytes of the text of the formula; always on character boundaries.
    pub span: Range<usize>,
    /// What to write instead.
    pub help: Option<String>,
}

impl ExprError {
    /// A mistake without advice.
    pub fn new(code: &'static str, span: Range<usize>, message: impl Into<String>) -> Self {
        ExprError { code, message: message.into(), span, help: None }
    }

    /// The same mistake with advice.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same mistake in a text in which the formula starts at byte `offset`.
    pub fn shifted(mut self, offset: usize) -> Self {
        self.span = self.span.start + offset..self.span.end + offset;
        self
    }
}

impl From<ExprError> for Vec<ExprError> {
    fn from(error: ExprError) -> Self {
        vec![error]
    }
}

/// The codes of this module, each with what it means.
pub const CODES: &[(&str, &str)] = &[
    ("argument-count", "A function was given no argument or more than one."),
    ("argument-name", "A named argument `name = value` stands last in a call of a dotted name, and nowhere else."),
    ("comparison", "A formula does not compare: a value that switches has no derivative where it does."),
    ("empty", "The formula is empty."),
    ("equation-expected", "An equation `lhs = rhs` is wanted, with exactly one `=`."),
    ("equation-not-allowed", "A value is wanted here, not an equation."),
    ("function-without-argument", "A function is written with its argument, as in `sin(x)`."),
    ("malformed-name", "A name is made of ASCII letters, digits and `_`, in parts joined by single dots."),
    ("malformed-number", "A number is neither too large nor too small for double precision, and is written 1.5e-3."),
    ("missing-operand", "An operator, a parenthesis or a comma has nothing on one side."),
    ("missing-operator", "Two values stand side by side; products are written with `*`."),
    ("not-finite", "A number is wanted here, and this is infinite or none."),
    ("no-derivative", "`if`, `min`, `max`, `abs` and their like have no derivative at the kink or jump."),
    ("power-operator", "A power is written `x^2`, not `x**2`."),
    ("too-deep", "The formula is nested too deeply."),
    ("too-long", "The formula is too long."),
    ("unclosed", "A parenthesis or bracket is opened and not closed."),
    ("unexpected-comma", "A comma separates the arguments of a call, and nothing else."),
    ("unknown-character", "A character that has no meaning in a formula."),
    ("unknown-function", "There is no function of this name."),
    ("unknown-name", "There is no such name here."),
    ("unmatched", "A parenthesis or bracket is closed that was not opened."),
    ("unit-misplaced", "A unit stands in brackets behind a number, and nowhere else."),
    ("unknown-unit", "The unit is not known here."),
];

/// Of `candidates` the one that `word` was most likely meant to be, if any is near.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // A longer word is no typing mistake; the limit also bounds the work on hostile text.
    const LONGEST: usize = 64;
    let word: Vec<char> = word.chars().take(LONGEST + 1).flat_map(char::to_lowercase).collect();
    if word.len() > LONGEST {
        return None;
    }
    let allowed = (word.len() / 3).max(1);
    candidates
        .into_iter()
        .filter(|c| c.len() <= 2 * LONGEST)
        .map(|c| (distance(&word, &c.chars().flat_map(char::to_lowercase).collect::<Vec<_>>()), c))
        .filter(|&(d, c)| d <= allowed && d < c.len())
        .min_by_key(|&(d, _)| d)
        .map(|(_, c)| c)
}

/// Number of insertions, deletions, replacements and swaps of neighbours that turn `a` into `b`.
fn distance(a: &[char], b: &[char]) -> usize {
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replaced = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replaced.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = last;
        last = row;
    }
    last[b.len()]
}

/// `text` in backquotes, shortened when it is long.
pub(super) fn quoted(text: &str) -> String {
    format!("`{}`", shortened(text))
}

/// `text`, shortened when it is long.
pub(super) fn shortened(text: &str) -> String {
    const LONGEST: usize = 40;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
