//! The two files of a report: one for people, one for machines.

use super::{Report, page};
use crate::analysis::{
    ChannelDose, ForceMetrics, Metrics, WallContact, doses, force_limiting_share, force_metrics,
    limit_cycles, metrics, wall_contacts,
};
use crate::record::{
    Assumption, Disk, Ending, FileSystem, PaperRow, RecordError, RowCounts, TrialWearer,
    replace_file_on, write_summary,
};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Summary<'a> {
    title: &'a str,
    #[serde(flatten)]
    ending: &'a Ending,
    device: String,
    simulated: Option<bool>,
    seed: Option<u64>,
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
    #[serde(skip_serializing_if = "Option::is_none")]
    no_pulse_was_played: Option<&'a str>,
    pulses: Option<u64>,
    session_file: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    wearer: Option<&'a TrialWearer>,
    #[serde(flatten)]
    held: RowCounts,
    duration_s: f64,
    channels: Vec<ChannelDose>,
    metrics: Option<Metrics>,
    hits: Vec<WallContact>,
    forces: Vec<ForceMetrics>,
    force_limiting_share: Option<f64>,
    /// Number of times that the device lowered its feedback because of a limit cycle.
    limit_cycles: usize,
    counters: &'a [(String, u64)],
    events: &'a [(f64, String)],
}

/// Writes `report.html` into `dir`, replaces `summary.json` there, and returns the path of the
/// page. The summary is written first, because the page can be created again from the record. The
/// summary of a damaged record is not replaced, because no other file knows what the record
/// contained.
///
/// # Errors
/// The files cannot be written; the old summary stays.
pub fn write(dir: &Path, report: &Report) -> Result<PathBuf, RecordError> {
    write_on(&FileSystem, dir, report)
}

/// Writes the files of [`write`] on `disk`.
///
/// # Errors
/// The files cannot be written; the old summary stays.
pub fn write_on(disk: &dyn Disk, dir: &Path, report: &Report) -> Result<PathBuf, RecordError> {
    let failed = |why| RecordError::Write {
        path: dir.to_owned(),
        why,
    };
    disk.create_folder(dir).map_err(failed)?;
    let run = report.run;
    let summary = Summary {
        title: &run.title,
        ending: &run.ending,
        device: run.device_in_words(),
        simulated: run.simulated_if_known(),
        seed: run.seed,
        speed_factor: run.host.speed_factor,
        version: env!("CARGO_PKG_VERSION"),
        command: report.command,
        trials: run
            .trials
            .iter()
            .map(|trial| TrialSummary {
                name: &trial.name,
                no_pulse_was_played: trial.silent.as_deref(),
                pulses: trial.pulses,
                session_file: &trial.session_file,
                wearer: trial.wearer.as_ref(),
                held: RowCounts::from_trial(trial),
                duration_s: trial.duration_s,
                channels: doses(trial),
                metrics: metrics(trial),
                hits: wall_contacts(trial),
                forces: force_metrics(trial),
                force_limiting_share: force_limiting_share(trial),
                limit_cycles: limit_cycles(trial).count(),
                counters: &trial.counters,
                events: &trial.events,
            })
            .collect(),
        paper: report.paper,
        assumptions: report.assumptions,
    };
    let path = dir.join("report.html");
    if run.damage.is_empty() {
        write_summary(disk, dir, &summary)?;
    }
    replace_file_on(disk, &path, page(report).as_bytes())?;
    Ok(path)
}
