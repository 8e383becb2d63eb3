//! Handles SIGINT, SIGTERM and SIGHUP: the first ends the program in order, the second at once.

use anyhow::Context;
use host_core::link::{Interruption, Signal};
use host_core::record::{Ending, RecordError, Run, write_header};
use host_core::report::{self, Report};
use host_core::run::RunError;
use signal_hook::flag;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Error of a command that a signal ended in order, and for which no run reports more: the signal,
/// and in words when it came and what followed.
#[derive(Debug, thiserror::Error)]
#[error("E580 {0} came {1}")]
pub struct EndedBySignal(pub Signal, pub String);

/// Catches signals from now on: the first only requests an end, so that stimulation stops in order;
/// the second ends the program at once with its own exit code. Call this only when there is
/// something to stop; until then a signal ends the program by itself.
///
/// # Errors
/// Fails if the system does not allow a signal to be handled.
pub fn catch_signals() -> anyhow::Result<Interruption> {
    let interruption = Interruption::default();
    let has_come = Arc::new(AtomicBool::new(false));
    for signal in supported_signals() {
        let number = i32::from(signal.number());
        // The order matters: at the first signal, the shutdown handler must find the flag unset.
        register_shutdown(signal, &has_come)
            .and_then(|()| flag::register(number, Arc::clone(&has_come)).map(drop))
            .and_then(|()| {
                let asked = signal.number().into();
                flag::register_usize(number, interruption.number(), asked).map(drop)
            })
            .with_context(|| no_handler(signal))?;
    }
    Ok(interruption)
}

/// Makes every signal end the program at once from now on. For commands that neither stimulate nor
/// record.
///
/// # Errors
/// Returns the errors of [`catch_signals`].
pub fn end_at_once() -> anyhow::Result<()> {
    let always = Arc::new(AtomicBool::new(true));
    for signal in supported_signals() {
        register_shutdown(signal, &always).with_context(|| no_handler(signal))?;
    }
    Ok(())
}

/// Returns the message for a signal that the system does not allow to be handled.
fn no_handler(signal: impl std::fmt::Display) -> String {
    format!(
        "E581 the handler for {signal} cannot be installed, so the command did not start; run it \
         where signal handlers are allowed"
    )
}

fn register_shutdown(signal: Signal, condition: &Arc<AtomicBool>) -> std::io::Result<()> {
    let (number, code) = (i32::from(signal.number()), i32::from(signal.exit_code()));
    flag::register_conditional_shutdown(number, code, Arc::clone(condition)).map(drop)
}

/// From now on, writing beyond the size limit of files (SIGXFSZ) fails with an error, instead of
/// ending the program without a message.
///
/// # Errors
/// Returns the errors of [`catch_signals`].
#[cfg(unix)]
pub fn ignore_file_size_signal() -> anyhow::Result<()> {
    let unread = Arc::new(AtomicBool::new(false));
    let registered = flag::register(signal_hook::consts::SIGXFSZ, unread);
    let signal = "SIGXFSZ";
    registered.map(drop).with_context(|| no_handler(signal))
}

/// Returns the signals that this system has.
fn supported_signals() -> impl Iterator<Item = Signal> {
    let has = |signal: &Signal| cfg!(unix) || *signal != Signal::HangUp;
    Signal::ALL.into_iter().filter(has)
}

/// Returns the signal that ended a command, if one did.
pub fn ending_signal(error: &anyhow::Error) -> Option<Signal> {
    error.chain().find_map(|error| {
        if let Some(EndedBySignal(signal, _)) = error.downcast_ref() {
            return Some(*signal);
        }
        match error.downcast_ref() {
            Some(RunError::Signal { signal, .. }) => Some(*signal),
            _ => None,
        }
    })
}

/// Checks whether something ended a command early: one of its runs, or a signal after the last run.
///
/// # Errors
/// Returns the error of the run or the signal.
pub fn check_interrupted(
    cut_short: Option<RunError>,
    interruption: &Interruption,
) -> anyhow::Result<()> {
    match (cut_short, interruption.received_signal()) {
        (Some(error), _) => Err(error.into()),
        (None, Some(signal)) => {
            let when = "after the last stimulation; the results were not computed".to_owned();
            Err(EndedBySignal(signal, when).into())
        }
        (None, None) => Ok(()),
    }
}

/// Closes the record of `run` with its ending and writes its page. If only the page of a complete
/// run is lost, `summary.json` records that.
///
/// # Errors
/// Returns the file that could not be written.
pub fn close_record(dir: &Path, run: &mut Run) -> Result<PathBuf, RecordError> {
    run.decode_ahead();
    report::write(dir, &Report::from_run(run)).inspect_err(|lost| {
        if run.ending == Ending::complete() {
            run.ending = Ending::complete_with_loss(lost.to_string());
            // The summary is written first; only the page is lost again.
            let _ = report::write(dir, &Report::from_run(run));
        }
    })
}

/// Marks the record of a run that `error` cut short, writes its page and prints its path. Returns
/// the error of the command.
pub fn close_failed_record(dir: &Path, mut run: Run, error: anyhow::Error) -> anyhow::Error {
    run.ending = Ending::cut_short(format!("{error:#}"), super::exit_code(&error));
    run.decode_ahead();
    let written = write_header(dir, &run);
    let written = report::write(dir, &Report::from_run(&run)).and(written);
    if let Err(lost) = written {
        eprintln!("error: {lost}");
    }
    super::print_record_place(dir);
    error
}
