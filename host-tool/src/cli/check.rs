//! `flexor check`: checks session files as `flexor run` does before it opens a device, wearer files as
//! every command does, and declarations as `flexor experiment` does.

use super::{Incomplete, Output};
use clap::{Args, ValueEnum};
use firmware::safety::StageSupply;
use host_core::run::check_supply;
use host_core::session::{Session, SessionError, escape_control_chars};
use host_core::wearer::{self, Wearer};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::experiments::load_experiment;
use studies::laboratory::Experiment;

/// Check sessions, wearers and declarations; print every mistake
///
/// The same check precedes each run. Exit code 1 if a file has a mistake.
#[derive(Args, Debug)]
pub struct Check {
    /// Session or wearer files, or declarations of a study (TOML)
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
    /// Check sessions for a board whose stages have this supply (`flexor stages`): with a common or
    /// undeclared supply, channels that can drive in opposite directions at the same time are a
    /// mistake
    #[arg(long)]
    supply: Option<Supply>,
}

/// Supply of a board's output stages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Supply {
    Common,
    Separate,
    Undeclared,
}

impl Supply {
    const fn stage_supply(self) -> Option<StageSupply> {
        match self {
            Self::Common => Some(StageSupply::Common),
            Self::Separate => Some(StageSupply::Separate),
            Self::Undeclared => None,
        }
    }
}

/// A file without mistakes.
enum ValidFile {
    Session(Box<Session>),
    Wearer(Box<Wearer>),
    Declaration(Box<Experiment>),
}

/// A file with mistakes.
enum InvalidFile {
    /// Session or wearer file with each of its mistakes.
    Placed(SessionError),
    /// Declaration with the text of its error.
    Declaration(String),
}

/// Reads a session file, a wearer file or a declaration. Only a wearer file names its schema, and only a
/// declaration has measures.
fn read(path: &Path) -> Result<ValidFile, InvalidFile> {
    let text = Session::text(path).unwrap_or_default();
    if wearer::is_wearer_file(&text) {
        let wearer = Wearer::read(path).map_err(InvalidFile::Placed)?;
        return Ok(ValidFile::Wearer(Box::new(wearer)));
    }
    let table: toml::Table = text.parse().unwrap_or_default();
    if table.contains_key("measures") && !table.contains_key("channel") {
        let experiment = load_experiment(&path.to_string_lossy());
        let experiment = experiment.map_err(|e| InvalidFile::Declaration(e.to_string()))?;
        return Ok(ValidFile::Declaration(Box::new(experiment)));
    }
    let session = Session::load(path).map_err(InvalidFile::Placed)?;
    Ok(ValidFile::Session(Box::new(session)))
}

impl InvalidFile {
    fn count(&self) -> usize {
        match self {
            Self::Placed(mistakes) => mistakes.errors().count(),
            Self::Declaration(_) => 1,
        }
    }

    fn picture(&self) -> String {
        match self {
            Self::Placed(mistakes) => super::mistakes_picture(mistakes),
            Self::Declaration(text) => escape_control_chars(text),
        }
    }

    fn to_json(&self) -> Vec<Value> {
        match self {
            Self::Placed(mistakes) => mistakes.to_json(),
            Self::Declaration(text) => vec![mistake_json(text)],
        }
    }
}

impl ValidFile {
    /// Returns the mistake of a session on a board with this supply, if there is one.
    fn supply_mistake(&self, supply: Option<Supply>) -> Option<String> {
        let Self::Session(session) = self else {
            return None;
        };
        let opposed = check_supply(session, supply?.stage_supply()).err()?;
        Some(opposed.to_string())
    }

    /// Returns a line that describes the file, and the notes about it.
    fn title_and_notes(&self) -> (String, Vec<String>) {
        match self {
            Self::Session(session) => {
                let mut lines = session_notes(session);
                lines.extend(program_charts(session));
                (escape_control_chars(&session.title), lines)
            }
            Self::Declaration(experiment) => {
                let count = experiment.conditions.len();
                let title = escape_control_chars(&experiment.declaration.title);
                let run = format!("{count} conditions; flexor experiment FILE runs the study");
                let advice = experiment.advice().unwrap_or_default();
                (title, std::iter::once(run).chain(advice).collect())
            }
            Self::Wearer(wearer) => {
                let count = wearer.electrodes.len();
                let s = if count == 1 { "" } else { "s" };
                let (name, evidence) = (&wearer.name, wearer.evidence.word());
                (
                    format!("wearer {name}, {evidence}, {count} electrode{s}"),
                    Vec::new(),
                )
            }
        }
    }

