//! The command line: parses arguments, runs one of the commands, and returns the exit code.

mod bare;
mod bench;
mod board;
mod calibrate;
mod chart;
mod check;
mod chip;
mod commands;
mod compare;
mod completion;
mod demo;
mod devices;
mod draw_cost;
mod drawn;
mod edges;
mod experiment;
mod explain;
mod explain_model;
mod faults;
mod flash;
mod hil;
mod interrupt;
mod keep_alives;
mod list;
mod moment;
mod monitor;
mod muscle;
mod new;
mod on_bench;
mod operator;
mod out;
mod outcome;
mod perform;
mod playground;
mod profile;
mod protocol;
mod renamed;
mod report;
mod rerun;
mod run;
mod search;
mod selftest;
mod serve;
mod stages;
mod study;
mod sweep;
mod two_points;
mod typed;
mod watch;
mod wearer_args;

pub use demo::overview_svg;

use anyhow::Context;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{FromArgMatches, Parser, Subcommand};
use host_core::choice::{self, ChoiceError};
use host_core::record::Ending;
use host_core::session::{Session, SessionError, escape_control_chars};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// An open ten-channel muscle stimulator: run sessions on a simulator or a board
#[derive(Parser, Debug)]
#[command(name = "flexor", version)]
struct Cli {
    /// Print results as JSON
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Bench(bench::Bench),
    Calibrate(calibrate::CalibrateArgs),
    #[command(subcommand)]
    Chart(chart::Chart),
    Check(check::Check),
    #[command(name = "chip")]
    Bare(bare::BareArgs),
    Demo(demo::Demo),
    Run(run::RunArgs),
    Rerun(rerun::Rerun),
    Report(report::ReportArgs),
    Compare(compare::Compare),
    Completion(completion::Completion),
    Serve(serve::Serve),
    Edges(edges::Edges),
    Explain(explain::Explain),
    ExplainModel(explain_model::ExplainModel),
    Experiment(experiment::ExperimentArgs),
    List(list::List),
    Faults(faults::FaultsArgs),
    TwoPoints(two_points::TwoPointsArgs),
    Man(completion::Man),
    Monitor(monitor::Monitor),
    Muscle(muscle::Muscle),
    New(new::New),
    Playground(playground::PlaygroundArgs),
    Profile(profile::ProfileArgs),
    Protocol(protocol::ProtocolArgs),
    Search(search::SearchArgs),
    Selftest(selftest::Selftest),
    Stages(stages::StagesArgs),
    Board(board::BoardArgs),
    Devices(devices::DevicesArgs),
    Flash(flash::FlashArgs),
    Hil(hil::HilArgs),
    Image(flash::ImageArgs),
    Sweep(sweep::SweepArgs),
}

/// Format of results and progress.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    json: bool,
}

/// Progress of long work: a bar on a terminal, nothing in a pipe.
pub struct Bar(ProgressBar);

/// Output of a command that has not been printed yet.
struct CommandOutput {
    people: String,
    machines: serde_json::Value,
}

impl CommandOutput {
    /// Prints the output.
    ///
    /// # Errors
    /// Returns the errors of [`print_line`].
    fn print(self, output: Output) -> anyhow::Result<()> {
        output.print(|| self.people, || self.machines)
    }
}

impl Output {
    /// Prints a result as text or as JSON.
    ///
    /// # Errors
    /// Returns the errors of [`print_line`].
    pub fn print(
        self,
        people: impl FnOnce() -> String,
        machines: impl FnOnce() -> serde_json::Value,
    ) -> anyhow::Result<()> {
        let text = if self.json {
            machines().to_string()
        } else {
            printable(&people())
        };
        print_line(&text)
    }

    /// Replaces `"auto"` models by concrete ones; a terminal shows a spinner meanwhile.
    ///
    /// # Errors
    /// Returns the errors of [`choice::resolve_auto_models`].
    fn settle_models(self, session: &mut Session) -> Result<(), ChoiceError> {
        let busy = ProgressBar::new_spinner().with_message(
            "choosing muscle models by trying the session; nothing is stimulated or recorded yet",
        );
        busy.enable_steady_tick(Duration::from_millis(100));
        let settled = choice::resolve_auto_models(session);
        busy.finish_and_clear();
        settled
    }

    pub fn bar(self, label: &str) -> Bar {
        let bar = ProgressBar::new(1000).with_message(escape_control_chars(label));
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:40}] {percent:>3} % {elapsed}")
        {
            bar.set_style(style);
        }
        Bar(bar)
    }
}

