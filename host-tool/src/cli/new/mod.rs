//! `flexor new`: writes a first session file from a few questions, from options or for a wearer
//! file.

mod played;
mod worn;

use super::{Output, WrongUse, list, usage_error};
use clap::Args;
use host_core::record::RecordError;
use host_core::session::{Session, SessionError};
use host_core::wearer::Wearer;
use std::collections::BTreeMap;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// Write a session file from questions, options or a shipped file
///
/// On a terminal, asks for what no option gives; elsewhere the defaults apply. The file passes
/// flexor check.
#[derive(Args, Debug, Default)]
pub struct New {
    /// Session file to write; an existing file is never replaced
    session: PathBuf,
    /// Name in reports; default: A first session
    #[arg(long)]
    title: Option<String>,
    /// Duration of the stimulation, s; default: 10
    #[arg(long)]
    seconds: Option<String>,
    /// Number of channels, 1 to 10; default: 1
    #[arg(long)]
    channels: Option<String>,
    /// Output stage: current (default) or voltage
    #[arg(long)]
    stage: Option<String>,
    /// Largest amplitude that each channel accepts, mA or V; default: 10
    #[arg(long)]
    limit: Option<String>,
    /// Amplitude of each channel, at most --limit, mA or V; default: 5
    #[arg(long)]
    amplitude: Option<String>,
    /// Width of one phase, µs; default: 200
    #[arg(long)]
    width: Option<String>,
    /// Pulses per second; default: 30
    #[arg(long)]
    frequency: Option<String>,
    /// Pattern of the amplitudes: constant (default), on-off (2 s each; channels take turns), ramp
    /// (up and down), or cycle (phases of a crank at 40 rpm). The times are in the file
    #[arg(long)]
    program: Option<String>,
    /// Wearer file: one channel for each of its electrodes, at the motor threshold unless
    /// --amplitude is given; asks nothing
    #[arg(long, value_name = "FILE", conflicts_with_all = ["channels", "stage", "limit", "width", "frequency"])]
    wearer: Option<PathBuf>,
    /// Copy a shipped session, wearer, search or declaration by its name (flexor list); asks
    /// nothing
    #[arg(long, value_name = "NAME", conflicts_with_all = [
        "title", "seconds", "channels", "stage", "limit", "amplitude", "width", "frequency",
        "program", "wearer", "schema",
    ])]
    from: Option<String>,
    /// JSON schema for editors, as a path relative to the session file
    #[arg(long)]
    schema: Option<String>,
}

/// A question: its name, its text, the default answer, and the option that answers it.
type Question = (
    &'static str,
    &'static str,
    &'static str,
    fn(&New) -> &Option<String>,
);

#[rustfmt::skip]
const QUESTIONS: [Question; 9] = [
    ("title", "Name in reports", "A first session", |new| &new.title),
    ("seconds", "Duration of the stimulation, s", "10", |new| &new.seconds),
    ("channels", "Number of channels, 1 to 10", "1", |new| &new.channels),
    ("stage", "Output stage, current or voltage", "current", |new| &new.stage),
    ("limit", "Largest amplitude of each channel, mA or V", "10", |new| &new.limit),
    ("amplitude", "Amplitude of each channel, mA or V", "5", |new| &new.amplitude),
    ("width", "Width of one phase, µs", "200", |new| &new.width),
    ("frequency", "Pulses per second", "30", |new| &new.frequency),
    ("program", "Amplitudes: constant, on-off, ramp or cycle", "constant", |new| &new.program),
];

type Answers = BTreeMap<&'static str, String>;

/// # Errors
/// E518: the answers make no valid session. E525: the file exists. Also fails if the file cannot be
/// written.
pub fn main(args: &New, output: Output) -> anyhow::Result<()> {
    if args.session.exists() {
        return Err(file_exists_error(&args.session));
    }
    if let Some(name) = &args.from {
        return copy_shipped(args, name, output);
    }
    if let Some(wearer) = &args.wearer {
        return write(args, &session_on_wearer(args, wearer)?, RUN, output);
    }
    let is_complete = QUESTIONS.iter().all(|(.., given)| given(args).is_some());
    let answers = if std::io::stdin().is_terminal() && !output.json && !is_complete {
        ask_questions(
            args,
            &mut std::io::stdin().lock(),
            &mut std::io::stderr().lock(),
        )?
    } else {
        default_answers(args)
    };
    write(
        args,
        &valid_session(&answers).map_err(WrongUse)?,
        RUN,
        output,
    )
}

