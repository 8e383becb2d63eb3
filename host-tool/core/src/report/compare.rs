//! Several records side by side.

use super::Html;
use super::page::{document, figure};
use super::tables::{degrees, headed, models_in_words, newtons, seconds};
use super::trajectory;
use crate::analysis::{force_metrics, hits, limit_cycles, metrics_but_lag};
use crate::html;
use crate::record::{Run, Trial};
use serde::Serialize;
use std::path::Path;

/// A record and what to call it.
#[derive(Debug)]
pub struct Compared {
    /// Its folder, as given.
    pub name: String,
    /// What it holds.
    pub run: Run,
}

/// One trial of one record in numbers. `None`: it has no such thing.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct CompareRow {
    /// The record, from 1.
    pub number: usize,
    /// Its folder.
    pub record: String,
    /// The trial.
    pub trial: String,
    /// What stimulated.
    pub device: String,
    /// Whether that was a simulator.
    pub simulated: bool,
    /// Whether the run came to its own end.
    pub complete: bool,
    /// Whether the record has lost something since.
    pub damaged: bool,
    /// Length, s.
    pub duration_s: f64,
    /// Of a joint that followed a target, degrees.
    pub rmse_deg: Option<f64>,
    /// Of the worst channel under force control, N.
    pub rmse_n: Option<f64>,
    /// At a virtual wall, degrees inside.
    pub deepest_deg: Option<f64>,
    /// Pulses of more than 0 that were played; not the electrode check's.
    pub pulses: Option<u64>,
    /// How often the device lowered a joint's feedback for a limit cycle.
    pub limit_cycles: usize,
    /// The model that each muscle began with.
    pub models: Option<String>,
}

/// A row for each trial of each record, in the order given.
#[must_use]
pub fn compare_rows(all: &[Compared]) -> Vec<CompareRow> {
    let numbered = all.iter().enumerate();
    let rows = numbered.flat_map(|(position, compared)| {
        let trials = compared.run.trials.iter();
        trials.map(move |trial| row(position + 1, compared, trial))
    });
    rows.collect()
}

fn row(number: usize, compared: &Compared, trial: &Trial) -> CompareRow {
    let run = &compared.run;
    let forces = force_metrics(trial).into_iter().map(|m| m.rmse_n);
    let depths = hits(trial).into_iter().map(|hit| hit.deepest_deg);
    CompareRow {
        number,
        record: compared.name.clone(),
        trial: trial.name.clone(),
        device: run.device_in_words(),
        simulated: run.is_simulated(),
        complete: !run.ending.is_incomplete(),
        damaged: !run.damage.is_empty(),
        duration_s: trial.duration_s,
        rmse_deg: metrics_but_lag(trial).map(|m| m.rmse_deg),
        rmse_n: forces.reduce(f64::max),
        deepest_deg: depths.reduce(f64::max),
        pulses: trial.pulses,
        limit_cycles: limit_cycles(trial).count(),
        models: models_in_words(trial),
    }
}

const HEADS: [&str; 8] = [
    "length",
    "RMSE",
    "force",
    "deepest",
    "pulses",
    "limit cycles",
    "muscle model",
    "",
];

fn cells(row: &CompareRow) -> [String; 8] {
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let mut marks = Vec::new();
    if row.damaged {
        marks.push("damaged");
    }
    if !row.complete {
        marks.push("incomplete");
    }
    if row.simulated {
        marks.push("simulated");
    }
    [
        format!("{} s", seconds(row.duration_s)),
        or_none(row.rmse_deg.map(degrees)),
        or_none(row.rmse_n.map(newtons)),
        or_none(row.deepest_deg.map(degrees)),
        or_none(row.pulses.map(|count| count.to_string())),
        row.limit_cycles.to_string(),
        or_none(row.models.clone()),
        marks.join(", "),
    ]
}

/// A table for a terminal of 80 columns.
#[must_use]
pub fn compare_text(all: &[Compared]) -> String {
    let mut text = String::new();
    for (position, compared) in all.iter().enumerate() {
        text.push_str(&format!("{:>2}  {}\n", position + 1, compared.name));
        if let Some(damaged) = compared.run.damaged(Path::new(&compared.name)) {
            text.push_str(&format!("    {damaged}\n"));
        }
    }
    let [length, rmse, force, deepest, pulses, ..] = HEADS;
    text.push_str(&format!(
        "\n    {:<18}{length:>9}{rmse:>8}{force:>9}{deepest:>8}{pulses:>7}\n",
        "trial"
    ));
    for row in compare_rows(all) {
        let [length, rmse, force, deepest, pulses, ..] = cells(&row);
        let name: String = row.trial.chars().take(17).collect();
        // 63 columns before the mark.
        let mark = match &row {
            row if row.damaged => " damaged",
            row if !row.complete => " incomplete",
            row if row.simulated => " simulated",
            _ => "",
        };
        let number = row.number;
        text.push_str(&format!(
            "{number:>2}  {name:<18}{length:>9}{rmse:>8}{force:>9}{deepest:>8}{pulses:>7}{mark}\n"
        ));
        if row.limit_cycles > 0 {
            text.push_str(&format!("      limit cycles: {}\n", row.limit_cycles));
        }
        // One a line: of ten channels, within 80 columns.
        for model in row.models.iter().flat_map(|models| models.split("), ")) {
            let close = if model.ends_with(')') { "" } else { ")" };
            text.push_str(&format!("      {model}{close}\n"));
        }
    }
    text.trim_end().to_owned()
}

/// A self-contained HTML document: the table, and every trial's course.
#[must_use]
pub fn compare_page(all: &[Compared]) -> String {
    let title = format!("{} records side by side", all.len());
    let mut out = Html::default();
    if all.iter().any(|compared| compared.run.is_simulated()) {
        out += html!("<p class=\"facts\"><b>Simulated wearer: no evidence about people.</b></p>\n");
    }
    let records = all.iter().map(|compared| {
        let run = &compared.run;
        let caveat = run.caveat().map(|text| html!(" <b>{}</b>", text));
        html!(
            "<li>{}: {}, <code>{}</code>{}</li>\n",
            run.title,
            run.device_in_words(),
            compared.name,
            caveat.unwrap_or_default()
        )
    });
    out += html!("<ol>\n{}</ol>\n", records.collect::<Html>());
    let rows = compare_rows(all).into_iter().map(|row| {
        let cells = cells(&row).map(|cell| html!("<td>{}</td>", cell));
        html!(
            "<tr><td>{}</td><th scope=\"row\">{}</th>{}</tr>\n",
            row.number,
            row.trial,
            cells.into_iter().collect::<Html>()
        )
    });
    let heads = ["Record", "Trial"].into_iter().chain(HEADS);
    out += headed(heads, &rows.collect());
    let numbered = all.iter().enumerate();
    let trials: Vec<Trial> = numbered
        .flat_map(|(position, compared)| {
            let trials = compared.run.trials.iter().cloned();
            trials.map(move |trial| Trial {
                name: format!("{}: {}", position + 1, trial.name),
                ..trial
            })
        })
        .collect();
    out += figure(&trajectory::figure(&trials), "");
    document(&title, &out)
}
