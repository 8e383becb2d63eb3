//! Whole sessions: checked, run once or for many seeds, and their edges.

use crate::convert::to_text;
use crate::errors;
use crate::record::{EdgeArrays, Record, edge_arrays};
use crate::supervise::{Raised, supervise};
use host_core::choice::resolve_auto_models;
use host_core::clock::Moment;
use host_core::drive::TrialLog;
use host_core::link::Interruption;
use host_core::record::Edge;
use host_core::run::{
    Attachments, DeviceName, FullestPeriod, Observation, Observer, OpenError, SessionFile, Stepper,
    edges_between, edges_of_one_period, run_with_outputs,
};
use host_core::session::{SHIPPED, Session, SessionError, WearerTexts, builtin_wearer_text};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Session as Python gives it: a path or the name of a shipped session, or fields.
#[derive(FromPyObject)]
pub enum SessionArgument<'py> {
    /// Path or name.
    Path(PathBuf),
    /// Fields of a session file.
    Fields(Bound<'py, PyDict>),
}

/// Name in messages of a session that a program composed.
const COMPOSED: &str = "the session of this program";

/// Reads and checks a session.
///
/// # Errors
/// `Refused`, with all mistakes.
pub fn read(py: Python<'_>, given: &SessionArgument<'_>) -> PyResult<SessionFile> {
    let file = match given {
        SessionArgument::Path(path) => SessionFile::load(path),
        SessionArgument::Fields(fields) => {
            SessionFile::parse_with_wearers(COMPOSED, &to_text(fields)?, WEARERS)
        }
    };
    file.map_err(|error| errors::of_session(py, &error))
}

/// Wearer files of a composed session: relative to the present folder, or shipped ones.
const WEARERS: WearerTexts<'static> = &|file: &str| -> Result<String, SessionError> {
    match Path::new(file).exists() {
        true => Session::wearer_text(Path::new(COMPOSED), file),
        false => builtin_wearer_text(file).or_else(|_| {
            let named = format!("{file}.toml");
            builtin_wearer_text(&named).or_else(|_| Session::wearer_text(Path::new(COMPOSED), file))
        }),
    }
};

/// Checks a session and returns its text and the notes on it.
///
/// # Errors
/// `Refused`, with all mistakes.
#[pyfunction]
pub fn check(py: Python<'_>, session: SessionArgument<'_>) -> PyResult<(String, Vec<String>)> {
    let file = read(py, &session)?;
    Ok((file.text, file.session.notes))
}

/// Runs a session on the native simulator and returns its record. `out` is the folder in which the
/// record is written.
///
/// # Errors
/// `Refused`, `DeviceFault` and the other exceptions of the package.
#[pyfunction]
#[pyo3(signature = (session, seed, out=None, all_edges=false))]
pub fn run(
    py: Python<'_>,
    session: SessionArgument<'_>,
    seed: u64,
    out: Option<PathBuf>,
    all_edges: bool,
) -> PyResult<Record> {
    let mut file = read(py, &session)?;
    let settled = py.detach(|| resolve_auto_models(&mut file.session));
    settled.map_err(|error| errors::of_message(py, "refused", &error))?;
    let log = match &out {
        Some(dir) => {
            let device = DeviceName::Native.to_string();
            let title = file.session.title.clone();
            let log = TrialLog::begin(dir, &title, "run", (&device, Some(seed)), now());
            Some(log.map_err(|error| errors::of_message(py, "error", &error))?)
        }
        None => None,
    };
    let played = play(py, &file, seed, log, all_edges)?;
    Ok(Record::new(played.0, out, played.1))
}

type FinishedTrial = (host_core::record::Trial, Option<String>);

/// Length of a step between two looks for signals, µs of simulated time.
const SLICE_US: u64 = 1_000_000;

fn play(
    py: Python<'_>,
    file: &SessionFile,
    seed: u64,
    mut log: Option<TrialLog>,
    all_edges: bool,
) -> PyResult<FinishedTrial> {
    let error = |error: &dyn std::fmt::Display| errors::of_message(py, "error", &error.to_string());
    let port = DeviceName::Native
        .open(&file.session, seed)
        .map_err(|e| errors::of_open(py, &e))?;
    let recorder = match &mut log {
        Some(log) => {
            let recorder = log.begin_trial(0, file).map_err(|e| error(&e))?;
            Some(Box::new(Box::new(recorder)) as _)
        }
        None => None,
    };
    let attached = Attachments {
        recorder,
        ..Attachments::default()
    };
    let opened = Stepper::open(file, port, attached).map_err(Into::into);
    let mut stepper = opened.map_err(|e| errors::of_drive(py, &e, false))?;
    let mut interrupted = None;
    let ran = py.detach(|| {
        stepper.configure()?;
        stepper.arm()?;
        stepper.start()
    });
    let ran = ran.and_then(|()| {
        let mut to_us = 0;
        loop {
            to_us += SLICE_US;
            let ended = py.detach(|| stepper.step(host_core::run::StepLimit::Time(to_us)))?;
            if let Err(signal) = py.check_signals() {
                interrupted = Some(signal);
                return Ok(());
            }
            if ended == host_core::run::StepEnd::Over {
                return Ok(());
            }
        }
    });
    let played_us = stepper.time_us();
    let (outcome, mut port, attached) = stepper.close_keeping_attachments(ran);
    let mut trial = outcome.trial;
    if let Some(signal) = &interrupted {
        trial.duration_s = played_us as f64 / 1e6;
        if let Some(log) = &mut log {
            log.note_early_end(&errors::ended_by(py, signal));
        }
    }
    if let (Some(epoch_us), Some(world)) = (outcome.epoch_us, port.world()) {
        let trace = &world.recorder.trace;
        trial.edges = match all_edges {
            true => edges_between(trace, epoch_us, u64::MAX),
            false => {
                let after_us = file.session.duration_us / 2;
                edges_of_one_period(&file.session, trace, epoch_us, after_us)
            }
        };
    }
    if let Some(mut recorder) = attached.recorder {
        recorder
            .record_edges(&trial.edges)
            .and_then(|()| recorder.finish(&trial.counters, trial.duration_s))
            .map_err(|e| error(&e))?;
    }
    if let Some(mut log) = log {
        log.end_trial(&trial, outcome.error.as_ref())
            .and_then(|()| log.close())
            .map_err(|e| error(&e))?;
    }
    if let Some(signal) = interrupted {
        return Err(signal);
    }
    let reason = outcome.error.as_ref().map(ToString::to_string);
    Ok((trial, reason))
}