    fn to_json(&self, path: &Path) -> Value {
        match self {
            Self::Session(session) => {
                json!({ "session": path, "title": session.title, "notes": session_notes(session), "mistakes": [] })
            }
            Self::Declaration(experiment) => {
                json!({ "declaration": path, "title": experiment.declaration.title, "conditions": experiment.conditions.len(), "notes": experiment.advice().unwrap_or_default(), "mistakes": [] })
            }
            Self::Wearer(wearer) => {
                json!({ "wearer": path, "name": wearer.name, "evidence": wearer.evidence.word(), "mistakes": [] })
            }
        }
    }
}

/// Returns the notes from reading a session and those about its rise.
fn session_notes(session: &Session) -> Vec<String> {
    let read = session.notes.iter().cloned();
    read.chain(session.rise_notes()).collect()
}

/// Number of characters in the line that draws a program over the length of the session.
const COLUMNS: u64 = 64;

/// Draws the amplitudes of a session's programs over time, one line for each channel.
fn program_charts(session: &Session) -> Vec<String> {
    let programs = &session.setpoints.programs;
    if programs.is_empty() {
        return Vec::new();
    }
    let length_us = programs.two_passes_us().min(session.duration_us);
    let head = format!(
        "amplitudes of programs from 0 to {} s:",
        length_us as f64 / 1e6
    );
    let lines = programs.amplitude_charts(length_us, COLUMNS).into_iter();
    let lines = lines.map(|(channel, blocks)| format!("channel {:>2} {blocks}", channel + 1));
    std::iter::once(head).chain(lines).collect()
}

/// # Errors
/// E524: a file has a mistake; every mistake was printed.
pub fn main(args: &Check, output: Output) -> anyhow::Result<()> {
    let checked = args.sessions.iter().map(|path| (path, read(path)));
    let checked: Vec<_> = checked.collect();
    let wrong: Vec<&InvalidFile> = checked
        .iter()
        .filter_map(|(_, session)| session.as_ref().err())
        .collect();
    let opposed = checked.iter().map(|(_, session)| {
        let good = session.as_ref().ok();
        good.and_then(|good| good.supply_mistake(args.supply))
    });
    let opposed: Vec<Option<String>> = opposed.collect();
    let is_opposed = opposed.iter().flatten().count();
    let mistakes: usize = wrong.iter().map(|e| e.count()).sum::<usize>() + is_opposed;
    let files: Vec<Value> = checked
        .iter()
        .zip(&opposed)
        .map(|((path, session), opposed)| match (session, opposed) {
            (Ok(_), Some(mistake)) => {
                json!({ "session": path, "mistakes": [mistake_json(mistake)] })
            }
            (Ok(good), None) => good.to_json(path),
            (Err(e), _) => json!({ "session": path, "mistakes": e.to_json() }),
        })
        .collect();
    if !output.json {
        for e in &wrong {
            eprintln!("{}", e.picture());
        }
        for ((path, _), told) in checked.iter().zip(&opposed) {
            if let Some(mistake) = told {
                eprintln!("{}: {mistake}", path.display());
            }
        }
    }
    let wrong_files = wrong.len() + is_opposed;
    let people = || {
        let good = checked
            .iter()
            .zip(&opposed)
            .filter(|(_, text)| text.is_none());
        let lines = good.filter_map(|((path, session), _)| {
            let (title, notes) = session.as_ref().ok()?.title_and_notes();
            let good = format!("{}: good: {title}", path.display());
            let lines = std::iter::once(good).chain(notes.iter().cloned());
            Some(lines.collect::<Vec<_>>().join("\n  "))
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    if wrong_files == 0 {
        return output.print(people, || json!({ "sessions": files, "error": null }));
    }
    if !output.json && wrong_files < checked.len() {
        output.print(people, || Value::Null)?;
    }
    let error = anyhow::anyhow!(
        "E524 {mistakes} mistake{} in {} of {} files; correct each mistake that is listed",
        if mistakes == 1 { "" } else { "s" },
        wrong_files,
        checked.len()
    );
    let result = json!({ "sessions": files });
    Err(Incomplete { error, result }.into())
}

/// Returns the JSON of a mistake that has no place in the file: number and message.
fn mistake_json(text: &str) -> Value {
    let (number, message) = text.split_once(' ').unwrap_or(("", text));
    json!({ "number": number, "line": null, "column": null, "message": message, "help": null })
}