impl Bar {
    /// Shows the finished part, 0 to 1.
    pub fn set(&self, part: f64) {
        self.0.set_position((part * 1000.0) as u64);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}

/// Replaces all characters in `text` that would control a terminal.
fn printable(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(escape_control_chars).collect();
    lines.join("\n")
}

/// Prints a line to the standard output. A closed pipe, as `head` leaves it, is not an error.
fn print_line(line: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout().lock(), "{line}") {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(error).context("E523 cannot write to the standard output; check where it goes")
        }
        _ => Ok(()),
    }
}

/// Parses the command line and runs it. Exit code 0: success, 1: failure, 2: wrong use, 130, 143
/// and 129: ended by SIGINT, SIGTERM and SIGHUP.
pub fn main() -> ExitCode {
    let (arguments, notes) = renamed::translate(std::env::args_os());
    for note in notes {
        eprintln!("{note}");
    }
    let matches = commands::command_line().try_get_matches_from(arguments);
    let cli = match matches.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => return report_parse_error(&error),
    };
    let output = Output { json: cli.json };
    #[cfg(unix)]
    if let Err(error) = interrupt::ignore_file_size_signal() {
        print_error(&error);
        return ExitCode::FAILURE;
    }
    let result = match &cli.command {
        Command::Bench(args) => bench::main(args, output),
        Command::Calibrate(args) => calibrate::main(args, output),
        Command::Chart(chart) => chart::main(chart, output),
        Command::Check(args) => check::main(args, output),
        Command::Bare(args) => bare::main(args, output),
        Command::Demo(args) => demo::main(args, output),
        Command::Run(args) => run::main(args, output),
        Command::Rerun(args) => rerun::main(args, output),
        Command::Report(args) => report::main(args, output),
        Command::Compare(args) => compare::main(args, output),
        Command::Completion(args) => completion::main(args, output),
        Command::Serve(args) => serve::main(args, output),
        Command::Edges(args) => edges::main(args, output),
        Command::Explain(args) => explain::main(args, output),
        Command::ExplainModel(args) => explain_model::main(args, output),
        Command::Experiment(args) => experiment::main(args, output),
        Command::List(args) => list::main(args, output),
        Command::Faults(args) => faults::main(args, output),
        Command::TwoPoints(args) => two_points::main(args, output),
        Command::Man(args) => completion::manual(args, output),
        Command::Monitor(args) => monitor::main(args, output),
        Command::Muscle(args) => muscle::main(args, output),
        Command::New(args) => new::main(args, output),
        Command::Playground(args) => playground::main(args, output),
        Command::Profile(args) => profile::main(args, output),
        Command::Protocol(args) => protocol::main(args, output),
        Command::Search(args) => search::main(args, output),
        Command::Selftest(args) => selftest::main(args, output),
        Command::Stages(args) => stages::main(args, output),
        Command::Board(args) => board::main(args, output),
        Command::Devices(args) => devices::main(args, output),
        Command::Flash(args) => flash::main(args, output),
        Command::Hil(args) => hil::main(args, output),
        Command::Image(args) => flash::image_main(args, output),
        Command::Sweep(args) => sweep::main(args, output),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report_failure(&error, output),
    }
}

/// Prints the error for people and machines, and returns the exit code.
fn report_failure(error: &anyhow::Error, output: Output) -> ExitCode {
    if output.json
        && let Err(lost) = print_line(&failure_json(error).to_string())
    {
        print_error(&lost);
    }
    print_error(error);
    ExitCode::from(exit_code(error))
}

/// Reports a command line that could not be parsed, or prints the help.
fn report_parse_error(error: &clap::Error) -> ExitCode {
    let is_help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if is_help || !error.use_stderr() {
        error.exit()
    }
    let text = error.render().to_string();
    let why = text.strip_prefix("error: ").unwrap_or(&text).trim_end();
    let why = why.to_owned() + &suggested_command(error);
    let json = std::env::args_os().any(|name| name == "--json");
    report_failure(&WrongUse(why).into(), Output { json })
}

/// Suggests the command that was probably meant, where clap itself suggests none.
fn suggested_command(error: &clap::Error) -> String {
    let typed = match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(typed))
            if error.get(ContextKind::SuggestedSubcommand).is_none() =>
        {
            typed
        }
        _ => return String::new(),
    };
    let command = commands::command_line();
    let names = command.get_subcommands().map(clap::Command::get_name);
    let nearest = host_core::suggestion::nearest(typed, names);
    nearest.map_or_else(String::new, |name| {
        format!("\n\nDid you mean `flexor {name}`?")
    })
}

