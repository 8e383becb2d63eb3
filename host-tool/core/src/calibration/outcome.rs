//! Whole calibrations and checks, from their files to their outcome.

use super::{
    CalibrationDevice, CalibrationError, CheckOrder, Course, Drift, ElectrodeResult, Head, Journal,
    JournalContents, Level, OnDisk, OperatorStation, Plan, ProcedureCost, Step, board_session,
    calibrate, check, check_planned_wearer, has_entries, journal_path, read,
};
use crate::wearer::{Electrode, Evidence, Wearer};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Result of a calibration or a check.
#[derive(Clone, PartialEq, Debug)]
pub struct CalibrationOutcome {
    /// Path of the wearer file.
    pub file: PathBuf,
    /// Whether the device's wearer was simulated.
    pub simulated: bool,
    /// Time and stimulation that were needed.
    pub spent: ProcedureCost,
    /// Incomplete electrodes, each with the step at which it was left out; empty if there are none.
    pub left_out: String,
    /// Results of the electrodes.
    pub result: CalibrationResult,
}

/// Results of the electrodes of a calibration or a check.
#[derive(Clone, PartialEq, Debug)]
pub enum CalibrationResult {
    /// Results of a calibration, in the order of the plan.
    Calibrated(Vec<ElectrodeResult>),
    /// Result of a check: for each channel the drift of its threshold, with the pulse rates of the
    /// check and of the wearer file, Hz.
    Checked(Vec<(Drift, [f64; 2])>),
}

impl CalibrationDevice {
    /// Calibrates the electrodes of `plan`, whose text is `text`, and writes the wearer file `out`
    /// and its journal. With `resumes`, continues the calibration of the journal beside `out`.
    ///
    /// # Errors
    /// A file or the device is unusable, the calibration ended early, or no electrode is complete.
    pub fn calibrate(
        &self,
        (plan, text): (&Plan, &str),
        out: &Path,
        resumes: bool,
        desk: &mut OperatorStation<'_>,
    ) -> Result<CalibrationOutcome, CalibrationError> {
        let mut head = self.head(&plan.wearer, text);
        let before = check_files(out, resumes, &head)?;
        check_planned_wearer(plan, &head, board_session(plan)?.wearer)?;
        let port = self.open(plan, &mut head)?;
        let course = Course {
            plan,
            out,
            files: &OnDisk,
            before: before.as_ref().map_or(&[], |before| &before.entries),
            head: &head,
        };
        let mut journal = Journal::open(&OnDisk, &journal_path(out), before.as_ref())?;
        let (result, spent, _) = calibrate(port, &course, &mut journal, desk);
        let found = result?;
        let left_out = incomplete_electrodes(plan, &found);
        if !found.iter().any(ElectrodeResult::is_complete) {
            let advice = "move the electrodes, or raise `ceiling` if the wearer tolerates it";
            return Err(CalibrationError::Nothing(left_out, advice));
        }
        Ok(CalibrationOutcome {
            file: out.to_owned(),
            simulated: head.simulated,
            spent,
            left_out,
            result: CalibrationResult::Calibrated(found),
        })
    }

    /// Checks whether the thresholds of `wearer`, the contents of `file`, are still right, and adds
    /// the result to the file.
    ///
    /// # Errors
    /// The file or the device is unusable, the tolerance is too large, the check ended early, or a
    /// threshold has drifted.
    pub fn check(
        &self,
        (file, wearer): (&Path, &Wearer),
        tolerance: Level,
        desk: &mut OperatorStation<'_>,
    ) -> Result<CalibrationOutcome, CalibrationError> {
        let is_loose = |electrode: &&Electrode| electrode.motor_threshold.get() <= 2 * tolerance.0;
        if let Some(electrode) = wearer.electrodes.iter().find(is_loose) {
            let threshold = Level(electrode.motor_threshold.get());
            return Err(CalibrationError::Loose(
                tolerance,
                electrode.channel,
                threshold,
            ));
        }
        let mut head = self.head(&wearer.name, "");
        let plan = Plan::from_wearer(wearer)?;
        check_planned_wearer(&plan, &head, board_session(&plan)?.wearer)?;
        let port = self.open(&plan, &mut head)?;
        let order = CheckOrder {
            file,
            tolerance,
            head: &head,
        };
        if (wearer.evidence == Evidence::Measured) == head.simulated {
            let whose = match head.simulated {
                true => "simulated",
                false => "a person",
            };
            let (file, word) = (file.to_owned(), wearer.evidence.word());
            return Err(CalibrationError::Another(file, word, whose));
        }
        let (result, drifts, spent) = check(port, wearer, &order, &mut Journal::discarding(), desk);
        result?;
        let pairs = plan.electrodes.iter().zip(&wearer.electrodes);
        let rates = pairs.map(|(planned, own)| [planned.frequency_hz, own.frequency_hz]);
        Ok(CalibrationOutcome {
            file: file.to_owned(),
            simulated: head.simulated,
            spent,
            left_out: String::new(),
            result: CalibrationResult::Checked(drifts.into_iter().zip(rates).collect()),
        })
    }
}

/// Checks the files before any device is opened, and reads the journal that is continued.
fn check_files(
    out: &Path,
    resumes: bool,
    head: &Head,
) -> Result<Option<JournalContents>, CalibrationError> {
    let journal = journal_path(out);
    if resumes {
        let before = read(&journal)?;
        before.head.check_continuation(&journal, head)?;
        if out.exists() {
            check_owner(out, &head.wearer)?;
        }
        return Ok(Some(before));
    }
    let unusable = |why| CalibrationError::Closed(journal.clone(), why);
    if has_entries(&journal).map_err(unusable)? {
        return Err(CalibrationError::Taken(journal));
    }
    match out.exists() {
        true => Err(CalibrationError::Taken(out.to_owned())),
        false => Ok(None),
    }
}

/// Checks that the existing wearer file belongs to `name`.
fn check_owner(out: &Path, name: &str) -> Result<(), CalibrationError> {
    let unusable = |why: String| CalibrationError::NotResumable(out.to_owned(), why);
    let old = Wearer::read(out).map_err(|error| unusable(error.lines()))?;
    match old.name == name {
        true => Ok(()),
        false => Err(unusable(format!(
            "it is the file of wearer {}, but the plan is for {name}; give --out of {name}",
            old.name
        ))),
    }
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

impl CalibrationOutcome {
    /// Returns the outcome as a JSON object.
    #[must_use]
    pub fn to_json(&self) -> Value {
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