/// Runs a session once per seed, on all cores, and returns one record per seed.
///
/// # Errors
/// As [`run`].
#[pyfunction]
pub fn run_many(
    py: Python<'_>,
    session: SessionArgument<'_>,
    seeds: Vec<u64>,
) -> PyResult<Vec<Record>> {
    let mut file = read(py, &session)?;
    let settled = py.detach(|| resolve_auto_models(&mut file.session));
    settled.map_err(|error| errors::of_message(py, "refused", &error))?;
    let raised = Raised::default();
    let interruption = raised.interruption();
    let (next, cores) = (AtomicUsize::new(0), std::thread::available_parallelism());
    let cores = cores.map_or(1, usize::from).min(seeds.len());
    let work = || {
        let mut played = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(seed) = seeds.get(index) else {
                return played;
            };
            if interruption.received_signal().is_some() {
                return played;
            }
            played.push((index, play_quietly(&file, *seed, &interruption)));
        }
    };
    // Threads of this call: those of a pool would not exist in a forked process.
    let mut played = supervise(py, &raised, None, || {
        std::thread::scope(|scope| {
            let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
            let played = workers.into_iter().flat_map(|worker| match worker.join() {
                Ok(played) => played,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            played.collect::<Vec<_>>()
        })
    })?;
    played.sort_unstable_by_key(|(index, _)| *index);
    let records = played.into_iter().map(|(_, trial)| match trial {
        Ok((trial, error)) => Ok(Record::new(trial, None, error)),
        Err(error) => Err(errors::of_open(py, &error)),
    });
    records.collect()
}

/// Observer of a run that only a signal interests.
struct Interruptible(Interruption);

impl Observer for Interruptible {
    fn observe(&mut self, _seen: Observation<'_>) {}

    fn interruption(&self) -> Option<Interruption> {
        Some(self.0.clone())
    }
}

fn play_quietly(
    file: &SessionFile,
    seed: u64,
    interruption: &Interruption,
) -> Result<FinishedTrial, OpenError> {
    let port = DeviceName::Native.open(&file.session, seed)?;
    let mut fullest = FullestPeriod::new(&file.session, file.session.duration_us / 2);
    let observer = Interruptible(interruption.clone());
    let (outcome, _) = run_with_outputs(file, port, None, observer, &mut fullest);
    let mut trial = outcome.trial;
    trial.edges = fullest.into_edges();
    Ok((trial, outcome.error.map(|error| error.to_string())))
}

/// Returns the edges of the first `seconds` of a session, as `flexor edges` writes them.
///
/// # Errors
/// As [`run`].
#[pyfunction]
pub fn edges<'py>(
    py: Python<'py>,
    session: SessionArgument<'py>,
    seconds: f64,
    seed: u64,
) -> PyResult<EdgeArrays<'py>> {
    let mut file = read(py, &session)?;
    let settled = py.detach(|| resolve_auto_models(&mut file.session));
    settled.map_err(|error| errors::of_message(py, "refused", &error))?;
    let length_us = (seconds * 1e6).round() as u64; // at most an hour: checked in Python
    file.session.duration_us = length_us;
    let (trial, error) = play(py, &file, seed, None, true)?;
    if let Some(error) = error {
        return Err(errors::of_message(py, "fault", &error));
    }
    let within: Vec<Edge> = trial
        .edges
        .into_iter()
        .filter(|e| e.t_us < length_us)
        .collect();
    Ok(edge_arrays(py, &within))
}

/// Text of a session file at a path, or of a shipped one.
///
/// # Errors
/// `Refused`: there is no such file.
#[pyfunction]
pub fn session_text(py: Python<'_>, name: PathBuf) -> PyResult<String> {
    Session::text(&name).map_err(|error| errors::of_session(py, &error))
}

/// Text of a wearer file at a path, or of a shipped one.
///
/// # Errors
/// `Refused`: there is no such file.
#[pyfunction]
pub fn wearer_text(py: Python<'_>, name: &str) -> PyResult<String> {
    WEARERS(name).map_err(|error| errors::of_session(py, &error))
}

/// Names of the shipped sessions.
#[pyfunction]
pub fn sessions() -> Vec<String> {
    let names = SHIPPED
        .iter()
        .map(|(name, _)| name.trim_end_matches(".toml"));
    names.map(str::to_owned).collect()
}

/// Names of the shipped wearers.
#[pyfunction]
pub fn wearers() -> Vec<String> {
    let names = host_core::wearer::SHIPPED.iter();
    names
        .map(|(name, _)| name.trim_end_matches(".toml").to_owned())
        .collect()
}

/// Returns the present time of day, in UTC.
pub fn now() -> Moment {
    let since_1970 = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Moment {
        since_1970,
        local_offset_s: 0,
    }
}
