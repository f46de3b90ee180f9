//! `membrane run`.

use super::problem::Understood;
use super::progress::Progress;
use super::{Exit, Format, Input, complain, interrupt, pair, print, problem, refuse, say, sweep};
use membrane::output::{Report, csv, document, files, table};
use membrane::run::{self, Status};
use membrane::sweep::Job;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Arguments.
#[derive(Debug, clap::Args)]
pub struct Options {
    #[command(flatten)]
    input: Input,
    /// Ask for the states where a quantity (unknown or output) has a value, instead of the whole branch, such as
    /// hbar=0.5. May be given several times, each a request of its own.
    #[arg(long = "at", value_name = "NAME=VALUE", value_parser = pair)]
    at: Vec<(String, String)>,
    /// Write result.json, branch.csv and profiles.csv (of a sweep: sweep.jsonl and problem.json) into this directory
    /// instead of printing the result.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t)]
    format: Format,
    /// Write the fields along the meridian into the JSON document as well.
    #[arg(long)]
    profiles: bool,
    #[command(flatten)]
    sweep: sweep::Options,
    /// The problem file; `-` is standard input.
    file: String,
}

/// Solves a problem.
pub fn run(options: &Options) -> Exit {
    let Understood { document, model, plan } = match problem::understand(&options.file, &options.input) {
        Ok(understood) => understood,
        Err(refusals) => return refusals.report(),
    };
    complain(&model.warnings, &document);
    let requests = match problem::requests(&model, &options.at) {
        Ok(requests) => requests,
        Err(refusals) => return refusals.report(),
    };
    if let Some(directory) = options.out.as_deref().filter(|d| d.exists() && !d.is_dir()) {
        return refuse("unwritable", &format!("{} is not a directory", directory.display()));
    }
    interrupt::listen();
    if let Some(plan) = &plan {
        let job = Job::new(&document.problem, &model, plan, &requests, options.profiles);
        return match &options.out {
            Some(directory) => sweep::write(&job, &document, &model, &options.sweep, directory),
            None => sweep::print(&job, &model, &requests, &options.sweep, options.format),
        };
    }
    if let Some(option) = options.sweep.first() {
        return refuse("no-sweep", &format!("{option} is for a sweep, and there is none: the file has no key `sweep`"));
    }
    let mut progress = Progress::new("{len} states, {elapsed}");
    let outcome = run::run(&model, &requests, &mut |done, total| {
        progress.show(done, total);
        if interrupt::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    progress.clear();
    let interrupted = interrupt::finish(options.out.is_some());
    let exit = match &outcome.status {
        _ if interrupted => Exit::Interrupted,
        Status::Complete => Exit::Done,
        Status::Incomplete(_) => Exit::Unsolved,
    };
    let report = Report { problem: &document.problem, model: &model, outcome: &outcome };
    if let (Status::Incomplete(message), true) =
        (&outcome.status, options.out.is_some() || options.format == Format::Json)
    {
        say(&format!("incomplete: {message}"));
    }
    match &options.out {
        Some(directory) => write(&report, directory, options.profiles, exit),
        None if options.format == Format::Json => print(&json(&report, options.profiles), exit),
        None => print(&table::result(&report), exit),
    }
}

fn json(report: &Report, profiles: bool) -> String {
    format!("{:#}\n", document::result(report, profiles))
}

/// Writes the files and says where they are.
fn write(report: &Report, directory: &Path, profiles: bool, exit: Exit) -> Exit {
    let texts = [
        ("result.json", json(report, profiles)),
        ("branch.csv", csv::branch(report)),
        ("profiles.csv", csv::profiles(report)),
    ];
    match files::write_all(directory, &texts) {
        Ok(()) => {
            let points = report.outcome.points.len();
            let states = if points == 1 { "1 state".into() } else { format!("{points} states") };
            let names = texts.map(|(name, _)| directory.join(name).display().to_string());
            say(&format!("{states} in {}", names.join(", ")));
            exit
        }
        Err(error) => refuse("unwritable", &format!("{} cannot be written: {error}", directory.display())),
    }
}
