//! A run as a folder: `run.json`, and for each trial `NN-name/` with `trial.json`, `samples.csv`,
//! `edges.csv` and `markers.csv`.

use super::damage::{self, RowCounts, is_lost};
use super::disk::write_json;
use super::recorder::Recorder;
use super::{
    DeviceKind, FORMAT, RecordError, Run, Trial, ending, read_edges, read_markers, read_samples,
};
use crate::disk::{Disk, FileSystem};
use crate::session::KEPT_AS;
use hal_sim::input;
use serde::{Serialize, de::DeserializeOwned};
use std::path::{Path, PathBuf};

/// Writes `run.json`, which describes the run without its trials, and a `summary.json` that marks
/// the run as incomplete until it is replaced. Call this function before you create the first
/// [`Recorder`], so that an interrupted run can be loaded.
pub fn write_run(dir: &Path, run: &Run) -> Result<(), RecordError> {
    write_run_on(&FileSystem, dir, run)
}

/// Writes the files of [`write_run`] on `disk`.
///
/// # Errors
/// The files cannot be written.
pub fn write_run_on(disk: &dyn Disk, dir: &Path, run: &Run) -> Result<(), RecordError> {
    disk.create_folder(dir).map_err(RecordError::write(dir))?;
    ending::write_initial_summary(disk, dir, run)?;
    write_header_on(disk, dir, run)
}

/// Replaces `run.json` only, after facts about the device became known during a trial.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn write_header(dir: &Path, run: &Run) -> Result<(), RecordError> {
    write_header_on(&FileSystem, dir, run)
}

/// Replaces the file of [`write_header`] on `disk`.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn write_header_on(disk: &dyn Disk, dir: &Path, run: &Run) -> Result<(), RecordError> {
    #[derive(Serialize)]
    struct Header<'a> {
        #[serde(flatten)]
        run: &'a Run,
        kind: Option<DeviceKind>,
        simulated: Option<bool>,
    }
    let kind = run.device_kind();
    let header = Header {
        run,
        kind,
        simulated: run.simulated_if_known(),
    };
    write_json(disk, &dir.join("run.json"), &header)
}

/// Writes a complete run that is in memory, with all its trials.
pub fn save(dir: &Path, run: &Run) -> Result<(), RecordError> {
    write_run(dir, run)?;
    for (position, trial) in run.trials.iter().enumerate() {
        let mut recorder = Recorder::create(dir, position, trial)?;
        recorder.finish(&trial.counters, trial.duration_s)?;
    }
    Ok(())
}

/// Reads a run from its folder, also one that was interrupted. Its trials are the folders with a
/// `trial.json`, sorted by name. [`Run::damage`] of the result lists what a closed record has lost.
pub fn load(dir: &Path) -> Result<Run, RecordError> {
    let mut trials = Vec::new();
    let run = load_each(dir, &mut |trial| trials.push(trial))?;
    Ok(Run { trials, ..run })
}

/// Reads a run with only one trial in memory at a time. `receiver` receives the trials in their order,
/// and the returned run has no trials.
pub fn load_each(dir: &Path, receiver: &mut dyn FnMut(Trial)) -> Result<Run, RecordError> {
    let mut run = read_header(dir)?;
    let (ending, counted) = ending::read(dir)?;
    run.ending = ending;
    let mut found = Vec::new();
    for folder in trial_folders(dir)? {
        let mut trial: Trial = read_json(&folder.join("trial.json"))?;
        let samples = folder.join("samples.csv");
        match damage::describe_missing_file(&samples)? {
            Some(message) => run.damage.push(message),
            None => trial.samples = read_samples(&samples)?,
        }
        let edges = folder.join("edges.csv");
        // A trial that was stopped in its first steps has no edges.
        if edges.exists() {
            trial.edges = read_edges(&edges)?;
        }
        let markers = folder.join("markers.csv");
        // Records of earlier versions have no markers.
        if markers.exists() {
            trial.markers = read_markers(&markers)?;
        }
        // A trial that was never closed is as long as its rows.
        if run.ending.is_incomplete() && trial.counters.is_empty() {
            trial.duration_s = trial.samples.last().map_or(0.0, |sample| sample.t_s);
        }
        // Records of the first format have no copy of the session.
        trial.session_text = read_copy(&folder.join("session.toml"))?;
        if let Some(wearer) = &mut trial.wearer {
            wearer.text = read_copy(&folder.join(KEPT_AS))?;
        }
        run.damage
            .extend(damage::altered_files(&folder, &mut trial));
        found.push((folder, RowCounts::from_trial(&trial)));
        receiver(trial);
    }
    // If the run was cut short, the disk may hold fewer rows than the program counted.
    if !run.ending.is_incomplete() {
        run.damage
            .extend(damage::find_damage(dir, &counted, &found));
    }
    Ok(run)
}

/// Reads the description of a run from `run.json`, without its trials.
pub(super) fn read_header(dir: &Path) -> Result<Run, RecordError> {
    let path = dir.join("run.json");
    if !path.exists() {
        return Err(RecordError::Absent(dir.to_owned()));
    }
    let any: serde_json::Value = read_json(&path)?;
    let format = any["format"].as_u64().unwrap_or(1);
    if format > u64::from(FORMAT) {
        let program = any["program"]["version"].as_str().unwrap_or("?").to_owned();
        return Err(RecordError::Newer(dir.to_owned(), format, program));
    }
    read_json(&path)
}

/// Returns the folders of the trials, in their order.
pub(super) fn trial_folders(dir: &Path) -> Result<Vec<PathBuf>, RecordError> {
    let entries = std::fs::read_dir(dir).map_err(RecordError::io(dir))?;
    let mut folders: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    folders.retain(|folder| folder.join("trial.json").exists());
    folders.sort();
    Ok(folders)
}

/// Returns the text of a copy that the record keeps, such as a trial's session file. Returns an
/// empty text if the copy is missing or is not text.
fn read_copy(path: &Path) -> Result<String, RecordError> {
    match input::read_text(path, input::LONGEST_TYPED) {
        Err(why) if is_lost(&why) => Ok(String::new()),
        read => read.map_err(RecordError::io(path)),
    }
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, RecordError> {
    let text = input::read_text(path, input::LONGEST_DOCUMENT).map_err(RecordError::io(path))?;
    let read = serde_json::from_str(&text);
    read.map_err(|why| RecordError::Format(path.to_owned(), why.line(), why.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_moment_reads_back_as_it_was_written() {
        let path = std::env::temp_dir().join(format!("flexor-moments-{}", std::process::id()));
        let moment = |i| f64::from(i * 613 + 7) * 1e-6;
        let moments: Vec<f64> = (0..100_000).map(moment).collect();
        write_json(&FileSystem, &path, &moments).unwrap();
        let back: Vec<f64> = read_json(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(back, moments);
    }
}
