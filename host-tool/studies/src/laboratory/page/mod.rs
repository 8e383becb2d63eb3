//! Builds the page of an experiment from its `result.json` and its recorded trials.

mod decides;
mod figures;
mod grid;
mod headline;
mod limb;
mod pivot;
mod sheets;
mod tables;
mod timing;

use super::conduct::ConductedTrial;
use super::error::LaboratoryError;
use super::quoted::quote_for_shell;
use super::result::{Outcome, ShownCondition};
use figures::{beside, measures, multiples, shares};
use hal_sim::input;
pub use headline::headline;
use host_core::html;
use host_core::record::{Trial, replace_file};
use host_core::report::{Html, document, figure};
use std::path::{Path, PathBuf};
use tables::{rows_table, shares_table};

const JSON: &str = "result.json";
const HTML: &str = "result.html";

/// Writes `result.json` and the page of the experiment into `dir`, which contains the record of
/// `trials`.
///
/// # Errors
/// Fails if a file cannot be written.
pub fn publish(
    dir: &Path,
    outcome: &Outcome,
    trials: &[ConductedTrial],
) -> Result<(), LaboratoryError> {
    replace_file(&dir.join(JSON), outcome.json().as_bytes())?;
    let trials: Vec<&Trial> = trials
        .iter()
        .map(|measurement| &measurement.trial)
        .collect();
    replace_file(&dir.join(HTML), page(outcome, &trials).as_bytes())?;
    Ok(())
}

/// Rebuilds the page of the experiment in `dir`, which contains the record of `trials`. Returns the
/// path of the page, or `None` if `dir` has no `result.json`.
///
/// # Errors
/// Fails with E608 if `result.json` has contents that this program does not write, or if the page
/// cannot be written.
pub fn rebuild_page(dir: &Path, trials: &[Trial]) -> Result<Option<PathBuf>, LaboratoryError> {
    let Some(outcome) = read_outcome(dir)? else {
        return Ok(None);
    };
    let trials: Vec<&Trial> = trials.iter().collect();
    let html = dir.join(HTML);
    replace_file(&html, page(&outcome, &trials).as_bytes())?;
    Ok(Some(html))
}

/// Reads `result.json` in `dir`; returns `None` if the file does not exist.
///
/// # Errors
/// Fails with E608 if the file has contents that this program does not write, or if it cannot be
/// read.
pub(super) fn read_outcome(dir: &Path) -> Result<Option<Outcome>, LaboratoryError> {
    let json = dir.join(JSON);
    if !json.exists() {
        return Ok(None);
    }
    let file = json.display().to_string();
    let text = input::read_text(&json, input::LONGEST_DOCUMENT)
        .map_err(|error| LaboratoryError::File(file.clone(), error))?;
    let outcome = serde_json::from_str(&text).map_err(|error| {
        let reason = error.to_string();
        LaboratoryError::Damaged { file, reason }
    })?;
    Ok(Some(outcome))
}

/// The conditions as the page arranges them in rows, each with the trial that is shown for it, if
/// there is one.
type Rows<'a> = Vec<Vec<(&'a ShownCondition, Option<&'a Trial>)>>;

/// Returns the page as a self-contained HTML document. `trials` are the recorded ones; a sweep has
/// none.
#[must_use]
fn page(outcome: &Outcome, trials: &[&Trial]) -> String {
    let rows = rows(outcome, trials);
    let cut_short = outcome.cut_short.iter();
    let cut_short = cut_short.map(|reason| html!("<p class=\"result\">{}</p>\n", reason));
    let mut body = cut_short.collect::<Html>();
    body += html!(
        "<p class=\"result\">{}</p>\n<p class=\"facts\">{}</p>\n",
        headline(outcome),
        facts(outcome)
    );
    let claims = match grid::is_large(outcome) {
        true => {
            let details = collapsible("All shares with their intervals", shares_table(outcome));
            grid::section(outcome) + details
        }
        false => figure(&shares(outcome), "") + shares_table(outcome),
    };
    let kinds = pivot::kinds_table(outcome);
    let numbers = match grid::is_large(outcome) || !kinds.is_empty() {
        true => measures(outcome) + kinds + collapsible("All numbers", rows_table(outcome)),
        false => measures(outcome) + rows_table(outcome),
    };
    // Results without conditions, as of simulated participants, have no recorded trials.
    let timing = match outcome.conditions.is_empty() {
        true => Html::default(),
        false => timing::section(&rows),
    };
    for (title, text) in [
        ("Claims", claims),
        ("Fields that decide a claim", decides::section(outcome)),
        (
            "The paper's tables and figures",
            sheets::sheets(&outcome.sheets),
        ),
        ("One trial of each condition", multiples(&rows)),
        ("Movement of the limb", limb::section(&rows)),
        ("Timing of the pulses", timing),
        ("Measures", numbers),
        ("Notes", notes(outcome)),
        ("Preregistration", declaration_section(outcome)),
    ] {
        if !text.is_empty() {
            body += html!("<section><h2>{}</h2>\n{}</section>\n", title, text);
        }
    }
    document(&outcome.title, &body)
}

