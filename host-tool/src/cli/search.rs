//! `flexor search`: finds threshold, comfort and maximum of a wearer by a configured staircase.

use super::perform::SEED;
use super::typed::{Closed, TypedLines};
use super::{Incomplete, Output, interrupt, usage_error};
use clap::Args;
use host_core::link::Error;
use host_core::run::DeviceName;
use host_core::search::{
    Answer, DeviceError, Finding, OnDevice, Operator, PART, Question, Search, SearchError,
    SearchFile, Step, level_unit, report as report_of, search,
};
use host_core::session::{Session, escape_control_chars};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::PathBuf;

/// Search a wearer's threshold, comfort or maximum by a staircase
///
/// On a board, needs an operator at the terminal, who is asked before each increase.
#[derive(Args, Debug)]
pub struct SearchArgs {
    /// Search file (TOML): a session file and one or more [[search]]
    file: PathBuf,
    /// Device: native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Seed of a wearer that this program simulates; default: 1
    #[arg(long)]
    seed: Option<u64>,
}

/// # Errors
/// Fails if the search file or the device is unusable, or a search ends early. Results until then
/// are printed.
pub fn main(args: &SearchArgs, output: Output) -> anyhow::Result<()> {
    let is_port = args.device.is_port();
    let (file, session) = SearchFile::load(&args.file, !is_port)?;
    if is_port && args.seed.is_some() {
        return usage_error(
            "--seed needs --device native, chip or qemu: a board has no simulated wearer",
        );
    }
    anyhow::ensure!(
        !is_port || std::io::stdin().is_terminal(),
        "E529 an operator must allow each higher level on {}; run the search in a terminal",
        args.device
    );
    let seed = args.seed.unwrap_or(SEED);
    let mut port = args.device.open(&session, seed)?;
    let interruption = interrupt::catch_signals()?;
    if !is_port {
        print_text(
            output,
            "Simulated with an assumed wearer model: no evidence about people.\n",
        )?;
    }
    let mut operator = Terminal::default();
    let mut report = json!({
        "file": args.file, "session": file.session, "device": args.device.to_string(),
        "seed": (!is_port).then_some(seed), "simulated": !is_port,
        "searches": [], "error": null,
    });
    for declared in &file.searches {
        let head = heading(declared, &session);
        print_text(output, &head)?;
        let asked = Some(interruption.clone());
        let begun = OnDevice::start(port, &session, declared, &mut operator, asked, seed);
        let mut probe = match begun {
            Ok(probe) => probe,
            Err(error) => return Err(incomplete_error(error, report)),
        };
        let finding = search(declared, &mut probe, |step| {
            let _ = print_text(output, &row(step)); // a closed pipe is not an error
        });
        let stopped = probe.stop();
        print_text(output, &conclusion(declared, &session, &finding))?;
        if let Some(list) = report["searches"].as_array_mut() {
            list.push(report_of(declared, &session, &finding));
        }
        if let Some(error) = early_end_error(finding) {
            return Err(incomplete_error(error, report));
        }
        port = stopped.map_err(|error| incomplete_error(error, report.clone()))?;
    }
    match output.json {
        true => output.print(String::new, || report),
        false => Ok(()),
    }
}

fn print_text(output: Output, text: &str) -> anyhow::Result<()> {
    match output.json {
        true => Ok(()),
        false => super::print_line(&super::printable(text)),
    }
}

/// Returns the error together with the results so far.
fn incomplete_error(error: impl Into<anyhow::Error>, result: Value) -> anyhow::Error {
    let error = error.into();
    Incomplete { error, result }.into()
}

/// Returns the error of a search that ended early.
fn early_end_error(finding: Finding<DeviceError>) -> Option<anyhow::Error> {
    let reached = finding.low;
    match finding.into_end() {
        Ok(()) => None,
        Err(SearchError::Device(DeviceError::Link(Error::Interrupted(signal)))) => {
            let when = format!("during a search, which reached {reached}; the device was stopped");
            Some(interrupt::EndedBySignal(signal, when).into())
        }
        Err(error) => Some(error.into()),
    }
}

