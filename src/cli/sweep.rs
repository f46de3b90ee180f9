//! `membrane run` of a sweep, and `membrane merge`.

use super::progress::Progress;
use super::{Exit, Format, interrupt, refuse, say};
use membrane::model::Model;
use membrane::output::{files, resolved};
use membrane::run::Request;
use membrane::spec::Document;
use membrane::sweep::crew::{self, Order};
use membrane::sweep::{self, Job, Journal, Opening, Rows, Shard, Table, Trouble};
use std::io::{self, Write};
use std::ops::ControlFlow;
use std::path::Path;

/// Cases that may be begun ahead of the next one that is printed.
const AHEAD: usize = 1000;

/// Arguments that only a sweep has.
#[derive(Debug, clap::Args)]
pub struct Options {
    /// Of a sweep, solve the I-th of N parts only: cases I-1, I-1+N, .. With --out the file is sweep-I-of-N.jsonl;
    /// `membrane merge` makes one of all.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Of a sweep, go on with the file in the directory of --out, if there is one.
    #[arg(long, conflicts_with = "overwrite")]
    resume: bool,
    /// Of a sweep, replace the file in the directory of --out, if there is one.
    #[arg(long)]
    overwrite: bool,
    /// Of a sweep, how many cases are solved at the same time; as many as there are processors unless given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
}

impl Options {
    /// One of those that are given.
    pub fn first(&self) -> Option<&'static str> {
        let given = [
            (self.shard.is_some(), "--shard"),
            (self.resume, "--resume"),
            (self.overwrite, "--overwrite"),
            (self.threads.is_some(), "--threads"),
        ];
        given.into_iter().find(|option| option.0).map(|option| option.1)
    }

    fn pool(&self) -> Result<rayon::ThreadPool, Exit> {
        let threads = self.threads.map_or(0, usize::from);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| refuse("no-threads", &format!("threads cannot be started: {error}")))
    }
}

/// Solves cases and hands their rows over; true if all were.
fn solve(
    job: &Job,
    cases: &[usize],
    before: usize,
    pool: &rayon::ThreadPool,
    order: Order,
    take: &mut dyn FnMut(Rows) -> ControlFlow<()>,
) -> bool {
    let mut progress = Progress::new("{len} cases, {elapsed}, {eta} to go");
    let mut done = 0;
    crew::each(pool, cases.len(), order, &|i| job.solve(cases[i], &interrupt::asked), &mut |rows| {
        take(rows)?;
        done += 1;
        progress.show(before + done, before + cases.len());
        ControlFlow::Continue(())
    });
    progress.clear();
    done == cases.len()
}

/// Solves a sweep into a file.
pub fn write(job: &Job, document: &Document, model: &Model, options: &Options, directory: &Path) -> Exit {
    let shard = options.shard.unwrap_or(Shard::WHOLE);
    let opening = match (options.resume, options.overwrite) {
        (true, _) => Opening::Resume,
        (_, true) => Opening::Overwrite,
        _ => Opening::New,
    };
    let pool = match options.pool() {
        Ok(pool) => pool,
        Err(exit) => return exit,
    };
    let mut journal = match Journal::open(directory, shard, job.problem(), opening) {
        Ok(journal) => journal,
        Err(trouble) => return refused(&trouble),
    };
    let problem = format!("{:#}\n", resolved(&document.problem, model));
    if let Err(error) = files::write(&directory.join("problem.json"), &problem) {
        return refuse("unwritable", &format!("{} cannot be written: {error}", directory.display()));
    }
    let known: std::collections::HashSet<usize> = journal.cases().collect();
    let cases: Vec<usize> = (0..job.plan.cases()).filter(|&i| shard.holds(i) && !known.contains(&i)).collect();
    let mut trouble = None;
    let all = solve(job, &cases, known.len(), &pool, Order::Free, &mut |rows| match journal.append(
        rows.case,
        &rows.lines(),
        rows.verdict.is_complete(),
    ) {
        Ok(()) => ControlFlow::Continue(()),
        Err(error) => {
            trouble = Some(error);
            ControlFlow::Break(())
        }
    });
    if let Some(trouble) = trouble {
        return refused(&trouble);
    }
    interrupt::finish(true);
    let (unsolved, path) = (journal.unsolved(), journal.path().display().to_string());
    let found = journal.cases().count();
    if let Err(trouble) = journal.finish() {
        return refused(&trouble);
    }
    let old = if known.is_empty() { String::new() } else { format!(" ({} were there)", known.len()) };
    if !all {
        say(&format!("{found} of {} cases{old} in {path}; --resume goes on", known.len() + cases.len()));
        return Exit::Interrupted;
    }
    say(&format!("{found} cases{old} in {path}"));
    verdict(unsolved)
}

/// Says how many cases are not solved.
fn verdict(unsolved: usize) -> Exit {
    if unsolved == 0 {
        return Exit::Done;
    }
    say(&format!("incomplete: {unsolved} cases were not, or not wholly, solved; their last rows say why"));
    Exit::Unsolved
}

fn refused(trouble: &Trouble) -> Exit {
    let code = match trouble {
        Trouble::Exists(_) => "exists",
        Trouble::Busy(_) => "busy",
        Trouble::Foreign(_) => "another-problem",
        Trouble::Damaged(..) => "damaged",
        Trouble::Io(..) => "unwritable",
    };
    refuse(code, &trouble.to_string())
}

/// Solves a sweep and prints it, in the order of the cases.
pub fn print(job: &Job, model: &Model, requests: &[Request], options: &Options, format: Format) -> Exit {
    if options.resume || options.overwrite {
        return refuse("no-file", "--resume and --overwrite are about the file of --out DIR, and there is none");
    }
    let pool = match options.pool() {
        Ok(pool) => pool,
        Err(exit) => return exit,
    };
    let shard = options.shard.unwrap_or(Shard::WHOLE);
    let cases: Vec<usize> = (0..job.plan.cases()).filter(|&i| shard.holds(i)).collect();
    let mut table = Table::new(job.plan, model, requests);
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut written = match format {
        Format::Text => write!(out, "{}\n\n{}", model.title, table.head()).and_then(|()| out.flush()),
        Format::Json => Ok(()),
    };
    let (mut unsolved, mut all) = (0, false);
    if written.is_ok() {
        all = solve(job, &cases, 0, &pool, Order::Kept(AHEAD), &mut |rows| {
            unsolved += usize::from(!rows.verdict.is_complete());
            let text = match format {
                Format::Json => rows.lines(),
                Format::Text => table.lines(&rows),
            };
            written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
            if written.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
    }
    let interrupted = interrupt::finish(false);
    if all && format == Format::Text {
        written = out.write_all(table.tail(model.accuracy).as_bytes()).and_then(|()| out.flush());
    }
    match written {
        // A reader that has seen enough is no mistake.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Exit::Done,
        Err(error) => refuse("unwritable", &format!("standard output cannot be written: {error}")),
        Ok(()) if interrupted || !all => Exit::Interrupted,
        Ok(()) if format == Format::Json => verdict(unsolved),
        Ok(()) if unsolved > 0 => Exit::Unsolved,
        Ok(()) => Exit::Done,
    }
}

/// Makes one file of those of several processes.
pub fn merge(directory: &Path, overwrite: bool) -> Exit {
    match sweep::merge(directory, overwrite) {
        Ok(merged) => {
            say(&format!("{} cases of {} parts in {}", merged.cases, merged.parts, merged.path.display()));
            verdict(merged.unsolved)
        }
        Err(message) => refuse("unmerged", &message),
    }
}