/// Returns a section that opens when its heading is clicked; empty if `text` is empty.
fn collapsible(heading: &str, text: Html) -> Html {
    match text.is_empty() {
        true => text,
        false => html!(
            "<details><summary>{}</summary>\n{}</details>\n",
            heading,
            text
        ),
    }
}

/// Arranges the conditions in rows by the level of the first factor. Rows without any trial are
/// left out; a sweep has none.
fn rows<'a>(outcome: &'a Outcome, trials: &[&'a Trial]) -> Rows<'a> {
    let trial =
        |shown: &'a ShownCondition| (shown, shown.trial.and_then(|at| trials.get(at)).copied());
    let rows = outcome.conditions.chunks(beside(&outcome.conditions));
    let rows = rows.map(|row| row.iter().map(trial).collect::<Vec<_>>());
    rows.filter(|row| row.iter().any(|(_, trial)| trial.is_some()))
        .collect()
}

/// Returns every condition that has a recorded trial, with that trial.
fn shown<'a, 'r>(rows: &'r Rows<'a>) -> impl Iterator<Item = (&'a ShownCondition, &'a Trial)> + 'r {
    let cells = rows.iter().flatten();
    cells.filter_map(|(shown, trial)| Some((*shown, (*trial)?)))
}

/// Returns a line about the origin of the numbers: paper, seed, number of wearers, and whether they
/// are simulated.
fn facts(outcome: &Outcome) -> Html {
    let drawn = match (outcome.declared.draws, &outcome.declared.drawn) {
        (draws, Some(noun)) => format!("{draws} random {noun}"),
        (0, None) => "no random wearers".to_owned(),
        (1, None) => "1 random wearer".to_owned(),
        (draws, None) => format!("{draws} random wearers"),
    };
    let notice = match outcome.simulated {
        Some(true) if outcome.declared.drawn.is_some() => {
            html!(" · <b>Simulated: models of chip and output stages, no board and no people.</b>")
        }
        Some(true) => html!(" · <b>Simulated wearers: no evidence about people.</b>"),
        Some(false) => Html::default(),
        None => html!(" · <b>No device answered: it is unknown whether this is simulated.</b>"),
    };
    html!(
        "{} · seed {} · {}{}",
        outcome.declared.source,
        outcome.seed,
        drawn,
        notice
    )
}

fn notes(outcome: &Outcome) -> Html {
    let notes = outcome.notes.iter();
    let notes: Html = notes.map(|note| html!("<li>{}</li>\n", note)).collect();
    html!("<ul>\n{}</ul>\n", notes)
}

fn declaration_section(outcome: &Outcome) -> Html {
    let (seed, draws) = (outcome.seed, outcome.declared.draws);
    let name = match &*outcome.declared.asked {
        "" => &outcome.name, // older results lack the field
        asked => asked,
    };
    let device = outcome.declared.device.as_deref();
    let device = device.filter(|device| *device != "native");
    let device = device.map_or_else(String::new, |device| format!(" --device {device}"));
    let drawn = outcome.declared.drawn.as_deref().unwrap_or("wearers");
    let own = match outcome.declared.as_declared {
        true => format!("Seed and number of {drawn} are those of the declaration."),
        false => format!(
            "Seed, wearer or number of {drawn} differ from the declaration: this result is \
             exploratory, not preregistered."
        ),
    };
    let shown = quote_for_shell(name);
    let command = match (&outcome.declared.command, draws) {
        (Some(command), _) => format!("flexor {command} --seed {seed}"),
        (None, 0) => format!("flexor experiment {shown}{device} --seed {seed} --draws 0"),
        (None, draws) => format!("flexor sweep {shown} --seed {seed} --draws {draws} --out DIR"),
    };
    let place = match name.ends_with(".toml") {
        true => html!("<p>In the folder of the declaration:</p>\n"),
        false => Html::default(),
    };
    let files = outcome.declared.sha256.iter();
    let files = files.map(|(file, hash)| format!("{hash}  {file}\n"));
    html!(
        "<p>{}</p>\n{}<pre>{}</pre>\n<p>SHA-256 of the declared files:</p>\n<pre>{}</pre>\n",
        own,
        place,
        command,
        files.collect::<String>()
    )
}
