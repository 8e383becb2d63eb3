//! `flexor check`: session files against all that `flexor run` asks of them before
//! it opens a device.

use super::{Incomplete, Output};
use clap::Args;
use host_core::session::{Session, SessionError};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Check session files: every mistake of every file, as a run would tell it.
#[derive(Args, Debug)]
pub struct Check {
    /// Session files (TOML)
    #[arg(required = true)]
    sessions: Vec<PathBuf>,
}

/// # Errors
/// E524: a file has a mistake; each was told.
pub fn main(args: &Check, output: Output) -> anyhow::Result<()> {
    let checked = args.sessions.iter().map(|path| (path, Session::load(path)));
    let checked: Vec<_> = checked.collect();
    let wrong: Vec<&SessionError> = checked
        .iter()
        .filter_map(|(_, it)| it.as_ref().err())
        .collect();
    let mistakes: usize = wrong.iter().map(|e| e.all().count()).sum();
    let files: Vec<Value> = checked
        .iter()
        .map(|(path, it)| match it {
            Ok(session) => json!({ "session": path, "title": session.title, "notes": session.notes, "mistakes": [] }),
            Err(e) => json!({ "session": path, "mistakes": mistakes_of(e) }),
        })
        .collect();
    if !output.json {
        for e in &wrong {
            eprintln!("{:?}", miette::Report::new((*e).clone()));
        }
    }
    let people = || {
        let lines = checked.iter().filter_map(|(path, it)| {
            let session = it.as_ref().ok()?;
            let good = format!("{}: good: {}", path.display(), session.title);
            Some(
                std::iter::once(good)
                    .chain(session.notes.clone())
                    .collect::<Vec<_>>()
                    .join("\n  "),
            )
        });
        lines.collect::<Vec<_>>().join("\n")
    };
    if wrong.is_empty() {
        return output.say(people, || json!({ "sessions": files, "error": null }));
    }
    if !output.json && wrong.len() < checked.len() {
        output.say(people, || Value::Null)?;
    }
    let error = anyhow::anyhow!(
        "E524 {mistakes} mistake{} in {} of {} session files; mend what is told of each",
        if mistakes == 1 { "" } else { "s" },
        wrong.len(),
        checked.len()
    );
    let result = json!({ "sessions": files });
    Err(Incomplete { error, result }.into())
}

/// Number, place, message and help of each.
fn mistakes_of(e: &SessionError) -> Vec<Value> {
    let each = e.all().map(|e| {
        let (line, column) = e.line_and_column().unzip();
        json!({
            "number": format!("E{}", e.problem().number()),
            "line": line,
            "column": column,
            "message": e.to_string(),
            "help": miette::Diagnostic::help(e).map(|help| help.to_string()),
        })
    });
    each.collect()
}
