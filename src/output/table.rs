//! The result of a run for people: what was solved, a table that fits the screen, how far it can be trusted, what happened.

use super::{Report, reason};
use crate::number::{align, known, plain, small};
use crate::run::{Point, Reason, Status};
use comfy_table::{LineStyle, Table, presets};
use std::fmt::Write;

/// Columns of characters that a table may take.
const WIDTH: usize = 110;
/// Rows of a table before it is thinned.
const ROWS: usize = 25;
/// Significant digits at most.
const DIGITS: usize = 7;
/// Violations that are written out.
const VIOLATIONS: usize = 8;

/// The result as text.
pub fn result(report: &Report) -> String {
    let (model, points) = (report.model, &report.outcome.points);
    let mut text = format!("{}\n", model.title);
    let given = model.parameters.iter().map(|(name, value)| format!("{name} = {}", plain(*value)));
    let initial = constants(report).into_iter().filter_map(|i| {
        let value = points.first()?.solution.quantity(i)?.value;
        Some(format!("{} = {}", model.quantities[i].name, plain(value)))
    });
    paragraph(&mut text, "", &given.chain(initial).collect::<Vec<_>>(), ", ");
    text.push('\n');
    if !points.is_empty() {
        rows(report, &mut text);
        text.push('\n');
        trust(report, &mut text);
    }
    infinite(report, &mut text);
    events(report, &mut text);
    violations(report, &mut text);
    let _ = match &report.outcome.status {
        Status::Complete => writeln!(text, "Complete: everything that was asked for was solved."),
        Status::Incomplete(message) => writeln!(text, "Incomplete: {message}"),
    };
    text
}

/// Quantities that are the same in every state by what they are, in every stage that was met.
fn constants(report: &Report) -> Vec<usize> {
    let constant = |i: usize| {
        let here = std::iter::once(report.model).chain(report.outcome.points.iter().map(|p| &*p.model));
        here.into_iter().all(|m| m.quantities[i].formula.probes().next().is_none())
    };
    (0..report.model.quantities.len()).filter(|&i| constant(i)).collect()
}

/// Quantities in the order of the columns: the control, what was asked for, the others as declared.
fn columns(report: &Report) -> Vec<usize> {
    let model = report.model;
    let constants = constants(report);
    let mut order: Vec<usize> = vec![];
    let asked = report.outcome.points.iter().filter_map(|p| p.at.as_ref()).map(|at| at.name.as_str());
    let first = std::iter::once(model.branch.control.as_str()).chain(asked);
    let all = first.chain(model.quantities.iter().map(|q| q.name.as_str()));
    for name in all {
        if let Some(i) = model.quantities.iter().position(|q| q.name == name)
            && !constants.contains(&i)
            && !order.contains(&i)
        {
            order.push(i);
        }
    }
    order
}

/// The states that are shown: all, or so many of the steps, evenly spread with both ends, and what is no step.
fn shown(points: &[Point]) -> Vec<usize> {
    if points.len() <= ROWS {
        return (0..points.len()).collect();
    }
    let special: Vec<usize> = (0..points.len()).filter(|&i| points[i].reason != Reason::Step).collect();
    let special = if special.len() > ROWS { vec![] } else { special };
    let rest: Vec<usize> = (0..points.len()).filter(|i| !special.contains(i)).collect();
    let room = (ROWS - special.len()).max(2).min(rest.len());
    let mut list: Vec<usize> = special;
    list.extend((0..room).map(|k| rest[k * (rest.len() - 1) / (room.max(2) - 1)]));
    list.sort_unstable();
    list.dedup();
    list
}

