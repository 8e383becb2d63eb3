//! Keeps a trial on disk while it runs.

use super::disk::{replace_file_on, trial_folder, write_json};
use super::{
    ClockFit, Edge, ElectrodeReading, Identity, Marker, RecordError, Sample, Samples, Trial,
    columns, marker, table,
};
use crate::disk::{Disk, FileSystem};
use crate::session::KEPT_AS;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Number of events of a trial that are written to disk immediately; [`LATER_S`] limits the later
/// ones.
const AT_ONCE: usize = 64;
/// After the first [`AT_ONCE`] events: shortest time between two writes of the events, s of the
/// trial. Each write repeats all earlier events, so a device that reports events without end would
/// otherwise keep its host busy with the disk.
const LATER_S: f64 = 0.5;

/// Writes the rows of one trial to its folder while the trial runs, each row immediately and with a
/// single write. The rows survive an unplugged device, an error, a full disk and a killed program.
/// They may not survive a power cut, because they are not flushed to the disk itself.
pub struct Recorder {
    disk: Box<dyn Disk>,
    folder: PathBuf,
    trial: Trial,
    samples: Box<dyn Write + Send>,
    markers: Box<dyn Write + Send>,
    /// Text of the row that is being written.
    row: Vec<u8>,
    /// Time of the event at which `trial.json` was last written because of an event, s after the
    /// start.
    described_s: f64,
}

impl Recorder {
    /// Creates the folder of the trial at `position` (from 0) of the run in `dir`. Writes name,
    /// channels and window of `trial` at once, together with the rows that it already has.
    pub fn create(dir: &Path, position: usize, trial: &Trial) -> Result<Self, RecordError> {
        Self::create_on(Box::new(FileSystem), dir, position, trial)
    }

    /// Creates the folder of a trial as [`Self::create`] does, on `disk`.
    pub fn create_on(
        disk: Box<dyn Disk>,
        dir: &Path,
        position: usize,
        trial: &Trial,
    ) -> Result<Self, RecordError> {
        let folder = trial_folder(dir, position, &trial.name);
        if folder.is_symlink() {
            // The folder to which the link leads does not belong to this record.
            disk.remove(&folder).map_err(RecordError::io(&folder))?;
        }
        disk.create_folder(&folder)
            .map_err(RecordError::write(&folder))?;
        let path = folder.join("samples.csv");
        let samples = disk.create(&path).map_err(RecordError::write(&path))?;
        let markers_path = folder.join("markers.csv");
        let markers = disk.create(&markers_path);
        let markers = markers.map_err(RecordError::write(&markers_path))?;
        let mut recorder = Recorder {
            disk,
            folder,
            trial: Trial {
                samples: Samples::default(),
                edges: Vec::new(),
                markers: Vec::new(),
                ..trial.clone()
            },
            samples,
            markers,
            row: Vec::new(),
            described_s: 0.0,
        };
        recorder.write_description()?;
        recorder.write_companion_files(trial)?;
        table::push_sample_header(&mut recorder.row, &trial.channels);
        recorder.append().map_err(RecordError::write(&path))?;
        recorder.record_edges(&trial.edges)?;
        marker::write_header(&mut recorder.row)
            .and_then(|()| recorder.append_marker())
            .map_err(RecordError::write(&markers_path))?;
        trial
            .markers
            .iter()
            .try_for_each(|marker| recorder.record_marker(marker))?;
        trial
            .samples
            .iter()
            .try_for_each(|s| recorder.record_sample(&s))?;
        Ok(recorder)
    }

    /// Appends a sample to `samples.csv`.
    pub fn record_sample(&mut self, sample: &Sample) -> Result<(), RecordError> {
        table::push_sample(&mut self.row, sample, &self.trial.channels);
        self.append()
            .map_err(|source| RecordError::write(&self.folder.join("samples.csv"))(source))
    }

    /// Writes the row to `samples.csv` with a single write. A program that is killed at any time
    /// therefore leaves complete rows. Only a failure of the operating system itself can leave an
    /// incomplete row, which readers ignore because its line has no end.
    fn append(&mut self) -> std::io::Result<()> {
        let written = self.samples.write_all(&self.row);
        self.row.clear();
        written
    }

