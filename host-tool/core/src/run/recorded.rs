//! A session as one trial of a record: its rows are on the disk as they come.

use super::{
    DeviceName, FullestPeriod, Observer, OpenError, RunError, SessionFile, begin_trial, run_taken,
};
use crate::link::Port;
use crate::record::{RecordError, Recorder, Trial};
use std::path::Path;

/// Where a trial goes: the record's folder, the position in it from 0, the name.
#[derive(Clone, Copy, Debug)]
pub struct TrialPlace<'a> {
    /// Folder of the record.
    pub dir: &'a Path,
    /// From 0.
    pub position: usize,
    /// For people.
    pub name: &'a str,
}

/// What came of a trial, complete or not.
pub struct Recorded {
    /// Everything recorded.
    pub trial: Trial,
    /// Why it ended early, if it did.
    pub error: Option<RunError>,
}

/// Why a trial could not even begin.
#[derive(Debug, thiserror::Error)]
pub enum BeginError {
    /// No device.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// No place for the record.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Runs `file` on `device` and records it at `place`; of a simulated device the
/// edges of one period, from `edges_us` after the start. `seed` decides a
/// simulated wearer's noise, `observer` sees the run.
///
/// # Errors
/// Nothing was stimulated.
pub fn record(
    place: TrialPlace<'_>,
    file: &SessionFile,
    (device, seed): (&DeviceName, u64),
    edges_us: u64,
    observer: impl Observer,
) -> Result<Recorded, BeginError> {
    let port = device.open(&file.session, seed)?;
    let (recorded, _) = record_on(place, file, port, edges_us, observer)?;
    Ok(recorded)
}

/// The same on a device that is open; gives it back, unless it was lost.
///
/// # Errors
/// No place for the record.
pub fn record_on<P: Port>(
    place: TrialPlace<'_>,
    file: &SessionFile,
    port: P,
    edges_us: u64,
    observer: impl Observer,
) -> Result<(Recorded, Option<P>), RecordError> {
    let named = Trial {
        name: place.name.to_owned(),
        ..begin_trial(file)
    };
    let mut recorder = Recorder::create(place.dir, place.position, &named)?;
    let mut fullest = FullestPeriod::new(&file.session, edges_us);
    let (outcome, port) = run_taken(file, port, Some(&mut recorder), observer, &mut fullest);
    let mut trial = Trial {
        name: named.name,
        ..outcome.trial
    };
    trial.edges = fullest.edges();
    let closed = recorder
        .edges(&trial.edges)
        .and_then(|()| recorder.finish(&trial.counters, trial.duration_s));
    let recorded = Recorded {
        trial,
        error: outcome.error.or(closed.err().map(RunError::from)),
    };
    Ok((recorded, port))
}