/// Copies the shipped file of this name, with the files that it refers to beside it.
///
/// # Errors
/// E518: no file or several files have this name. E525: a file exists. Also fails if a file cannot
/// be written.
fn copy_shipped(args: &New, name: &str, output: Output) -> anyhow::Result<()> {
    let name = name.strip_suffix(".toml").unwrap_or(name);
    let shipped = match &list::find_shipped(name)[..] {
        [shipped] => *shipped,
        [] => {
            return usage_error(format!(
                "--from is `{name}`, which is not the name of a shipped file{}; `flexor list` \
                 shows the names",
                list::did_you_mean(name)
            ));
        }
        several => {
            let names = several
                .iter()
                .map(|shipped| format!("{}/{name}", shipped.kind));
            let names = names.collect::<Vec<_>>().join(" or ");
            return usage_error(format!(
                "--from is `{name}`, the name of several files; give {names}"
            ));
        }
    };
    let folder = args.session.parent().unwrap_or(Path::new(""));
    let text = copy_companions(folder, shipped.text)?;
    write(args, &text, shipped.command, output)
}

/// Prefixes by which shipped files refer to wearers and sessions. The longest comes first, because
/// it contains another.
const FOLDERS: [(&str, &str); 3] = [
    ("../../wearers/", "wearers"),
    ("../wearers/", "wearers"),
    ("../sessions/", "sessions"),
];

/// Copies the wearers and sessions that `text` refers to into `folder`, and their own references in
/// turn. Returns `text` with the new paths.
fn copy_companions(folder: &Path, text: &str) -> anyhow::Result<String> {
    let mut text = text.to_owned();
    for (path, kind) in FOLDERS {
        let marker = format!("\"{path}");
        while let Some((before, after)) = text.split_once(&marker) {
            let Some((file, rest)) = after.split_once('"') else {
                break;
            };
            let file_name = file.rsplit('/').next().unwrap_or_default();
            let name = format!("{kind}/{}", file.trim_end_matches(".toml"));
            if let [companion] = list::find_shipped(&name)[..] {
                let companion = copy_companions(folder, companion.text)?;
                let copy = folder.join(file_name);
                // Several conditions of a declaration may refer to the same file.
                if std::fs::read_to_string(&copy).ok().as_ref() != Some(&companion) {
                    create(&copy, &companion)?;
                }
            }
            text = format!("{before}\"{file_name}\"{rest}");
        }
    }
    Ok(text)
}

/// Returns a session for a wearer file that `flexor check` accepts.
fn session_on_wearer(args: &New, wearer: &Path) -> anyhow::Result<String> {
    let text = Wearer::text(wearer)?;
    let read = Wearer::parse(&wearer.display().to_string(), &text)?;
    let usual = default_answers(args);
    let file = worn::wearer_path_in_session(&args.session, wearer)
        .display()
        .to_string();
    let answers = (
        &*usual["title"],
        &*usual["seconds"],
        args.amplitude.as_deref(),
        &*usual["program"],
    );
    let session = worn::compose(&read, &file, answers).map_err(WrongUse)?;
    Session::parse_with_wearers("session", &session, &|_| Ok(text.clone()))
        .map_err(|e| WrongUse(mistakes_text(&e)))?;
    Ok(session)
}

/// Command that uses a session file.
const RUN: &str = "flexor run FILE";

/// Writes the file, and prints `command` as the next step.
fn write(args: &New, session: &str, command: &str, output: Output) -> anyhow::Result<()> {
    let head = args.schema.as_ref();
    let head = head.map(|schema| format!("#:schema {schema}\n"));
    let text = head.unwrap_or_default() + session;
    create(&args.session, &text)?;
    output.print(
        || {
            format!(
                "{0} was written; {1}",
                args.session.display(),
                next_step_text(command, &args.session)
            )
        },
        || serde_json::json!({ "session": args.session, "error": null }),
    )
}

/// Returns the next command for the file, or a note that no command uses a copy.
fn next_step_text(command: &str, file: &Path) -> String {
    match command.contains("FILE") {
        true => format!(
            "next: {}",
            command.replace("FILE", &file.display().to_string())
        ),
        false => format!(
            "this copy is only for reading: {command} uses its built-in file, as preregistered"
        ),
    }
}

/// Writes a new file.
fn create(path: &Path, text: &str) -> anyhow::Result<()> {
    let file = std::fs::File::create_new(path);
    match file.and_then(|mut file| file.write_all(text.as_bytes())) {
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => Err(file_exists_error(path)),
        written => Ok(written.map_err(RecordError::io(path))?),
    }
}

fn file_exists_error(path: &Path) -> anyhow::Error {
    anyhow::anyhow!("E525 {} already exists; give another name", path.display())
}

/// Returns the answers that the options give, with defaults for the others.
fn default_answers(args: &New) -> Answers {
    let known = |(name, _, usual, given): Question| {
        let answer = given(args).clone();
        (name, answer.unwrap_or_else(|| usual.to_owned()))
    };
    QUESTIONS.map(known).into()
}

/// Asks every question that no option answers, again until the answer is valid.
fn ask_questions(
    args: &New,
    from: &mut impl BufRead,
    to: &mut impl Write,
) -> anyhow::Result<Answers> {
    let mut answers = default_answers(&New::default());
    for (name, question, usual, given) in QUESTIONS {
        if let Some(answer) = given(args) {
            answers.insert(name, answer.clone());
            continue;
        }
        loop {
            write!(to, "{question} [{usual}]: ")?;
            to.flush()?;
            let mut line = String::new();
            let ended = from.read_line(&mut line)? == 0;
            let answer = line.trim();
            let answer = if answer.is_empty() { usual } else { answer };
            answers.insert(name, answer.to_owned());
            match valid_session(&answers) {
                Err(why) if !ended => writeln!(to, "{why}")?,
                _ => break,
            }
        }
    }
    Ok(answers)
}