fn heading(search: &Search, session: &Session) -> String {
    let named = search.sites().iter().map(|site| {
        let name = session
            .channel(site.channel - 1)
            .map(|c| escape_control_chars(&c.name));
        format!("{} ({})", site.channel, name.unwrap_or_default())
    });
    let channels: Vec<String> = named.collect();
    let line = format!(
        "{}: channel {}, levels in {}",
        search.declaration().kind.name(),
        channels.join(" + "),
        match level_unit(search, session) {
            PART => "fractions of max",
            unit => unit,
        }
    );
    let line: String = line.chars().take(80).collect();
    format!(
        "{line}\n{:>9} {:>6} {:>7}  answer",
        "level", "repeat", "pulses"
    )
}

fn row(step: &Step) -> String {
    let yes = step.answer.is_positive();
    let answer = match step.answer {
        Answer::Measured(v) => {
            let moved = if yes { "moved" } else { "did not move" };
            format!(
                "{moved}: deviation {:.2}°, bound {:.2}°",
                v.deviation, v.bound
            )
        }
        Answer::Seen(true) => "the operator saw it move".to_owned(),
        Answer::Seen(false) => "the operator did not see it move".to_owned(),
        Answer::Rated(rating, accepted) => {
            let more = if yes { "above" } else { "within" };
            format!("rated {rating}, {more} the accepted {accepted}")
        }
    };
    let (level, repeat, pulses) = (step.level.to_string(), step.repeat, step.pulses);
    format!("{level:>9} {repeat:>6} {pulses:>7}  {answer}")
}

fn conclusion<E>(search: &Search, session: &Session, finding: &Finding<E>) -> String {
    let (unit, low) = (level_unit(search, session), finding.low);
    let found = match (finding.value, finding.high) {
        (Some(value), Some(high)) => {
            let set = finding.level_to_set(search).unwrap_or_default();
            format!("{value} {unit}, between {low} and {high}; set {set} {unit}")
        }
        _ => format!("not found up to {low} {unit}"),
    };
    let (pulses, presentations) = (finding.pulses, finding.trail.len());
    format!("{found}; {presentations} presentations, {pulses} pulses\n")
}

/// Operator who answers at the terminal.
#[derive(Default)]
struct Terminal {
    typed: Option<TypedLines>,
    asked: Option<Question>,
}

impl Operator for Terminal {
    fn ask(&mut self, question: Question) {
        self.typed.get_or_insert_with(TypedLines::start).discard();
        prompt(question);
        self.asked = Some(question);
    }

    fn reply(&mut self) -> Option<u8> {
        let question = self.asked?;
        let line = match self.typed.as_ref()?.next_line() {
            Ok(line) => line?,
            // Without an operator nothing is allowed, and every level counts as too strong.
            Err(Closed) => return Some(safest_answer(question)),
        };
        let reply = parse_answer(question, &line);
        if reply.is_none() {
            prompt(question);
        }
        reply
    }
}

fn prompt(question: Question) {
    let answers = if question.most() == 1 { "[y/n] " } else { "" };
    eprint!("{question} {answers}");
}

const fn safest_answer(question: Question) -> u8 {
    match question {
        Question::Raise(..) => 0,
        Question::Rating(_) | Question::Moved(_) => question.most(),
    }
}

/// Parses the operator's answer to a question; `None` if the line is not a valid answer.
fn parse_answer(question: Question, line: &str) -> Option<u8> {
    match (question.most(), line.trim()) {
        (1, "y" | "yes") => Some(1),
        (1, "n" | "no") => Some(0),
        (1, _) => None,
        (most, number) => number.parse().ok().filter(|rating| *rating <= most),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::search::Milli;

    #[test]
    fn only_a_clear_answer_counts() {
        let (raise, rating) = (
            Question::Raise(Milli(1), Milli(2)),
            Question::Rating(Milli(2)),
        );
        assert_eq!(parse_answer(raise, " yes\n"), Some(1));
        assert_eq!(parse_answer(raise, "n"), Some(0));
        for unclear in ["", "1", "ja", "ye"] {
            assert_eq!(parse_answer(raise, unclear), None, "{unclear}");
        }
        assert_eq!(parse_answer(rating, "10"), Some(10));
        for unclear in ["", "y", "11", "-1", "3.5"] {
            assert_eq!(parse_answer(rating, unclear), None, "{unclear}");
        }
        assert_eq!((safest_answer(raise), safest_answer(rating)), (0, 10));
    }
}