    /// Appends a marker to `markers.csv`.
    ///
    /// # Errors
    /// The marker cannot be written.
    pub fn record_marker(&mut self, marker: &Marker) -> Result<(), RecordError> {
        let written = marker::write_row(&mut self.row, marker);
        let written = written.and_then(|()| self.append_marker());
        written.map_err(|source| RecordError::write(&self.folder.join("markers.csv"))(source))
    }

    /// Writes the row to `markers.csv` with a single write, for the reason that [`Self::append`]
    /// gives.
    fn append_marker(&mut self) -> std::io::Result<()> {
        let written = self.markers.write_all(&self.row);
        self.row.clear();
        written
    }

    /// Replaces the content of `edges.csv`. `edges` are the changes of switch states in one period.
    pub fn record_edges(&mut self, edges: &[Edge]) -> Result<(), RecordError> {
        let path = self.folder.join("edges.csv");
        let mut text = Vec::new();
        table::write_edges(&mut text, edges).map_err(RecordError::write(&path))?;
        replace_file_on(&*self.disk, &path, &text)
    }

    /// Records in `trial.json` which device answered.
    pub fn record_identity(&mut self, identity: &Identity) -> Result<(), RecordError> {
        self.trial.identity = Some(identity.clone());
        self.write_description()
    }

    /// Records an event with its time, s after the start of the trial, and its description.
    pub fn record_event(&mut self, t_s: f64, text: &str) -> Result<(), RecordError> {
        self.trial.events.push((t_s, text.to_owned()));
        let is_soon = (t_s - self.described_s).abs() < LATER_S;
        if is_soon && self.trial.events.len() > AT_ONCE {
            return Ok(());
        }
        self.described_s = t_s;
        self.write_description()
    }

    /// Records a reading of the electrode check in `trial.json`.
    pub fn record_electrode(&mut self, reading: ElectrodeReading) -> Result<(), RecordError> {
        self.trial.electrode_check.push(reading);
        self.write_description()
    }

    /// Keeps the number of pulses that were output and, if there were none, the reason. They are
    /// written to disk together with the next change of `trial.json`.
    pub fn record_pulses(&mut self, pulses: Option<u64>, silent: Option<&str>) {
        self.trial.pulses = pulses;
        self.trial.silent = silent.map(str::to_owned);
    }

    /// Ends the trial: writes its counters and its actual duration, s, to `trial.json`.
    pub fn finish(
        &mut self,
        counters: &[(String, u64)],
        duration_s: f64,
    ) -> Result<(), RecordError> {
        self.trial.counters = counters.to_vec();
        self.trial.duration_s = duration_s;
        self.write_description()
    }

    /// Keeps the fit of the device's clock. It is written to disk together with the next change of
    /// `trial.json`.
    pub fn record_clock(&mut self, clock: Option<ClockFit>) {
        self.trial.clock = clock;
    }

    /// Writes the files that explain the rows: the session file, the wearer file if the session
    /// names one, and `columns.csv` with the meaning of the columns.
    fn write_companion_files(&self, trial: &Trial) -> Result<(), RecordError> {
        if !trial.session_text.is_empty() {
            self.write_companion("session.toml", trial.session_text.as_bytes())?;
        }
        if let Some(wearer) = &trial.wearer {
            self.write_companion(KEPT_AS, wearer.text.as_bytes())?;
        }
        let dictionary = columns::dictionary(&trial.channels);
        let dictionary =
            dictionary.map_err(RecordError::write(&self.folder.join("columns.csv")))?;
        self.write_companion("columns.csv", &dictionary)
    }

    fn write_companion(&self, name: &str, contents: &[u8]) -> Result<(), RecordError> {
        let path = self.folder.join(name);
        let written = (self.disk.create(&path)).and_then(|mut file| file.write_all(contents));
        written.map_err(RecordError::write(&path))
    }

    fn write_description(&mut self) -> Result<(), RecordError> {
        write_json(&*self.disk, &self.folder.join("trial.json"), &self.trial)
    }
}
