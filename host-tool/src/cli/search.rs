//! `flexor search`: finds threshold, comfort and maximum of a wearer by a configured staircase.

use super::perform::SEED;
use super::typed::{Closed, TypedLines};
use super::{Incomplete, Output, interrupt, usage_error};
use clap::Args;
use host_core::link::Error;
use host_core::run::{DeviceName, SessionFile};
use host_core::session::{Session, escape_control_chars};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use studies::laboratory::search::{
    Answer, DeviceError, Finding, Milli, OnDevice, Operator, Question, SHIPPED, Search, SearchEnd,
    SearchFile, Step, search,
};

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
    let (file, session) = load(&args.file)?;
    let is_port = args.device.is_port();
    if is_port && args.seed.is_some() {
        return usage_error(
            "--seed needs --device native, chip or qemu: a board has no simulated wearer",
        );
    }
    let simulated = (!is_port).then_some(());
    ensure_no_mistakes(&args.file, mistakes(&file, &session, simulated.is_some()))?;
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
            list.push(json_report(declared, &session, &finding));
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

/// Loads a search, built in or from a file, and the session that it names.
fn load(path: &Path) -> anyhow::Result<(SearchFile, Session)> {
    let named = SHIPPED.iter().find(|(name, _)| path == Path::new(name));
    let named = named.filter(|_| !path.exists());
    let text = match named {
        Some((_, text)) => (*text).to_owned(),
        None => Session::text(path)?,
    };
    let file = match SearchFile::parse(&text) {
        Ok(file) => file,
        Err(mistakes) => {
            ensure_no_mistakes(path, mistakes)?;
            unreachable!("a refused file has mistakes")
        }
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let session = match named {
        // A search of the program, with a session of the program.
        Some(_) => SessionFile::load(Path::new(file.session.trim_start_matches("../sessions/")))?,
        None => SessionFile::load(&folder.join(&file.session))?,
    };
    Ok((file, session.session))
}

/// Returns the reasons why the searches do not fit this session.
fn mistakes(file: &SearchFile, session: &Session, is_simulated: bool) -> Vec<String> {
    let limit_of = |number: u8| {
        let mut channels = session.channels.iter();
        let channel = channels.find(|c| c.number == number && c.spec.train.trigger.is_none())?;
        Some((Milli(channel.spec.limit.get()), channel.unit().symbol()))
    };
    let mut messages = Vec::new();
    for (search, number) in file.searches.iter().zip(1..) {
        let declared = search.declaration();
        let mut beyond = search.limit_violations(limit_of);
        if is_simulated && declared.kind.is_rated() && declared.simulated_rating.is_none() {
            beyond.push("simulated_rating is missing: a simulated wearer gives no ratings".into());
        }
        let message = |violation| format!("search {number}: {violation}");
        messages.extend(beyond.into_iter().map(message));
    }
    messages
}

fn ensure_no_mistakes(path: &Path, mistakes: Vec<String>) -> anyhow::Result<()> {
    anyhow::ensure!(
        mistakes.is_empty(),
        "E527 the search file {} has mistakes: {}",
        path.display(),
        mistakes.join("\n  ")
    );
    Ok(())
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
    match finding.ended {
        SearchEnd::Found | SearchEnd::Limit => None,
        SearchEnd::Refused(level) => Some(anyhow::anyhow!(
            "E536 the operator did not allow the level {level}, so the search ended; it had \
             reached {reached}"
        )),
        SearchEnd::Failed(DeviceError::Link(Error::Interrupted(signal))) => {
            let when = format!("during a search, which reached {reached}; the device was stopped");
            Some(interrupt::EndedBySignal(signal, when).into())
        }
        SearchEnd::Failed(error) => Some(error.into()),
    }
}

/// Text that stands for the unit of levels that are ratios to the largest level, `max`.
const PART: &str = "of max";

fn unit(search: &Search, session: &Session) -> &'static str {
    let site_channel = |site: &studies::laboratory::search::Site| match site.max {
        Some(_) => None,
        None => session.channel(site.channel - 1),
    };
    let channel = search.sites().first().and_then(site_channel);
    channel.map_or(PART, |channel| channel.unit().symbol())
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
        match unit(search, session) {
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
    let (unit, low) = (unit(search, session), finding.low);
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

fn json_report<E>(search: &Search, session: &Session, finding: &Finding<E>) -> Value {
    let trail = finding.trail.iter().map(|step| {
        let answer = match step.answer {
            Answer::Measured(v) => json!({ "deviation_deg": v.deviation, "bound_deg": v.bound }),
            Answer::Seen(moved) => json!({ "seen": moved }),
            Answer::Rated(rating, accepted) => json!({ "rating": rating, "accepted": accepted }),
        };
        json!({
            "level": step.level, "repeat": step.repeat, "pulses": step.pulses,
            "positive": step.answer.is_positive(), "answer": answer,
        })
    });
    let ended = match finding.ended {
        SearchEnd::Found => "found",
        SearchEnd::Limit => "limit",
        SearchEnd::Refused(_) => "refused",
        SearchEnd::Failed(_) => "failed",
    };
    let channels: Vec<u8> = search.sites().iter().map(|site| site.channel).collect();
    json!({
        "kind": search.declaration().kind.name(), "channels": channels,
        "unit": unit(search, session), "value": finding.value, "low": finding.low,
        "high": finding.high, "set": finding.level_to_set(search), "ended": ended,
        "presentations": finding.trail.len(), "pulses": finding.pulses,
        "false_alarm": search.false_alarm(), "trail": trail.collect::<Vec<_>>(),
    })
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
