//! Runs a session as one trial of a record, whose rows are written to disk as they arrive.

use super::{
    DeviceName, FullestPeriod, Observer, OpenError, RunError, SessionFile, begin_trial,
    run_with_outputs,
};
use crate::link::Port;
use crate::record::{RecordError, Recorder, Trial};
use std::path::Path;

/// Where a trial is recorded: the folder of the record, the trial's position in it, and its name.
#[derive(Clone, Copy, Debug)]
pub struct TrialPlace<'a> {
    /// Folder of the record.
    pub dir: &'a Path,
    /// Position of the trial in the record, counted from 0.
    pub position: usize,
    /// Name of the trial, shown to people.
    pub name: &'a str,
}

/// Result of a recorded trial, whether or not it ran to its end.
pub struct RecordedTrial {
    /// Rows, events and counters that were recorded until the end of the trial.
    pub trial: Trial,
    /// Reason why the trial ended early; `None` if it ran to its end.
    pub error: Option<RunError>,
}

/// Reason why a trial could not begin. Nothing was stimulated.
#[derive(Debug, thiserror::Error)]
pub enum BeginError {
    /// The device could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The record could not be created.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Runs the session of `file` on a device and records it at `place`. For a simulated device, it
/// also records the edges of one period that begins at least `edges_us` after the start of the
/// trains. `seed` determines the noise of a simulated wearer. `observer` is informed of everything
/// that happens in the run.
///
/// # Errors
/// The device could not be opened or the record could not be created, so nothing was stimulated.
pub fn record(
    place: TrialPlace<'_>,
    file: &SessionFile,
    (device, seed): (&DeviceName, u64),
    edges_us: u64,
    observer: impl Observer + Send,
) -> Result<RecordedTrial, BeginError> {
    let port = device.open(&file.session, seed)?;
    let (recorded, _) = record_on(place, file, port, edges_us, observer)?;
    Ok(recorded)
}

/// Runs and records a session as [`record`] does, on a device whose port is already open. Returns
/// the port again, unless the connection was lost.
///
/// # Errors
/// The record could not be created.
pub fn record_on<P: Port>(
    place: TrialPlace<'_>,
    file: &SessionFile,
    port: P,
    edges_us: u64,
    observer: impl Observer + Send,
) -> Result<(RecordedTrial, Option<P>), RecordError> {
    let named = Trial {
        name: place.name.to_owned(),
        ..begin_trial(file)
    };
    let mut recorder = Recorder::create(place.dir, place.position, &named)?;
    let mut fullest = FullestPeriod::new(&file.session, edges_us);
    let (outcome, port) = run_with_outputs(file, port, Some(&mut recorder), observer, &mut fullest);
    let mut trial = Trial {
        name: named.name,
        ..outcome.trial
    };
    trial.edges = fullest.into_edges();
    let closed = recorder
        .record_edges(&trial.edges)
        .and_then(|()| recorder.finish(&trial.counters, trial.duration_s));
    let recorded = RecordedTrial {
        trial,
        error: outcome.error.or(closed.err().map(RunError::from)),
    };
    Ok((recorded, port))
}
