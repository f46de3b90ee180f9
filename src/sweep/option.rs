//! `--sweep NAME=VALUES`.

use crate::diagnostic::{Complaints, Diagnostic, Locate, Place};
use crate::spec::{Document, Origin, Source, Syntax};
use std::ops::Range;

/// How values are written.
const SYNTAX: &str =
    "a list `r0=1.1,1.5,2`, or `r0=1.1..2:10`: 10 values from 1.1 to 2, or `k=1..100:10:log` with equal ratios";

/// The document with a grid of what these options say, in the place of its sweep.
///
/// # Errors
/// What cannot be read; what is returned with it can show the places.
pub fn option(document: &Document, options: &[(String, String)]) -> Result<Document, Vec<Complaints>> {
    let (mut axes, mut refused): (Vec<String>, Vec<Complaints>) = (vec![], vec![]);
    for (i, (name, values)) in options.iter().enumerate() {
        let text = format!("{name}={values}");
        let read = match options[..i].iter().any(|(before, _)| before == name) {
            true => Err((0..name.len(), format!("`{name}` is swept twice"))),
            false => read(values).map_err(|(range, message)| {
                let start = name.len() + 1;
                (start + range.start..start + range.end, message)
            }),
        };
        match read {
            Ok(values) => axes.push(format!("{name:?}: {values}")),
            Err((range, message)) => {
                let d = Diagnostic::error("malformed-sweep", message).label(Place::Bytes(range), "").help(SYNTAX);
                let origin = Origin::new(Source { name: "--sweep".into(), text, syntax: Syntax::Ron });
                refused.push((Box::new(origin), vec![d]));
            }
        }
    }
    if !refused.is_empty() {
        return Err(refused);
    }
    // What is wrong with names and numbers is said of this text.
    let text = format!("Grid({{ {} }})", axes.join(", "));
    document.replace("/sweep", Source { name: "--sweep".into(), text, syntax: Syntax::Ron }).map_err(|rejected| {
        let diagnostics = rejected.diagnostics.clone();
        vec![(rejected as Box<dyn Locate>, diagnostics)]
    })
}

/// Values as RON; or what is wrong, and where in the text.
fn read(text: &str) -> Result<String, (Range<usize>, String)> {
    let whole = 0..text.len();
    if !text.contains(':') && !text.contains("..") {
        let (mut list, mut start) = (vec![], 0);
        for item in text.split(',') {
            let range = start..start + item.len();
            if item.trim().is_empty() {
                return Err((range, "a value is missing in the list".into()));
            }
            list.push(number(item));
            start = range.end + 1;
        }
        return Ok(format!("Values([{}])", list.join(", ")));
    }
    let parts = text.split_once("..").and_then(|(from, rest)| {
        let (to, rest) = rest.split_once(':')?;
        let (count, spacing) = rest.split_once(':').unwrap_or((rest, ""));
        Some((from, to, count.trim(), spacing.trim()))
    });
    let Some((from, to, count, spacing)) = parts.filter(|p| !p.0.trim().is_empty() && !p.1.trim().is_empty()) else {
        return Err((whole, "a range is written `from..to:count`".into()));
    };
    let place = |part: &str| {
        let start = part.as_ptr() as usize - text.as_ptr() as usize;
        start..start + part.len()
    };
    if count.is_empty() || !count.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err((place(count), "the count must be a whole number".into()));
    }
    let word = match spacing {
        "" => "Linear",
        "log" => "Log",
        other => return Err((place(other), format!("`{other}` is no spacing"))),
    };
    Ok(format!("{word}(from: {}, to: {}, count: {count})", number(from), number(to)))
}

/// A number as RON has it; in quotes where it is a formula.
fn number(text: &str) -> String {
    let text = text.trim();
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => format!("{value:?}"),
        _ => format!("{text:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_ranges() {
        assert_eq!(read("1.1, 2,pi/4").unwrap(), "Values([1.1, 2.0, \"pi/4\"])");
        assert_eq!(read("1.1..2.0:10").unwrap(), "Linear(from: 1.1, to: 2.0, count: 10)");
        assert_eq!(read("1e-3 .. 60 : 20 : log").unwrap(), "Log(from: 0.001, to: 60.0, count: 20)");
        for (wrong, range) in [("1,,2", 2..2), ("1..2", 0..4), ("1:3", 0..3), ("1..2:x", 5..6), ("1..2:3:lin", 7..10)] {
            assert_eq!(read(wrong).unwrap_err().0, range, "{wrong}");
        }
        for wrong in ["..2:3", "1..:3", "1..2:", "", "1..2:-3", "1..2:2.5"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
