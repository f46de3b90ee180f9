//! `membrane check`.

use super::{Exit, Format, Input, print, problem};
use membrane::output::document::{self, Finding};
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
            Ok((_, model)) => {
                let (unknowns, conditions) = (model.ledger.unknowns.len(), model.ledger.conditions.len());
                let _ = writeln!(text, "{file}: ok, {unknowns} unknowns and {conditions} conditions");
                findings.push(Finding::clean(file, model));
            }
            Err(refusals) => {
                exit = Exit::Refused;
                let mut finding = Finding { file: file.clone(), ..Finding::default() };
                for (places, diagnostics) in &refusals.0 {
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
