//! The page: entries, the rule by which they are judged, and their text.

use std::fmt::Write;

/// A value agrees with a printed one within this part of it, or where it has the printed digits when rounded.
const PART: f64 = 0.01;

/// More readings than these are counted, not listed.
const MANY: usize = 7;

/// One or more lines of the table, for a row of the list of printed numbers.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its number in the list; `-` for a claim that comes without a number.
    pub row: &'static str,
    /// Section, page or figure.
    pub place: &'static str,
    /// What the number is.
    pub what: String,
    pub content: Content,
}

#[derive(Clone, Debug)]
pub enum Content {
    /// Parameters of the thesis' computations.
    Input(&'static str),
    /// Numbers of other authors.
    Quoted(&'static str),
    /// Numbers against the same in one or more readings; the first reading is what the text says.
    Numbers { printed: Vec<String>, readings: Vec<Reading>, reason: String },
    /// A statement against evidence.
    Claim { printed: String, evidence: String, holds: bool, reason: String },
}

/// What the numbers are if a symbol is taken to mean this.
#[derive(Clone, Debug)]
pub struct Reading {
    pub name: String,
    /// In the order of the printed ones; nothing where there is no such state.
    pub values: Vec<Option<f64>>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    None,
    Holds,
    /// Under the reading of this index, which is not the text's.
    Other(usize),
    /// With the reading that comes nearest.
    Fails(usize),
}

/// A reading with a value for every printed number.
pub fn reading(name: impl ToString, values: impl IntoIterator<Item = f64>) -> Reading {
    Reading { name: name.to_string(), values: values.into_iter().map(Some).collect() }
}

/// The same where some states may be missing.
pub fn partial(name: impl ToString, values: impl IntoIterator<Item = Option<f64>>) -> Reading {
    Reading { name: name.to_string(), values: values.into_iter().collect() }
}

pub fn input(row: &'static str, place: &'static str, what: &str, values: &'static str) -> Entry {
    Entry { row, place, what: what.into(), content: Content::Input(values) }
}

pub fn quoted(row: &'static str, place: &'static str, what: &str, values: &'static str) -> Entry {
    Entry { row, place, what: what.into(), content: Content::Quoted(values) }
}

/// Printed numbers, separated by blanks.
pub fn numbers(
    row: &'static str,
    place: &'static str,
    what: impl ToString,
    printed: &str,
    readings: Vec<Reading>,
    reason: impl ToString,
) -> Entry {
    let printed: Vec<String> = printed.split_whitespace().map(str::to_owned).collect();
    assert!(readings.iter().all(|r| r.values.len() == printed.len()), "row {row}");
    Entry {
        row,
        place,
        what: what.to_string(),
        content: Content::Numbers { printed, readings, reason: reason.to_string() },
    }
}

pub fn claim(
    row: &'static str,
    place: &'static str,
    what: impl ToString,
    printed: impl ToString,
    evidence: impl ToString,
    holds: bool,
    reason: impl ToString,
) -> Entry {
    let (printed, evidence, reason) = (printed.to_string(), evidence.to_string(), reason.to_string());
    Entry { row, place, what: what.to_string(), content: Content::Claim { printed, evidence, holds, reason } }
}

/// How far a value is from a printed one, relative to it, and whether that is within the rule.
fn miss(printed: &str, value: f64) -> (f64, bool) {
    let (mantissa, exponent) = printed.split_once('e').unwrap_or((printed, "0"));
    let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len()) as i32;
    let unit = 10_f64.powi(exponent.parse::<i32>().unwrap() - decimals);
    let number: f64 = printed.parse().unwrap();
    let off = (value - number).abs();
    (off / number.abs(), off <= (0.5 * unit).max(PART * number.abs()))
}

/// How many of the printed numbers a reading meets, and its largest miss.
fn meets(printed: &[String], reading: &Reading) -> (usize, f64) {
    let all = printed.iter().zip(&reading.values).map(|(p, v)| v.map_or((f64::INFINITY, false), |v| miss(p, v)));
    all.fold((0, 0.0), |(n, worst), (off, ok)| (n + usize::from(ok), worst.max(off)))
}

impl Entry {
    /// The verdict, from printed and converged numbers alone.
    pub fn verdict(&self) -> Verdict {
        match &self.content {
            Content::Input(_) | Content::Quoted(_) => Verdict::None,
            Content::Claim { holds: true, .. } => Verdict::Holds,
            Content::Claim { holds: false, .. } => Verdict::Fails(0),
            Content::Numbers { printed, readings, .. } => {
                let met: Vec<(usize, f64)> = readings.iter().map(|r| meets(printed, r)).collect();
                match met.iter().position(|m| m.0 == printed.len()) {
                    Some(0) => Verdict::Holds,
                    Some(i) => Verdict::Other(i),
                    None => {
                        // The most numbers met, then the smallest of the largest misses.
                        let order =
                            |&a: &usize, &b: &usize| met[b].0.cmp(&met[a].0).then(met[a].1.total_cmp(&met[b].1));
                        Verdict::Fails((0..met.len()).min_by(order).unwrap())
                    }
                }
            }
        }
    }