/// Prints where the record of a failed run is, and whether it is complete.
fn print_record_place(dir: &Path) {
    let place = dir.display();
    if Ending::load(dir).is_incomplete() {
        eprintln!("the record, marked incomplete, is in {place}");
    } else if dir.join("report.html").is_file() {
        eprintln!("the record is complete and in {place}");
    } else {
        eprintln!("the record is complete and in {place}; `flexor report {place}` writes its page");
    }
}

/// Returns the exit code of a failed command.
fn exit_code(error: &anyhow::Error) -> u8 {
    if let Some(incomplete) = error.downcast_ref::<Incomplete>() {
        return exit_code(&incomplete.error);
    }
    match interrupt::ending_signal(error) {
        Some(signal) => signal.exit_code(),
        None if error.is::<WrongUse>() => 2,
        None => 1,
    }
}

/// An argument that the command cannot use. Exit code 2.
#[derive(Debug, thiserror::Error)]
#[error("{}", with_error_number(.0))]
struct WrongUse(String);

/// Puts E518 before `text`, unless that begins with a number of its own.
fn with_error_number(text: &str) -> String {
    let digits = text.strip_prefix('E').and_then(|rest| rest.get(..3));
    match digits.is_some_and(|digits| digits.bytes().all(|byte| byte.is_ascii_digit())) {
        true => text.to_owned(),
        false => format!("E518 {text}"),
    }
}

/// Fails with a [`WrongUse`] error.
fn usage_error<T>(message: impl Into<String>) -> anyhow::Result<T> {
    Err(WrongUse(message.into()).into())
}

/// Refuses an option's value outside `min` to `max`.
fn check_range(name: &str, value: f64, min: f64, max: f64) -> anyhow::Result<()> {
    match (min..=max).contains(&value) {
        true => Ok(()),
        false => usage_error(format!("{name} is {value}; allowed: {min} to {max}")),
    }
}

/// An error of a command that nevertheless has a partial result.
#[derive(Debug, thiserror::Error)]
#[error("{error:#}")]
struct Incomplete {
    error: anyhow::Error,
    result: serde_json::Value,
}

/// Returns one JSON object: the partial result, if any, and `error`.
fn failure_json(error: &anyhow::Error) -> serde_json::Value {
    use host_core::session::SessionError;
    let mut object = match error.downcast_ref::<Incomplete>() {
        Some(incomplete) => incomplete.result.clone(),
        None => serde_json::json!({}),
    };
    object["error"] = match error.downcast_ref::<SessionError>() {
        Some(file) => file.lines().into(),
        None => format!("{error:#}").into(),
    };
    object
}

/// Prints to the standard error and ignores failures, because no other output is left.
fn print_stderr(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints the error: a session file's with the line in question, any other as one sentence.
fn print_error(error: &anyhow::Error) {
    match error.downcast_ref::<SessionError>() {
        Some(mistakes) => print_stderr(&mistakes_picture(mistakes)),
        None => print_stderr(&format!("error: {}", printable(&format!("{error:#}")))),
    }
}

/// Returns all mistakes of a file, each with its number, lines of the file and advice.
fn mistakes_picture(mistakes: &SessionError) -> String {
    let picture = format!("{:?}", miette::Report::new(mistakes.clone()));
    picture.replace("\nError: E", "\nE") // miette marks all but the first
}

#[cfg(test)]
mod tests {
    use super::Cli;
    use clap::{Command, CommandFactory};

    /// Collects the short and long help of `command` and of all its subcommands.
    fn helps(command: &mut Command, texts: &mut Vec<String>) {
        texts.push(command.render_help().to_string());
        texts.push(command.render_long_help().to_string());
        for below in command.get_subcommands_mut() {
            helps(below, texts);
        }
    }

    #[test]
    fn help_speaks_to_people_not_to_rustdoc() {
        let mut texts = Vec::new();
        helps(&mut Cli::command(), &mut texts);
        assert!(texts.len() > 30, "{} texts", texts.len());
        for help in texts {
            for line in help.lines() {
                let is_code = ["[`", "`]", "::"].iter().any(|mark| line.contains(mark));
                assert!(!is_code, "{line}");
            }
        }
    }
}
