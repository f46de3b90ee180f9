//! Commands, their options and exit codes. Words in, words out: what is done stands in the library.

mod check;
mod interrupt;
mod problem;
mod progress;
mod run;
mod start;
mod sweep;

use clap::{Args, Parser, Subcommand, ValueEnum};
use membrane::diagnostic::{self, Diagnostic, Locate};
use membrane::output::{explain, files};
use membrane::spec::{Document, Syntax, convert, schema_text};
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// How a command ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All that was asked for was done.
    Done,
    /// A valid problem that was not, or not wholly, solved.
    Unsolved,
    /// Bad usage, a bad file, or a problem that cannot be right.
    Refused,
    /// Stopped from outside.
    Interrupted,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(match exit {
            Exit::Done => 0,
            Exit::Unsolved => 1,
            Exit::Refused => 2,
            Exit::Interrupted => 130,
        })
    }
}

/// Solves contact problems of axisymmetric membranes from declarative problem files.
///
/// A problem file is RON or JSON: parameters, membrane, bodies, meridian, branch, outputs. `membrane new NAME` writes
/// one to start from, with every line explained.
#[derive(Debug, Parser)]
#[command(name = "membrane", version, max_term_width = 110, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 all that was asked for was solved; 1 a valid problem, not (wholly) solved, what was found is written; \
2 bad usage, file or problem; 130 interrupted, what was found is written.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Solve what a problem file declares.
    Run(run::Options),
    /// Say what is wrong with problem files: words, meaning, count of unknowns and conditions, rank.
    Check(check::Options),
    /// Write the segments, equations, unknowns and conditions of a problem as Markdown.
    Explain {
        #[command(flatten)]
        input: Input,
        /// The problem file; `-` is standard input.
        file: String,
    },
    /// Print the JSON Schema of problem files, for editors.
    Schema,
    /// Write the same problem as RON or JSON, by the extensions of the files. Comments are lost.
    Convert {
        /// How IN is written, where its extension does not say.
        #[arg(long, value_name = "SYNTAX")]
        from: Option<Language>,
        /// The problem file; `-` is standard input.
        #[arg(value_name = "IN")]
        input: String,
        /// The file that is written: .ron or .json.
        #[arg(value_name = "OUT")]
        output: String,
    },
    /// Make one file, sweep.jsonl, of those that several processes with --shard have written.
    Merge {
        /// Replace a file that exists.
        #[arg(long)]
        overwrite: bool,
        /// The directory in which they are.
        #[arg(value_name = "DIR")]
        directory: PathBuf,
    },
    /// Write NAME.ron, a problem that runs, with every line explained.
    New {
        /// Name of the file, with or without .ron.
        name: String,
    },
}

/// How a problem file is read.
#[derive(Clone, Debug, Args)]
pub struct Input {
    /// Set a parameter (a number or expression, in the unit in which the file writes it), or a top-level key (in RON),
    /// such as r0=2.5 or 'material=MooneyRivlin(c1: 0.5, c2: 0.05)'.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = pair)]
    pub sets: Vec<(String, String)>,
    /// Repeat the branch for several values of a parameter: a list r0=1.1,1.5,2, or r0=1.1..2:10 (10 values), or
    /// k=1..100:10:log (equal ratios). Several make a grid. The file's own sweep is replaced.
    #[arg(long = "sweep", value_name = "NAME=VALUES", value_parser = pair)]
    pub sweeps: Vec<(String, String)>,
    /// How the file is written, where its extension does not say.
    #[arg(long, value_name = "SYNTAX")]
    pub from: Option<Language>,
}

/// A syntax of problem files.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Language {
    /// Rusty Object Notation.
    Ron,
    /// JSON.
    Json,
}

impl Language {
    fn syntax(self) -> Syntax {
        match self {
            Language::Ron => Syntax::Ron,
            Language::Json => Syntax::Json,
        }
    }
}

/// A format of results.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs: one document.
    Json,
}

/// `KEY=VALUE`, split at the first `=`.
fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() && !value.trim().is_empty() => {
            Ok((key.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err("a name, `=` and a value are wanted".into()),
    }
}

/// Runs the command that the arguments ask for.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            let _ = error.print(); // help, version, or what is wrong; a closed pipe is no mistake
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    let exit = match cli.command {
        Command::Run(options) => run::run(&options),
        Command::Check(options) => check::check(&options),
        Command::Explain { input, file } => match problem::understand(&file, &input) {
            Ok(problem::Understood { document, model, plan }) => {
                complain(&model.warnings, &document);
                print(&explain::explain(&document.problem, &model, plan.as_ref()), Exit::Done)
            }
            Err(refusals) => refusals.report(),
        },
        Command::Schema => print(&schema_text(), Exit::Done),
        Command::Convert { from, input, output } => rewrite(&input, from, &output),
        Command::Merge { overwrite, directory } => sweep::merge(&directory, overwrite),
        Command::New { name } => start::write(&name),
    };
    exit.into()
}

/// Writes a problem in the syntax of the other file's extension.
fn rewrite(input: &str, from: Option<Language>, output: &str) -> Exit {
    let syntax = match Path::new(output).extension().and_then(|e| e.to_str()).map(str::to_lowercase).as_deref() {
        Some("ron") => Syntax::Ron,
        Some("json") => Syntax::Json,
        _ => return refuse("unknown-extension", &format!("{output}: the file to write must end in .ron or .json")),
    };
    let document = match Document::load(input, from.map(Language::syntax)) {
        Ok(document) => document,
        Err(rejected) => {
            complain(&rejected.diagnostics, &*rejected);
            return Exit::Refused;
        }
    };
    let same =
        |a: &str, b: &str| matches!((std::fs::canonicalize(a), std::fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b);
    if same(input, output) {
        return refuse("same-file", &format!("{output} would replace the file that is read, and its comments be lost"));
    }
    let written = convert::write(&document.problem, syntax).map_err(io::Error::other);
    match written.and_then(|text| files::write(Path::new(output), &text)) {
        Ok(()) => Exit::Done,
        Err(error) => refuse("unwritable", &format!("{output} cannot be written: {error}")),
    }
}

/// Prints a result. A reader that has seen enough and closed the pipe is no mistake.
fn print(text: &str, exit: Exit) -> Exit {
    let mut out = io::BufWriter::new(io::stdout().lock());
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            refuse("unwritable", &format!("standard output cannot be written: {error}"))
        }
        _ => exit,
    }
}

/// Says something on standard error.
fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Refuses for a reason that has no place in a file.
fn refuse(code: &'static str, message: &str) -> Exit {
    say(&format!("error[{code}]: {message}"));
    Exit::Refused
}

/// Shows diagnostics on standard error.
fn complain(diagnostics: &[Diagnostic], places: &dyn Locate) {
    let mut err = io::stderr().lock();
    let colour = err.is_terminal() && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
    let _ = err.write_all(diagnostic::render(diagnostics, places, colour).as_bytes());
}
