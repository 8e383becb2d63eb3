//! Runs a calibration or a check at the device, for any operator.

use super::CalibrateArgs;
use super::ordered::Task;
use crate::cli::perform::SEED;
use crate::cli::{Output, interrupt, moment};
use host_core::calibration::{
    CalibrationDevice, CalibrationError, CalibrationOutcome, CalibrationResult, Drift, Operator,
    OperatorStation,
};
use host_core::link::{Error, Interruption};

/// Carries out the task.
///
/// # Errors
/// Fails if a file or the device is unusable, or if the task ends early.
pub fn run_task(
    args: &CalibrateArgs,
    task: &Task,
    interruption: &Interruption,
    operator: &mut dyn Operator,
) -> anyhow::Result<CalibrationOutcome> {
    let mut desk = OperatorStation {
        operator,
        interruption: Some(interruption.clone()),
        acknowledges: args.acknowledge,
    };
    let device = CalibrationDevice {
        device: args.device.clone(),
        wearer: args.body.unwrap_or_default(),
        seed: args.seed.unwrap_or(SEED),
        is_paced: !args.auto,
        operator: args.operator.clone(),
        at: args.at.clone(),
        now: moment::now().utc(),
    };
    match task {
        Task::Calibrate { plan, text, out } => {
            let done = device.calibrate((plan, text), out, args.resume, &mut desk);
            done.map_err(|error| map_signal_error(error, AGAIN))
        }
        Task::Check {
            file,
            wearer,
            tolerance,
        } => {
            let done = device.check((file, wearer), *tolerance, &mut desk);
            done.map_err(|error| map_signal_error(error, "check again"))
        }
    }
}

/// Advice to the user after a signal has ended a calibration.
const AGAIN: &str = "continue with --resume";

/// Turns the error of an interrupted link into [`interrupt::EndedBySignal`].
fn map_signal_error(error: CalibrationError, then: &str) -> anyhow::Error {
    match error {
        CalibrationError::Link(Error::Interrupted(signal)) => {
            let message = format!("during the calibration: the device was stopped; {then}");
            interrupt::EndedBySignal(signal, message).into()
        }
        error => error.into(),
    }
}

/// Prints the outcome.
///
/// # Errors
/// Fails if the standard output cannot be written.
pub fn print(outcome: &CalibrationOutcome, output: Output) -> anyhow::Result<()> {
    output.print(|| to_text(outcome), || outcome.to_json())
}

fn to_text(outcome: &CalibrationOutcome) -> String {
    let (file, minutes) = (outcome.file.display(), outcome.spent.t_s / 60.0);
    let summary = match &outcome.result {
        CalibrationResult::Calibrated(found) => {
            let complete = found.iter().filter(|result| result.is_complete()).count();
            let total = found.len();
            let left = match &*outcome.left_out {
                "" => String::new(),
                left => format!(" ({left})"),
            };
            format!("{complete} of {total} electrodes are in {file}{left}")
        }
        CalibrationResult::Checked(drifts) => {
            let count = drifts.len();
            let notes = drifts.iter().filter(|(_, [at, own])| at != own);
            let note = |(drift, [at_hz, own_hz]): &(Drift, [f64; 2])| {
                let channel = drift.channel;
                format!("channel {channel} was checked at {at_hz} Hz; its file has {own_hz}\n")
            };
            let notes: String = notes.map(note).collect();
            format!("{notes}{count} thresholds are within tolerance; {file} now contains the check")
        }
    };
    let given = outcome.spent.given;
    let simulated = match outcome.simulated {
        true => "\nSimulated with an assumed wearer model: no evidence about people.",
        false => "",
    };
    format!("{summary}; {minutes:.1} min of device time, {given} presentations{simulated}")
}
