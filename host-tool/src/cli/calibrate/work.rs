//! Runs a calibration or a check at the device, for any operator.

use super::CalibrateArgs;
use super::begin::{self, OpenedJournal};
use super::ordered::Task;
use crate::cli::{Output, interrupt};
use host_core::calibration::{
    CalibrationError, CheckOrder, Course, Drift, ElectrodeResult, Journal, Level, OnDisk, Operator,
    OperatorStation, Plan, ProcedureCost, Step, board_session, calibrate, check,
    check_planned_wearer,
};
use host_core::link::{Error, Interruption};
use host_core::wearer::{Electrode, Evidence, Wearer};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Result of a calibration or a check.
pub struct CalibrationOutcome {
    file: PathBuf,
    simulated: bool,
    spent: ProcedureCost,
    /// Incomplete electrodes, each with the step at which it was left out; empty if there are none.
    left_out: String,
    result: CalibrationResult,
}

enum CalibrationResult {
    Calibrated(Vec<ElectrodeResult>),
    /// Result of a check: for each channel the drift of its threshold, with the pulse rates of the
    /// check and of the wearer file, Hz.
    Checked(Vec<(Drift, [f64; 2])>),
}

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
    match task {
        Task::Calibrate { plan, text, out } => run_calibration(args, (plan, text, out), &mut desk),
        Task::Check {
            file,
            wearer,
            tolerance,
        } => run_check(args, file, wearer, *tolerance, &mut desk),
    }
}

fn run_calibration(
    args: &CalibrateArgs,
    (plan, text, out): (&Plan, &str, &Path),
    desk: &mut OperatorStation<'_>,
) -> anyhow::Result<CalibrationOutcome> {
    let mut head = begin::journal_head(args, &plan.wearer, text);
    let OpenedJournal { journal, kept } = begin::check_files(args, out, &head)?;
    check_planned_wearer(plan, &head, board_session(plan)?.wearer)?;
    let port = begin::open_device(args, plan, &mut head)?;
    let course = Course {
        plan,
        out,
        files: &OnDisk,
        before: kept.as_ref().map_or(&[], |kept| &kept.entries),
        head: &head,
    };
    let mut journal = Journal::open(&OnDisk, &journal, kept.as_ref())?;
    let (result, spent, _) = calibrate(port, &course, &mut journal, desk);
    let found = result.map_err(|error| map_signal_error(error, AGAIN))?;
    if !found.iter().any(ElectrodeResult::is_complete) {
        let advice = "move the electrodes, or raise `ceiling` if the wearer tolerates it";
        return Err(CalibrationError::Nothing(incomplete_electrodes(plan, &found), advice).into());
    }
    Ok(CalibrationOutcome {
        file: out.to_owned(),
        simulated: head.simulated,
        spent,
        left_out: incomplete_electrodes(plan, &found),
        result: CalibrationResult::Calibrated(found),
    })
}

fn run_check(
    args: &CalibrateArgs,
    file: &Path,
    wearer: &Wearer,
    tolerance: Level,
    desk: &mut OperatorStation<'_>,
) -> anyhow::Result<CalibrationOutcome> {
    let loose =
        |electrode: &&Electrode| Level(electrode.motor_threshold.get()).0 <= 2 * tolerance.0;
    if let Some(electrode) = wearer.electrodes.iter().find(loose) {
        let threshold = Level(electrode.motor_threshold.get());
        return Err(CalibrationError::Loose(tolerance, electrode.channel, threshold).into());
    }
    let mut head = begin::journal_head(args, &wearer.name, "");
    let plan = Plan::from_wearer(wearer)?;
    let port = begin::open_device(args, &plan, &mut head)?;
    let checked = CheckOrder {
        file,
        tolerance,
        head: &head,
    };
    let (is_person, is_simulated) = (wearer.evidence == Evidence::Measured, head.simulated);
    if is_person == is_simulated {
        let whose = if is_simulated {
            "simulated"
        } else {
            "a person"
        };
        let (file, word) = (file.to_owned(), wearer.evidence.word());
        return Err(CalibrationError::Another(file, word, whose).into());
    }
    let (result, drifts, spent) = check(port, wearer, &checked, &mut Journal::discarding(), desk);
    result.map_err(|error| map_signal_error(error, "check again"))?;
    let pairs = plan.electrodes.iter().zip(&wearer.electrodes);
    let rates = pairs.map(|(planned, electrode)| [planned.frequency_hz, electrode.frequency_hz]);
    Ok(CalibrationOutcome {
        file: file.to_owned(),
        simulated: head.simulated,
        spent,
        left_out: String::new(),
        result: CalibrationResult::Checked(
            drifts.into_iter().zip(rates.collect::<Vec<_>>()).collect(),
        ),
    })
}

/// Lists the incomplete electrodes, each with the step at which it was left out.
fn incomplete_electrodes(plan: &Plan, found: &[ElectrodeResult]) -> String {
    let left = plan.electrodes.iter().zip(found);
    let left = left.filter(|(_, found)| !found.is_complete());
    let left = left.map(|(planned, found)| {
        let step = found.first_missing_step().map_or("", Step::name);
        format!("channel {} was left out at {step}", planned.channel)
    });
    left.collect::<Vec<_>>().join(", ")
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

impl CalibrationOutcome {
    /// Prints the outcome.
    ///
    /// # Errors
    /// Fails if the standard output cannot be written.
    pub fn print(&self, output: Output) -> anyhow::Result<()> {
        output.print(|| self.to_text(), || self.to_json())
    }

    fn to_text(&self) -> String {
        let (file, minutes) = (self.file.display(), self.spent.t_s / 60.0);
        let summary = match &self.result {
            CalibrationResult::Calibrated(found) => {
                let complete = found.iter().filter(|result| result.is_complete()).count();
                let total = found.len();
                let left = match &*self.left_out {
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
                format!(
                    "{notes}{count} thresholds are within tolerance; {file} now contains the check"
                )
            }
        };
        let given = self.spent.given;
        let simulated = match self.simulated {
            true => "\nSimulated with an assumed wearer model: no evidence about people.",
            false => "",
        };
        format!("{summary}; {minutes:.1} min of device time, {given} presentations{simulated}")
    }

    fn to_json(&self) -> Value {
        let mut report = json!({
            "event": "done", "file": self.file, "device_s": self.spent.t_s,
            "presentations": self.spent.given, "simulated": self.simulated, "error": null,
        });
        match &self.result {
            CalibrationResult::Calibrated(found) => {
                let complete = found.iter().filter(|result| result.is_complete()).count();
                report["electrodes"] = complete.into();
                report["of"] = found.len().into();
                report["found"] = json!(found);
            }
            CalibrationResult::Checked(drifts) => {
                report["checks"] = drifts.iter().map(drift_json).collect();
            }
        }
        report
    }
}

fn drift_json((drift, [at_hz, _]): &(Drift, [f64; 2])) -> Value {
    let milli = |value: u32| f64::from(value) / 1e3;
    json!({
        "channel": drift.channel, "unit": drift.unit.symbol(), "accepted": drift.accepted,
        "frequency_hz": at_hz, "expected": milli(drift.expected.get()),
        "found": drift.found.map(|found| milli(found.get())),
    })
}
