//! The two files of a report: one for people, one for machines.

use super::{Report, page};
use crate::analysis::{ForceMetrics, Hit, Metrics, force_metrics, hits, metrics};
use crate::record::{Assumption, PaperRow};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Summary<'a> {
    title: &'a str,
    device: String,
    simulated: bool,
    seed: u64,
    speed_factor: Option<f64>,
    version: &'a str,
    command: &'a str,
    trials: Vec<TrialSummary<'a>>,
    paper: &'a [PaperRow],
    assumptions: &'a [Assumption],
}

#[derive(Serialize)]
struct TrialSummary<'a> {
    name: &'a str,
    session_file: &'a str,
    duration_s: f64,
    metrics: Option<Metrics>,
    hits: Vec<Hit>,
    forces: Vec<ForceMetrics>,
    counters: &'a [(String, u64)],
    events: &'a [(f64, String)],
}

/// Writes `report.html` and `summary.json` into `dir`; returns the page's path.
pub fn write(dir: &Path, report: &Report) -> std::io::Result<PathBuf> {
    std::fs::create_dir_all(dir)?;
    let run = report.run;
    let summary = Summary {
        title: &run.title,
        device: run.device_in_words(),
        simulated: run.is_simulated(),
        seed: run.seed,
        speed_factor: run.speed_factor,
        version: env!("CARGO_PKG_VERSION"),
        command: report.command,
        trials: run
            .trials
            .iter()
            .map(|trial| TrialSummary {
                name: &trial.name,
                session_file: &trial.session_file,
                duration_s: trial.duration_s,
                metrics: metrics(trial),
                hits: hits(trial),
                forces: force_metrics(trial),
                counters: &trial.counters,
                events: &trial.events,
            })
            .collect(),
        paper: report.paper,
        assumptions: report.assumptions,
    };
    let json = serde_json::to_string_pretty(&summary)?;
    std::fs::write(dir.join("summary.json"), json + "\n")?;
    let path = dir.join("report.html");
    std::fs::write(&path, page(report))?;
    Ok(path)
}