fn rows(report: &Report, text: &mut String) {
    let (model, points) = (report.model, &report.outcome.points);
    let shown = shown(points);
    let mut table: Vec<Vec<String>> = vec![];
    let mut left_out: Vec<&str> = vec![];
    let mut width = 0;
    // Start, steps and end are seen without saying.
    let usual = |p: &Point| matches!(p.reason, Reason::Start | Reason::Step | Reason::End);
    let mixed = points.iter().any(|p| p.reason != points[0].reason);
    if mixed && !points.iter().all(usual) {
        let mut cells: Vec<String> = vec!["state".into()];
        cells.extend(shown.iter().map(|&i| reason(points[i].reason).to_owned()));
        width += 9;
        table.push(cells);
    }
    for (k, i) in columns(report).into_iter().enumerate() {
        let name = &model.quantities[i].name;
        if points.iter().all(|p| p.solution.quantity(i).is_none()) {
            continue;
        }
        let cell = |p: &usize| match points[*p].solution.quantity(i) {
            Some(q) if k == 0 => plain(q.value),
            Some(q) => known(q.value, q.error, DIGITS),
            None => "-".into(),
        };
        let mut numbers: Vec<String> = shown.iter().map(cell).collect();
        align(&mut numbers);
        let needed = numbers.iter().map(String::len).max().unwrap_or(0).max(name.len()) + 2;
        if width + needed > WIDTH && k > 0 {
            left_out.push(name);
            continue;
        }
        width += needed;
        let mut cells = vec![name.clone()];
        cells.append(&mut numbers);
        table.push(cells);
    }
    let mut printed = Table::new();
    printed.load_style(presets::NOTHING.header_separator(LineStyle::none().fill('-').junction('-')));
    let row = |r: usize| table.iter().map(|column| column[r].clone()).collect::<Vec<_>>();
    printed.set_header(row(0));
    printed.add_rows((1..=shown.len()).map(row));
    for line in printed.lines() {
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if shown.len() < points.len() {
        let (all, some) = (points.len(), shown.len());
        let _ = writeln!(text, "({some} of {all} states; all of them with --format json or --out DIR)");
    }
    if !left_out.is_empty() {
        let names: Vec<String> = left_out.iter().map(|n| n.to_string()).collect();
        paragraph(text, "Not shown for want of room: ", &names, ", ");
    }
}

/// Where a state is on the branch.
fn place(report: &Report, point: &Point) -> String {
    let control = &report.model.branch.control;
    match report.value(point, control) {
        Some(value) => format!("{control} = {}", plain(value)),
        None => format!("a state without {control}"),
    }
}

fn trust(report: &Report, text: &mut String) {
    let (model, points) = (report.model, &report.outcome.points);
    let mut worst: Option<(f64, usize, &Point)> = None;
    for point in points {
        for (i, q) in point.solution.quantities.iter().enumerate() {
            // A number that vanishes has no relative error; what rounding leaves of it is measured against one.
            let Some(q) = q.filter(|q| q.error > 1e-13) else { continue };
            let relative = q.error / q.value.abs();
            if worst.is_none_or(|w| relative > w.0) {
                worst = Some((relative, i, point));
            }
        }
    }
    let _ = match worst {
        Some((error, i, point)) => writeln!(
            text,
            "Largest estimated relative error: {} ({} at {}); {} was asked for.",
            small(error),
            model.quantities[i].name,
            place(report, point),
            plain(model.accuracy)
        ),
        None => writeln!(text, "All numbers are accurate to rounding."),
    };
    let most = |of: fn(&crate::solution::Certificate) -> f64| {
        let larger = |a: f64, b: f64| if b > a || b.is_nan() { b } else { a };
        small(points.iter().map(|p| of(&p.solution.certificate)).fold(0.0, larger))
    };
    let _ = write!(
        text,
        "Relative mismatch: first integrals {}, forces {}, virtual work {}",
        most(|c| c.first_integral),
        most(|c| c.force_balance),
        most(|c| c.virtual_work)
    );
    if !model.identities.is_empty() {
        let _ = write!(text, ", identities {}", most(|c| c.identities));
    }
    let wrong = points.iter().filter(|p| !p.solution.certificate.is_admissible()).count();
    let _ = match wrong {
        0 => writeln!(text, ".\nEvery state is admissible."),
        _ => writeln!(text, ".\nNot admissible: {wrong} of {} states.", points.len()),
    };
}

/// What is infinite by nature, once: fields by the end of the segment where they are, then quantities.
fn infinite(report: &Report, text: &mut String) {
    let mut names: Vec<&str> = vec![];
    for name in report.outcome.points.iter().flat_map(|p| &p.solution.infinite) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let mut ends: Vec<(&str, Vec<&str>)> = vec![];
    let mut others: Vec<&str> = vec![];
    for name in names {
        match name.rsplit_once('.') {
            Some((end, field)) => match ends.iter_mut().find(|e| e.0 == end) {
                Some(e) => e.1.push(field),
                None => ends.push((end, vec![field])),
            },
            None => others.push(name),
        }
    }
    for (end, fields) in ends {
        let tip = match end.rsplit_once('.') {
            Some((segment, _)) => format!("at the tip of {segment}"),
            None => format!("at {end}"),
        };
        let _ = writeln!(text, "Infinite by nature {tip}: {} (of {end}).", fields.join(", "));
    }
    if !others.is_empty() {
        let _ = writeln!(text, "Infinite by nature, and left out: {}.", others.join(", "));
    }
}

fn events(report: &Report, text: &mut String) {
    let model = report.model;
    for event in &report.outcome.events {
        let value = |name: &str| {
            let i = model.quantities.iter().position(|q| q.name == name)?;
            let q = event.solution.quantity(i)?;
            Some(format!("{name} = {}", known(q.value, q.error, DIGITS + 3)))
        };
        let mut names = vec![event.of.as_str()];
        if event.of != model.branch.control {
            names.push(&model.branch.control);
        }
        let values: Vec<String> = names.into_iter().filter_map(value).collect();
        let kind = event.kind.replace('_', " ");
        let what =
            if event.kind == "end" { format!("{kind} ({})", event.of) } else { format!("{kind} of {}", event.of) };
        let _ = write!(text, "Event: {what}: {}", values.join(", "));
        let _ = match event.stage_before == event.stage_after {
            true => writeln!(text),
            false => writeln!(text, "; stage {} -> {}", event.stage_before, event.stage_after),
        };
    }
}

/// Each kind of violation once, with how often and where first.
fn violations(report: &Report, text: &mut String) {
    let mut kinds: Vec<(&str, usize, &str, &Point)> = vec![];
    for point in &report.outcome.points {
        for violation in &point.solution.certificate.violations {
            let kind = violation.split_once(" (").map_or(violation.as_str(), |v| v.0);
            match kinds.iter_mut().find(|k| k.0 == kind) {
                Some(k) => k.1 += 1,
                None => kinds.push((kind, 1, violation, point)),
            }
        }
    }
    for (_, count, first, point) in kinds.iter().take(VIOLATIONS) {
        let at = place(report, point);
        let _ = match count {
            1 => writeln!(text, "Violated at {at}: {first}"),
            _ => writeln!(text, "Violated in {count} states, first at {at}: {first}"),
        };
    }
    if kinds.len() > VIOLATIONS {
        let _ = writeln!(text, "Violated besides: {} more conditions", kinds.len() - VIOLATIONS);
    }
}

/// A list in lines that fit.
fn paragraph(text: &mut String, start: &str, items: &[String], separator: &str) {
    if items.is_empty() {
        return;
    }
    let mut line = start.to_owned();
    for (i, item) in items.iter().enumerate() {
        let last = i + 1 == items.len();
        let piece = if last { item.clone() } else { format!("{item}{separator}") };
        if line.len() + piece.trim_end().len() > WIDTH && line.len() > start.len() {
            let _ = writeln!(text, "{}", line.trim_end());
            line.clear();
        }
        line += &piece;
    }
    let _ = writeln!(text, "{line}");
}
