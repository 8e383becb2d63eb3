//! `flexor experiment` and `flexor sweep` of studies that draw their persons.

use super::out::OutArgs;
use super::outcome::people;
use super::{Incomplete, Output, interrupt, wrong};
use interrupt::Ended;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::catalog::{Asked, Entry};
use studies::laboratory::{Outcome, Runnable, Shard, Sweep, decided_by};

/// The study that is asked for, within what it allows.
fn begun(entry: &Entry, asked: &Asked<'_>) -> anyhow::Result<Box<dyn Runnable>> {
    let mistakes = entry.mistakes(asked);
    match mistakes.is_empty() {
        true => entry.begin(asked),
        false => wrong(mistakes.join("; ")),
    }
}

/// Runs a whole study, or goes on with it where its folder has it begun.
///
/// # Errors
/// Arguments out of range, a folder that holds something else or cannot be written, a signal.
pub(super) fn experiment(
    entry: &Entry,
    asked: &Asked<'_>,
    out: &OutArgs,
    output: Output,
) -> anyhow::Result<()> {
    let study = begun(entry, asked)?;
    let begun = out.dir().filter(|dir| Sweep::of(dir).is_ok());
    let place = match begun.filter(|_| !out.overwrites()) {
        Some(dir) => study.sweep(Shard::WHOLE).place(dir)?,
        None => {
            let place = out.place(asked.name)?;
            study.sweep(Shard::WHOLE).begin(place.dir())?;
            place
        }
    };
    run(&*study, (place.dir(), Shard::WHOLE), asked.name, output)
}

/// Runs a study, or a shard of it, in a folder; or merges the folders of its shards.
///
/// # Errors
/// As [`experiment`]; parts that make no whole.
pub(super) fn sweep(
    entry: &Entry,
    asked: &Asked<'_>,
    (shard, merge): (Shard, &[PathBuf]),
    dir: &Path,
    output: Output,
) -> anyhow::Result<()> {
    if let Some(first) = merge.first() {
        let (seed, draws) = decided_by(first)?;
        let decided = (Some(seed), Some(draws));
        let outcome = begun(entry, &Asked { decided, ..*asked })?.merge(merge, dir)?;
        return say(&outcome, dir, output);
    }
    let study = begun(entry, asked)?;
    let _mine = study.sweep(shard).place(dir)?;
    run(&*study, (dir, shard), asked.name, output)
}

fn run(
    study: &dyn Runnable,
    (dir, shard): (&Path, Shard),
    name: &str,
    output: Output,
) -> anyhow::Result<()> {
    let interruption = interrupt::heed()?;
    let bar = output.bar(name);
    let mut done = 0.0;
    let ran = study.run(dir, shard, &mut |part| {
        bar.set(part);
        done = part;
        interruption.asked().is_none()
    })?;
    bar.finish();
    let signal = interruption.asked().filter(|_| !ran.is_whole);
    let ended = signal.map(|it| Ended(it, format!("after {}; {}", ran.done, kept(done))).into());
    match (ran.outcome, ran.failed.or(ended)) {
        (Some(outcome), None) => say(&outcome, dir, output),
        (None, None) => say_shard(&format!("sweep {name}"), (shard, dir), output),
        // What was computed is printed, whatever becomes of the folder.
        (outcome, Some(error)) => {
            if let (Some(outcome), false) = (&outcome, output.json) {
                output.say(|| people(outcome), || Value::Null)?;
            }
            let result = outcome.map_or_else(|| json!({}), |it| json!({ "result": it }));
            Err(Incomplete { error, result }.into())
        }
    }
}

/// Says what came out, and where its pages lie.
fn say(outcome: &Outcome, dir: &Path, output: Output) -> anyhow::Result<()> {
    let pages = pages(dir);
    output.say(
        || {
            let lines = pages.iter().map(|(name, page)| match &**name {
                "page" => format!("\nPage: {page}"),
                name => format!("\n{}: {page}", capital(name)),
            });
            people(outcome) + &lines.collect::<String>()
        },
        || {
            let mut all = json!({ "result": outcome });
            for (name, page) in &pages {
                all[name] = page.as_str().into();
            }
            all
        },
    )
}

/// Name and path of the pages in a folder: `result.html` is "page", the others are called by
/// their files.
fn pages(dir: &Path) -> Vec<(String, String)> {
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

fn capital(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}

/// Of a sweep that ended when this part of it was done.
pub(super) fn kept(done: f64) -> String {
    format!(
        "after {:.0} % of the sweep; the same command goes on from there",
        100.0 * done
    )
}

/// Says that this shard of what `command` draws is whole, and what to do with it.
///
/// # Errors
/// The standard output cannot be written.
pub(super) fn say_shard(
    command: &str,
    (shard, dir): (Shard, &Path),
    output: Output,
) -> anyhow::Result<()> {
    let dir = dir.display().to_string();
    let text = format!(
        "the shard is whole; merge all of them: flexor {command} --merge {dir} … --out DIR"
    );
    output.say(
        || text,
        || serde_json::json!({ "shard": shard, "folder": dir }),
    )
}
