//! `flexor calibrate`: from a person under electrodes to a wearer file.

mod begin;
mod simulated;

use super::{Output, interrupt, wrong};
use begin::Begun;
use clap::Args;
use host_core::calibration::{
    Auto, CalibrationError, Course, Finished, Journal, OnDisk, Operator, Plan, calibrate,
};
use host_core::link::{Error, Port};
use host_core::run::DeviceName;
use simulated::BodyName;
use std::path::PathBuf;

/// Find a wearer's thresholds, limits and points electrode by electrode, and write them to
/// a wearer file; nothing is raised without an order of its own.
#[derive(Args, Debug)]
pub struct CalibrateArgs {
    /// The wearer file to write (TOML); its journal lies beside it
    #[arg(long)]
    out: PathBuf,
    /// Plan (TOML): wearer, limits and electrodes
    #[arg(long)]
    electrodes: PathBuf,
    /// Go on where the journal beside --out ends
    #[arg(long)]
    resume: bool,
    /// native, chip, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Let the program answer by its instrument, as fast as it can (simulators only)
    #[arg(long)]
    auto: bool,
    /// The simulated wearer
    #[arg(long, value_enum)]
    body: Option<BodyName>,
    /// Seed of the simulated wearer; default: 1
    #[arg(long)]
    seed: Option<u64>,
    /// Who operates: a pseudonym
    #[arg(long, default_value = "operator")]
    operator: String,
    /// When, as the file is to say it; default: this computer's clock, on simulators
    /// "simulated"
    #[arg(long)]
    at: Option<String>,
    /// Acknowledge a latched fault first, once its cause is found
    #[arg(long)]
    acknowledge: bool,
}

/// # Errors
/// The plan, the device, the files; what ended it.
pub fn main(args: &CalibrateArgs, output: Output) -> anyhow::Result<()> {
    let is_port = args.device.is_port();
    if is_port && (args.seed.is_some() || args.body.is_some()) {
        return wrong("--seed and --body need --device native or chip: a board's wearer has none");
    }
    anyhow::ensure!(
        !(is_port && args.auto),
        "E679 --auto answers for simulated bodies only: on {} a person is asked before every raise",
        args.device
    );
    let text = host_core::session::Session::text(&args.electrodes)?;
    let plan = Plan::parse(&args.electrodes.display().to_string(), &text)?;
    let mut head = begin::head(args, &plan, &text);
    let before = begin::files(args, &head)?;
    let interruption = interrupt::heed()?;
    let port = begin::open(args, &plan, &mut head)?;
    let begun = Begun { head, ..before };
    let course = Course {
        plan: &plan,
        out: &args.out,
        files: &OnDisk,
        before: &begun.entries,
        head: &begun.head,
        interruption: Some(interruption.clone()),
        acknowledges: args.acknowledge,
    };
    let mut operator = Auto;
    let finished = carry_out(port, &course, &begun, &mut operator)?;
    tell(&course, &finished, output)
}

/// The course, with what a signal did told as such.
fn carry_out(
    port: Box<dyn Port>,
    course: &Course<'_>,
    begun: &Begun,
    operator: &mut dyn Operator,
) -> anyhow::Result<Finished> {
    let mut journal = Journal::open(course.files, &begun.journal, begun.entries.len())?;
    let (result, _port) = calibrate(port, course, &mut journal, operator);
    result.map_err(|error| match error {
        CalibrationError::Link(Error::Interrupted(signal)) => {
            let what = "during the calibration: the device was stopped; go on with --resume";
            interrupt::Ended(signal, what.to_owned()).into()
        }
        error => error.into(),
    })
}

fn tell(course: &Course<'_>, finished: &Finished, output: Output) -> anyhow::Result<()> {
    let complete = finished.found.iter().filter(|it| it.is_complete()).count();
    output.say(
        || {
            let (out, t_s) = (course.out.display(), finished.t_s);
            let of = finished.found.len();
            format!(
                "{complete} of {of} electrodes are in {out}; {:.1} min of the device's time, {} \
                 presentations",
                t_s / 60.0,
                finished.given
            )
        },
        || {
            serde_json::json!({
                "out": course.out, "electrodes": complete, "of": finished.found.len(),
                "device_s": finished.t_s, "presentations": finished.given,
                "found": finished.found, "simulated": course.head.simulated, "error": null,
            })
        },
    )
}
