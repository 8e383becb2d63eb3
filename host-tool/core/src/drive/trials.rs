//! The record of a drive: a folder with one trial for each cycle from arming to the stop.

use crate::clock::Moment;
use crate::record::{
    Ending, Place, Plan, RecordError, Recorder, Run, Trial, write_header, write_run,
};
use crate::run::{RunError, SessionFile, begin_trial};
use std::path::Path;

/// Record that is on disk while the drive runs. Until it is closed it says that it is incomplete.
pub struct TrialLog {
    place: Place,
    run: Run,
    /// First error of a trial.
    cut_short: Option<String>,
}

impl TrialLog {
    /// Begins a record in the folder `dir`, which must be absent or empty. `title` is its heading,
    /// `command` names the kind of program that drives the device, and `device` and `seed` say
    /// which device it is.
    ///
    /// # Errors
    /// The folder holds something else, or cannot be written.
    pub fn begin(
        dir: &Path,
        title: &str,
        command: &str,
        (device, seed): (&str, Option<u64>),
        now: Moment,
    ) -> Result<Self, RecordError> {
        let place = Place::claim(dir, false)?;
        let run = Run::begin(title, device, seed, Plan::new(command, device), now);
        write_run(place.dir(), &run)?;
        Ok(Self {
            place,
            run,
            cut_short: None,
        })
    }

    /// Returns the folder of the record.
    #[must_use]
    pub fn dir(&self) -> &Path {
        self.place.dir()
    }

    /// Begins the trial at `position` (from 0) with the session of `file`.
    pub fn begin_trial(
        &mut self,
        position: usize,
        file: &SessionFile,
    ) -> Result<Recorder, RecordError> {
        Recorder::create(self.place.dir(), position, &begin_trial(file))
    }

    /// Adds a complete trial, which ended with `error` if there was one.
    pub fn end_trial(
        &mut self,
        trial: &Trial,
        error: Option<&RunError>,
    ) -> Result<(), RecordError> {
        self.run.trials.push(trial.clone());
        if let Some(error) = error {
            self.note_early_end(&error.to_string());
        }
        write_header(self.place.dir(), &self.run)
    }

    /// Notes why a trial ended early. The first reason is that of the record.
    pub fn note_early_end(&mut self, reason: &str) {
        self.cut_short.get_or_insert_with(|| reason.to_owned());
    }

    /// Completes the record with its summary and, if this program can draw, its page.
    pub fn close(mut self) -> Result<(), RecordError> {
        self.run.ending = match self.cut_short.take() {
            Some(reason) => Ending::cut_short(reason, 1),
            None => Ending::complete(),
        };
        self.write_summary()
    }

    #[cfg(feature = "report")]
    fn write_summary(&self) -> Result<(), RecordError> {
        use crate::report::{Report, write};
        write(self.place.dir(), &Report::from_run(&self.run)).map(drop)
    }

    #[cfg(not(feature = "report"))]
    fn write_summary(&self) -> Result<(), RecordError> {
        use crate::record::FileSystem;
        crate::record::write_summary(&FileSystem, self.place.dir(), &self.run.ending)
    }
}