    /// Its line of the table.
    pub fn line(&self) -> String {
        let verdict = self.verdict();
        let (printed, converged, judged, reason) = match &self.content {
            Content::Input(values) => ((*values).into(), String::new(), "input; used".into(), String::new()),
            Content::Quoted(values) => ((*values).into(), String::new(), "quoted; not judged".into(), String::new()),
            Content::Claim { printed, evidence, holds, reason } => {
                let verdict = if *holds { "holds" } else { "does not hold" };
                (printed.clone(), evidence.clone(), verdict.into(), reason.clone())
            }
            Content::Numbers { printed, readings, reason } => {
                let shown = |i: usize| {
                    let texts = printed.iter().zip(&readings[i].values).map(|(p, v)| like(p, *v));
                    texts.collect::<Vec<_>>().join(", ")
                };
                let named = |i: usize| format!("{}: {}", readings[i].name, shown(i));
                let chosen = match verdict {
                    Verdict::Other(i) | Verdict::Fails(i) => i,
                    _ => 0,
                };
                let mut converged = if readings.len() == 1 { shown(0) } else { named(0) };
                if chosen > 0 {
                    converged += &format!("; {}", named(chosen));
                }
                let (met, worst) = meets(printed, &readings[chosen]);
                let off = if worst.is_finite() { format!("off by {}", percent(worst)) } else { "no such state".into() };
                let up_to = if printed.len() > 1 && worst.is_finite() { off.replace("by", "by up to") } else { off };
                let nearest = if chosen > 0 {
                    format!(" in the nearest reading ({})", readings[chosen].name)
                } else {
                    String::new()
                };
                let judged = match verdict {
                    Verdict::Holds => "holds".into(),
                    Verdict::Other(i) => format!("holds under another normalisation: {}", readings[i].name),
                    _ if met > 0 => format!("does not hold: {met} of {} met, {up_to}{nearest}", printed.len()),
                    _ => format!("does not hold: {up_to}{nearest}"),
                };
                let others: Vec<&str> =
                    (1..readings.len()).filter(|&i| i != chosen).map(|i| readings[i].name.as_str()).collect();
                let mut reason = reason.clone();
                if !others.is_empty() && verdict != Verdict::Holds {
                    let space = if reason.is_empty() { "" } else { " " };
                    reason += &match others.len() {
                        n if n > MANY => format!("{space}{n} more readings tried."),
                        _ => format!("{space}Also tried: {}.", others.join("; ")),
                    };
                }
                (printed.join(", "), converged, judged, reason)
            }
        };
        let what = format!("{}: {}", self.place, self.what);
        format!("| {} | {what} | {printed} | {converged} | {judged} | {reason} |", self.row)
    }
}

/// A miss as a percentage or, where it is large, as a factor.
fn percent(miss: f64) -> String {
    if miss < 10.0 { format!("{} %", digits(100.0 * miss, 2)) } else { format!("a factor {}", digits(1.0 + miss, 2)) }
}

/// A value with one digit more than the printed one, three at least.
fn like(printed: &str, value: Option<f64>) -> String {
    let mantissa = printed.split('e').next().unwrap();
    let n = mantissa.trim_start_matches(['0', '.']).chars().filter(char::is_ascii_digit).count();
    value.map_or("none".into(), |v| digits(v, (n + 1).clamp(3, 5)))
}

/// A number with so many significant digits.
pub fn digits(value: f64, n: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{value:.*e}", n - 1);
    let exponent: i32 = scientific.split_once('e').unwrap().1.parse().unwrap();
    if (-4..6).contains(&exponent) {
        format!("{value:.*}", (n as i32 - 1 - exponent).max(0) as usize)
    } else {
        scientific
    }
}

/// Numbers with so many significant digits.
pub fn list(values: impl IntoIterator<Item = f64>, n: usize) -> String {
    values.into_iter().map(|v| digits(v, n)).collect::<Vec<_>>().join(", ")
}

/// A chapter of the thesis.
#[derive(Clone, Debug)]
pub struct Chapter {
    pub title: &'static str,
    pub about: &'static str,
    pub entries: Vec<Entry>,
}

/// The whole page.
pub fn page(chapters: &[Chapter]) -> String {
    let count =
        |of: fn(&Verdict) -> bool| chapters.iter().flat_map(|c| &c.entries).filter(|e| of(&e.verdict())).count();
    let (hold, other, fail) = (
        count(|v| *v == Verdict::Holds),
        count(|v| matches!(v, Verdict::Other(_))),
        count(|v| matches!(v, Verdict::Fails(_))),
    );
    let mut text = include_str!("introduction.md").replace(
        "COUNTS",
        &format!(
            "Of {} judged lines, {hold} hold, {other} hold under another normalisation, {fail} do not hold.",
            hold + other + fail
        ),
    );
    for chapter in chapters {
        let _ = write!(text, "\n## {}\n\n{}\n\n", chapter.title, chapter.about.trim());
        text += "| no. | place: quantity | printed | converged | verdict | reason |\n|---|---|---|---|---|---|\n";
        for entry in &chapter.entries {
            text += &entry.line();
            text.push('\n');
        }
    }
    text
}
