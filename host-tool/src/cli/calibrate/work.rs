//! The work at the device, whoever orders.

use super::CalibrateArgs;
use super::begin::{self, Begun};
use super::ordered::Task;
use crate::cli::{Output, interrupt};
use host_core::calibration::{
    CalibrationError, Checked, Course, Desk, Drift, Found, Journal, Level, OnDisk, Operator, Plan,
    Spent, board, calibrate, check, rehearse,
};
use host_core::link::{Error, Interruption};
use host_core::wearer::Wearer;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What came of it.
pub struct Worked {
    file: PathBuf,
    simulated: bool,
    spent: Spent,
    result: Came,
}

enum Came {
    Calibrated(Vec<Found>),
    Checked(Vec<Drift>),
}

/// Does what is ordered.
///
/// # Errors
/// What stands against it, or ended it.
pub fn work(
    args: &CalibrateArgs,
    task: &Task,
    interruption: &Interruption,
    operator: &mut dyn Operator,
) -> anyhow::Result<Worked> {
    let mut desk = Desk {
        operator,
        interruption: Some(interruption.clone()),
        acknowledges: args.acknowledge,
    };
    match task {
        Task::Calibrate { plan, text, out } => calibrated(args, (plan, text, out), &mut desk),
        Task::Check {
            file,
            wearer,
            tolerance,
        } => checked(args, file, wearer, *tolerance, &mut desk),
    }
}

fn calibrated(
    args: &CalibrateArgs,
    (plan, text, out): (&Plan, &str, &Path),
    desk: &mut Desk<'_>,
) -> anyhow::Result<Worked> {
    let mut head = begin::head(args, &plan.wearer, text);
    let Begun { journal, entries } = begin::files(args, out, &head)?;
    rehearse(plan, &head, board(plan)?.wearer)?;
    let port = begin::open(args, plan, &mut head)?;
    let course = Course {
        plan,
        out,
        files: &OnDisk,
        before: &entries,
        head: &head,
    };
    let mut journal = Journal::open(&OnDisk, &journal, entries.len())?;
    let (result, spent, _) = calibrate(port, &course, &mut journal, desk);
    Ok(Worked {
        file: out.to_owned(),
        simulated: head.simulated,
        spent,
        result: Came::Calibrated(result.map_err(|error| told(error, AGAIN))?),
    })
}

fn checked(
    args: &CalibrateArgs,
    file: &Path,
    wearer: &Wearer,
    tolerance: Level,
    desk: &mut Desk<'_>,
) -> anyhow::Result<Worked> {
    let mut head = begin::head(args, &wearer.name, "");
    let port = begin::open(args, &Plan::of(wearer)?, &mut head)?;
    let checked = Checked {
        file,
        tolerance,
        head: &head,
    };
    let (result, drifts, spent) = check(port, wearer, &checked, &mut Journal::nowhere(), desk);
    result.map_err(|error| told(error, "check again"))?;
    Ok(Worked {
        file: file.to_owned(),
        simulated: head.simulated,
        spent,
        result: Came::Checked(drifts),
    })
}

/// What to do after a signal.
const AGAIN: &str = "go on with --resume";

/// What a signal did is told as such.
fn told(error: CalibrationError, then: &str) -> anyhow::Error {
    match error {
        CalibrationError::Link(Error::Interrupted(signal)) => {
            let what = format!("during the calibration: the device was stopped; {then}");
            interrupt::Ended(signal, what).into()
        }
        error => error.into(),
    }
}

impl Worked {
    /// Says it.
    ///
    /// # Errors
    /// The output.
    pub fn tell(&self, output: Output) -> anyhow::Result<()> {
        output.say(|| self.people(), || self.machines())
    }

    fn people(&self) -> String {
        let (file, minutes) = (self.file.display(), self.spent.t_s / 60.0);
        let what = match &self.result {
            Came::Calibrated(found) => {
                let complete = found.iter().filter(|it| it.is_complete()).count();
                let of = found.len();
                format!("{complete} of {of} electrodes are in {file}")
            }
            Came::Checked(drifts) => {
                let count = drifts.len();
                format!("{count} thresholds hold; the check was added to {file}")
            }
        };
        let given = self.spent.given;
        let simulated = match self.simulated {
            true => "\nSimulated: an assumed body, no evidence about people.",
            false => "",
        };
        format!("{what}; {minutes:.1} min of the device's time, {given} presentations{simulated}")
    }

    fn machines(&self) -> Value {
        let mut said = json!({
            "event": "done", "file": self.file, "device_s": self.spent.t_s,
            "presentations": self.spent.given, "simulated": self.simulated, "error": null,
        });
        match &self.result {
            Came::Calibrated(found) => {
                let complete = found.iter().filter(|it| it.is_complete()).count();
                said["electrodes"] = complete.into();
                said["of"] = found.len().into();
                said["found"] = json!(found);
            }
            Came::Checked(drifts) => {
                said["checks"] = drifts.iter().map(drift).collect();
            }
        }
        said
    }
}

fn drift(drift: &Drift) -> Value {
    let milli = |value: u32| f64::from(value) * 1e-3;
    json!({
        "channel": drift.channel, "unit": drift.unit.symbol(), "accepted": drift.accepted,
        "expected": milli(drift.expected.get()),
        "found": drift.found.map(|found| milli(found.get())),
    })
}
