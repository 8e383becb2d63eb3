//! `flexor experiment` and `flexor sweep` for studies with random wearers.

use super::out::OutArgs;
use super::outcome::outcome_text;
use super::{Incomplete, Output, interrupt, usage_error};
use host_core::link::Interruption;
use interrupt::EndedBySignal;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::catalog::{Entry, StudyRequest};
use studies::laboratory::{Outcome, RunProgress, Runnable, Shard, Sweep, seed_and_draws};

/// Advice after an interruption, if the folder keeps the finished work.
pub(super) const GOES_ON: &str = "run the same command again to continue";

/// Prepares the requested study, after a check of its arguments.
fn prepare_study(entry: &Entry, asked: &StudyRequest<'_>) -> anyhow::Result<Box<dyn Runnable>> {
    let mistakes = entry.mistakes(asked);
    match mistakes.is_empty() {
        true => entry.begin(asked),
        false => usage_error(mistakes.join("; ")),
    }
}

/// Runs a whole study, or resumes the study that its folder contains unfinished.
///
/// # Errors
/// Fails if an argument is out of range, the folder holds something else or cannot be written, or a
/// signal arrives.
pub(super) fn run_experiment(
    entry: &Entry,
    asked: &StudyRequest<'_>,
    out: &OutArgs,
    output: Output,
) -> anyhow::Result<()> {
    let study = prepare_study(entry, asked)?;
    let begun = out.dir().filter(|dir| Sweep::read(dir).is_ok());
    let place = match begun.filter(|_| !out.overwrites()) {
        Some(dir) => study.place(dir, Shard::WHOLE)?,
        None => {
            let place = out.claim_folder(asked.name)?;
            study.sweep(Shard::WHOLE).begin(place.dir())?;
            place
        }
    };
    let command = format!("sweep {}", asked.name);
    let at = (Some(place.dir()), Shard::WHOLE);
    run(&*study, at, (asked.name, &command), output)
}

/// Runs a study or a shard of it in a folder, or merges the folders of its shards.
///
/// # Errors
/// Returns the errors of [`run_experiment`], or fails if the shards do not make a whole study.
pub(super) fn run_sweep(
    entry: &Entry,
    asked: &StudyRequest<'_>,
    (shard, merge): (Shard, &[PathBuf]),
    dir: &Path,
    output: Output,
) -> anyhow::Result<()> {
    if let Some(first) = merge.first() {
        let (seed, draws) = seed_and_draws(first)?;
        let decided = (Some(seed), Some(draws));
        let study = prepare_study(entry, &StudyRequest { decided, ..*asked })?;
        return merge_shards(&*study, merge, dir, output);
    }
    let study = prepare_study(entry, asked)?;
    let _mine = study.place(dir, shard)?;
    let command = format!("sweep {}", asked.name);
    run(&*study, (Some(dir), shard), (asked.name, &command), output)
}

/// Merges the folders of a study's shards, and prints the outcome.
///
/// # Errors
/// Fails if the shards do not make a whole study.
pub(super) fn merge_shards(
    study: &dyn Runnable,
    parts: &[PathBuf],
    dir: &Path,
    output: Output,
) -> anyhow::Result<()> {
    let ran = study.merge(parts, dir)?;
    print_outcome(&ran, Some(dir), output)
}

/// Does long work with a progress bar. The work ends early after a signal.
///
/// # Errors
/// Returns the errors of the work.
pub(super) fn with_progress_bar<T>(
    (what, output): (&str, Output),
    interruption: &Interruption,
    work: impl FnOnce(&mut dyn FnMut(f64) -> bool) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let bar = output.bar(what);
    let result = work(&mut |part| {
        bar.set(part);
        interruption.received_signal().is_none()
    });
    bar.finish();
    result
}