/// Returns the session file for these answers.
///
/// # Errors
/// Returns the reasons why the session is not valid.
fn valid_session(answers: &Answers) -> Result<String, String> {
    let text = compose(answers)?;
    match Session::parse("session", &text) {
        Ok(_) => Ok(text),
        Err(e) => Err(mistakes_text(&e)),
    }
}

/// Joins all mistakes into one line.
fn mistakes_text(e: &SessionError) -> String {
    let mistakes = e.errors().map(|e| format!("E{} {e}", e.problem().number()));
    mistakes.collect::<Vec<_>>().join("; ")
}

fn compose(answers: &Answers) -> Result<String, String> {
    for name in ["seconds", "limit", "amplitude", "width", "frequency"] {
        let given = &answers[name];
        if given.parse::<f64>().is_err() {
            return Err(format!("{name} is {given}, which is not a number"));
        }
    }
    let [title, seconds, channels, stage] =
        ["title", "seconds", "channels", "stage"].map(|name| &answers[name]);
    let [limit, amplitude, width, frequency] =
        ["limit", "amplitude", "width", "frequency"].map(|name| &answers[name]);
    let stage = match stage.as_str() {
        "current" => "{ kind = \"current\", full_scale_ma = 100.0 }",
        "voltage" => "{ kind = \"voltage\", full_scale_v = 150.0, load_ohm = 2000 }",
        other => return Err(format!("stage is {other}; allowed: current or voltage")),
    };
    let count = channels
        .parse::<u32>()
        .ok()
        .filter(|count| (1..=10).contains(count));
    let count = count.ok_or_else(|| format!("channels is {channels}; allowed: 1 to 10"))?;
    let hz: f64 = frequency.parse().unwrap_or(0.0);
    let mut text = format!("title = {}\nduration_s = {seconds}\n", toml_text(title));
    for number in 1..=count {
        // The channels take turns within a period.
        let offset_us = 1e6 / hz.max(1.0) * f64::from(number - 1) / f64::from(count);
        text.push_str(&format!(
            "\n[[channel]]\nnumber = {number}\nname = \"channel {number}\"\nstage = {stage}\n\
             limit = {limit}\ntrain = {{ shape = \"biphasic-cathodic-first\", width_us = {width}, \
             frequency_hz = {frequency}, offset_us = {} }}\n",
            offset_us.floor()
        ));
    }
    let values: Vec<_> = (1..=count)
        .map(|index| (index, amplitude.clone()))
        .collect();
    text += &played::compose(&answers["program"], &values, seconds, 50)?;
    Ok(text)
}

/// Returns a basic string of TOML, whose syntax includes that of JSON.
fn toml_text(text: &str) -> serde_json::Value {
    text.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every invalid answer is explained and asked again.
    #[test]
    fn questions_are_asked_until_a_session_comes_of_them() {
        let typed = "My \"first\"\n\n11\n3\nvoltage\n30\n31\n20\n1000\n250\n0\n50\n";
        let mut output = Vec::new();
        let answers = ask_questions(&New::default(), &mut typed.as_bytes(), &mut output).unwrap();
        let transcript = String::from_utf8(output).unwrap();
        for why in [
            "channels is 11",
            "E453",
            "E407",
            "`channel.train.width_us`",
            "`channel.train.frequency_hz`",
        ] {
            assert!(transcript.contains(why), "{why}: {transcript}");
        }
        let text = valid_session(&answers).unwrap();
        let session = Session::parse("new.toml", &text).unwrap();
        assert_eq!(
            (session.title.as_str(), session.channels.len()),
            ("My \"first\"", 3)
        );
        assert_eq!(session.duration_us, 10_000_000);
        assert_eq!(session.channels[2].spec.train.width_us, 250);
    }

    #[test]
    fn each_program_makes_a_session() {
        for program in ["constant", "on-off", "ramp", "cycle"] {
            for channels in ["1", "4", "10"] {
                let new = New {
                    program: Some(program.to_owned()),
                    channels: Some(channels.to_owned()),
                    ..New::default()
                };
                let text = valid_session(&default_answers(&new)).unwrap();
                let session = Session::parse("new.toml", &text).unwrap();
                let programs = &session.setpoints.programs;
                let expected = match program {
                    "constant" => 0,
                    _ => session.channels.len(),
                };
                assert_eq!(programs.channels().count(), expected, "{text}");
            }
        }
        let new = New {
            program: Some("sometimes".to_owned()),
            ..New::default()
        };
        let why = valid_session(&default_answers(&new)).unwrap_err();
        assert!(why.contains("program is sometimes"), "{why}");
    }
}
