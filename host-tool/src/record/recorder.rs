//! Keeps a trial on disk while it runs.

use super::folder::write_json;
use super::{ClockFit, Edge, Identity, RecordError, Sample, Trial, columns, table, trial_folder};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Rows wait in memory no longer than this, so that a killed program loses at most so much.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// Appends the rows of one trial to its folder and hands them to the operating
/// system at least once a second of arriving rows. What was recorded survives
/// an unplugged device, an error and a killed program; not a power cut, since
/// the disk is not forced. Dropping it keeps all rows.
pub struct Recorder {
    folder: PathBuf,
    trial: Trial,
    samples: BufWriter<File>,
    flushed: Instant,
}

impl Recorder {
    /// Begins trial `position` (from 0) of the run in `dir`. Name, channels and
    /// window of `trial` are written at once, rows that it already holds as well.
    pub fn create(dir: &Path, position: usize, trial: &Trial) -> Result<Self, RecordError> {
        let folder = trial_folder(dir, position, &trial.name);
        std::fs::create_dir_all(&folder).map_err(RecordError::io(&folder))?;
        let path = folder.join("samples.csv");
        let file = File::create(&path).map_err(RecordError::io(&path))?;
        let mut recorder = Recorder {
            folder,
            trial: Trial {
                samples: Vec::new(),
                edges: Vec::new(),
                ..trial.clone()
            },
            samples: BufWriter::new(file),
            flushed: Instant::now(),
        };
        recorder.describe()?;
        recorder.accompany(trial)?;
        table::write_sample_header(&mut recorder.samples, &trial.channels)
            .map_err(RecordError::io(&path))?;
        recorder.edges(&trial.edges)?;
        trial.samples.iter().try_for_each(|s| recorder.sample(s))?;
        Ok(recorder)
    }

    /// Appends a sample.
    pub fn sample(&mut self, sample: &Sample) -> Result<(), RecordError> {
        let written = self.append(sample);
        written.map_err(RecordError::io(&self.folder.join("samples.csv")))
    }

    fn append(&mut self, sample: &Sample) -> std::io::Result<()> {
        let channels = &self.trial.channels;
        table::write_sample(&mut self.samples, sample, channels)?;
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.samples.flush()?;
            self.flushed = Instant::now();
        }
        Ok(())
    }

    /// Replaces `edges.csv` by these edges of one period.
    pub fn edges(&mut self, edges: &[Edge]) -> Result<(), RecordError> {
        let path = self.folder.join("edges.csv");
        let file = File::create(&path).map_err(RecordError::io(&path))?;
        let mut out = BufWriter::new(file);
        let written = table::write_edges(&mut out, edges).and_then(|()| out.flush());
        written.map_err(RecordError::io(&path))
    }

    /// Notes which device answered.
    pub fn identity(&mut self, identity: &Identity) -> Result<(), RecordError> {
        self.trial.identity = Some(identity.clone());
        self.describe()
    }

    /// Notes that something happened `t_s` seconds into the trial.
    pub fn event(&mut self, t_s: f64, text: &str) -> Result<(), RecordError> {
        self.trial.events.push((t_s, text.to_owned()));
        self.describe()
    }

    /// Ends the trial with its counters and its actual length, s.
    pub fn finish(
        mut self,
        counters: &[(String, u64)],
        duration_s: f64,
    ) -> Result<(), RecordError> {
        let flushed = self.samples.flush();
        flushed.map_err(RecordError::io(&self.folder.join("samples.csv")))?;
        self.trial.counters = counters.to_vec();
        self.trial.duration_s = duration_s;
        self.describe()
    }

    /// Notes how the device's clock ran.
    pub fn clock(&mut self, clock: Option<ClockFit>) {
        self.trial.clock = clock;
    }

    /// Writes what explains the rows: the session file and the dictionary of
    /// columns.
    fn accompany(&self, trial: &Trial) -> Result<(), RecordError> {
        if !trial.session_text.is_empty() {
            let path = self.folder.join("session.toml");
            std::fs::write(&path, &trial.session_text).map_err(RecordError::io(&path))?;
        }
        let path = self.folder.join("columns.csv");
        let written = columns::dictionary(&trial.channels).and_then(|it| std::fs::write(&path, it));
        written.map_err(RecordError::io(&path))
    }

    fn describe(&self) -> Result<(), RecordError> {
        write_json(&self.folder.join("trial.json"), &self.trial)
    }
}