/// Returns the error of a run that a signal ended early; `None` if the run is complete.
pub(super) fn interruption_error(
    ran: &RunProgress,
    dir: Option<&Path>,
    interruption: &Interruption,
) -> Option<anyhow::Error> {
    let signal = interruption.received_signal().filter(|_| !ran.is_whole)?;
    let goes_on = dir.map_or(String::new(), |_| format!("; {GOES_ON}"));
    Some(EndedBySignal(signal, format!("after {}{goes_on}", ran.done)).into())
}

/// Runs a study or a shard of it. The results go into a folder, if there is one. `name` labels the
/// progress bar; `command` is the command that merges the shards.
///
/// # Errors
/// Fails if a unit fails or cannot be stored, or if a signal arrives.
pub(super) fn run(
    study: &dyn Runnable,
    (dir, shard): (Option<&Path>, Shard),
    (name, command): (&str, &str),
    output: Output,
) -> anyhow::Result<()> {
    let interruption = interrupt::catch_signals()?;
    let run = |go_on: &mut dyn FnMut(f64) -> bool| study.run(dir, shard, go_on);
    let mut ran = with_progress_bar((name, output), &interruption, run)?;
    let ended = interruption_error(&ran, dir, &interruption);
    let Some(error) = ran.failed.take().or(ended) else {
        return match dir.filter(|_| ran.outcome.is_none()) {
            Some(dir) => print_shard_complete(command, (shard, dir), output),
            None => print_outcome(&ran, dir, output),
        };
    };
    // Computed results are printed even if the folder cannot be kept.
    if let (Some(outcome), false) = (&ran.outcome, output.json) {
        output.print(|| result_text(&ran, outcome), || Value::Null)?;
    }
    let result = ran.outcome.map_or_else(
        || json!({}),
        |outcome| json!({ "result": outcome, "folder": dir }),
    );
    Err(Incomplete { error, result }.into())
}

/// Returns the text of a run for the terminal: the study's own table if it has one, otherwise the
/// general table of its outcome.
fn result_text(ran: &RunProgress, outcome: &Outcome) -> String {
    ran.table.clone().unwrap_or_else(|| outcome_text(outcome))
}

/// Prints the outcome and the paths of its pages.
fn print_outcome(ran: &RunProgress, dir: Option<&Path>, output: Output) -> anyhow::Result<()> {
    let Some(outcome) = &ran.outcome else {
        return Ok(());
    };
    let pages = dir.map(page_paths).unwrap_or_default();
    output.print(
        || {
            let lines = pages.iter().map(|(name, page)| match &**name {
                "page" => format!("\nPage: {page}"),
                name => format!("\n{}: {page}", capitalize(name)),
            });
            result_text(ran, outcome) + &lines.collect::<String>()
        },
        || {
            let mut report = json!({ "result": outcome, "folder": dir });
            for (name, page) in &pages {
                report[name] = page.as_str().into();
            }
            report
        },
    )
}

/// Returns names and paths of the pages in a folder: `result.html` is "page", the others have the
/// names of their files.
fn page_paths(dir: &Path) -> Vec<(String, String)> {
    let mut pages = vec![(
        "page".to_owned(),
        dir.join("result.html").display().to_string(),
    )];
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter_map(|name| name.strip_suffix(".html").map(str::to_owned))
        .filter(|name| name != "result")
        .collect();
    names.sort();
    pages.extend(names.into_iter().map(|name| {
        let page = dir.join(format!("{name}.html")).display().to_string();
        (name, page)
    }));
    pages
}

fn capitalize(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

/// Returns the advice after a complete shard of `command`.
pub(super) fn shard_complete_text(command: &str, dir: &Path) -> String {
    let dir = dir.display();
    format!("the shard is complete; merge all shards: flexor {command} --merge {dir} … --out DIR")
}

/// Prints that a shard of `command` is complete.
///
/// # Errors
/// Fails if the standard output cannot be written.
pub(super) fn print_shard_complete(
    command: &str,
    (shard, dir): (Shard, &Path),
    output: Output,
) -> anyhow::Result<()> {
    output.print(
        || shard_complete_text(command, dir),
        || json!({ "shard": shard, "folder": dir }),
    )
}
