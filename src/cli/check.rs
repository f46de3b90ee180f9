//! `membrane check`.

use super::problem::Understood;
use super::{Exit, Format, Input, complain, print, problem};
use membrane::diagnostic::{Diagnostic, Severity};
use membrane::model::{Ledger, token};
use membrane::output::document::{self, Finding};
use membrane::run::{Rank, rank};
use membrane::spec::{Problem, schema};
use membrane::sweep::Plan;
use std::fmt::Write;

/// Arguments.
#[derive(Debug, clap::Args)]
pub struct Options {
    #[command(flatten)]
    input: Input,
    /// How the findings are printed.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// The problem files; `-` is standard input.
    #[arg(required = true, value_name = "FILE")]
    files: Vec<String>,
}

/// Checks problems.
pub fn check(options: &Options) -> Exit {
    let (mut findings, mut text, mut exit) = (vec![], String::new(), Exit::Done);
    for file in &options.files {
        match problem::understand(file, &options.input) {
            Ok(Understood { document, model, plan }) => {
                let rank = rank(&model);
                let verdict = verdict(&rank, &model.problem);
                let (unknowns, conditions) = (model.ledger.unknowns.len(), model.ledger.conditions.len());
                let counted = format!("{unknowns} unknowns and {conditions} conditions");
                let ledger = if options.files.len() == 1 { listed(&model.ledger) } else { String::new() };
                // The reader walks the schema itself, for its messages; here a validator has the last word.
                let judged = schema::judge(&document.value).err().map(|said| {
                    Diagnostic::error("schema", "the file does not satisfy the schema")
                        .at("", "as a validator sees it")
                        .help(said)
                });
                let verdict = judged.or(verdict);
                let cases = plan.as_ref().map(Plan::examine).unwrap_or_default();
                let sound = if verdict.is_none() && cases.is_empty() { "ok, " } else { "" };
                let independent = if verdict.is_none() { ", independent" } else { "" };
                let swept = plan.map(|plan| format!(", {} cases", plan.cases())).unwrap_or_default();
                let _ = writeln!(text, "{file}: {sound}{counted}{independent}{swept}");
                text += &ledger;
                let mut finding = Finding { file: file.clone(), ledger: model.ledger, rank, ..Finding::default() };
                let mut diagnostics = model.warnings;
                diagnostics.extend(verdict);
                diagnostics.extend(cases);
                if diagnostics.iter().any(|d| d.severity == Severity::Error) {
                    exit = Exit::Refused;
                }
                finding.complain(&diagnostics, &document);
                if options.format == Format::Text {
                    complain(&diagnostics, &document);
                }
                findings.push(finding);
            }
            Err(refusals) => {
                exit = Exit::Refused;
                let ledger = refusals.ledger.clone();
                let mut finding = Finding { file: file.clone(), ledger, ..Finding::default() };
                for (places, diagnostics) in &refusals.list {
                    finding.complain(diagnostics, &**places);
                }
                findings.push(finding);
                if options.format == Format::Text {
                    refusals.report();
                }
            }
        }
    }
    match options.format {
        Format::Json => print(&format!("{:#}\n", document::check(&findings)), exit),
        Format::Text => print(&text, exit),
    }
}

/// Every unknown and every condition with its origin.
fn listed(ledger: &Ledger) -> String {
    let mut text = String::new();
    for (title, entries) in [("unknowns", &ledger.unknowns), ("conditions", &ledger.conditions)] {
        let _ = writeln!(text, "  {title}:");
        let width = entries.iter().map(|e| e.name.len()).max().unwrap_or(0);
        for e in entries {
            let _ = writeln!(text, "    {:width$}  {}", e.name, e.origin);
        }
    }
    text
}

/// What there is to say about the rank, if anything.
fn verdict(rank: &Rank, problem: &Problem) -> Option<Diagnostic> {
    match rank.deficiency {
        Some(0) if rank.forced.is_empty() => None,
        Some(0) => {
            let list: Vec<String> = rank
                .forced
                .iter()
                .map(|(name, v)| format!("{name} = {:.6}", if v.abs() < 5e-7 { 0.0 } else { *v }))
                .collect();
            let message =
                format!("the conditions determine a solution, but force {} all along the branch", list.join(", "));
            Some(
                Diagnostic::warning("forced-unknown", message)
                    .at_key("/unknowns", "an unknown that never changes")
                    .help("a condition contradicts the balance of the membrane, or has a wrong sign"),
            )
        }
        Some(_) => {
            let message = format!(
                "the conditions do not determine the solution: one of {} follows from the others",
                names(&rank.dependent)
            );
            let mut d = Diagnostic::error("dependent-condition", message);
            let written = rank.dependent.iter().filter(|name| problem.constraints.contains_key(*name));
            for name in written {
                d = d.at_key(format!("/constraints/{}", token(name)), "follows from the others, or they from it");
            }
            d = d
                .at("/meridian", "the count closes, the rank does not")
                .help(format!("left free: {}", names(&rank.free)));
            if rank.neutral {
                d = d.help("this is a neutral translation: the membrane may stand anywhere on the axis, and nothing says where");
            }
            if !rank.closing.is_empty() {
                d = d.help(format!("any one of these would close the system in its place: {}", names(&rank.closing)));
            }
            Some(d)
        }
        None => Some(
            Diagnostic::warning("rank-unknown", "no state was found at which the conditions could be examined")
                .help("`membrane run` says where it fails"),
        ),
    }
}

fn names(list: &[String]) -> String {
    list.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
}
