//! `flexor calibrate`: from a person under electrodes to a wearer file, and whether that
//! still holds.

mod begin;
mod desk;
mod lines;
mod ordered;
mod simulated;
mod work;

use super::{Output, interrupt, usage_error};
use clap::Args;
use desk::ProgressOperator;
use host_core::calibration::CalibrationError;
use host_core::run::DeviceName;
use lines::Lines;
use ordered::Task;
use simulated::BodyName;
use std::io::IsTerminal;
use std::path::PathBuf;
use work::run_task;

/// Find a wearer's thresholds and limits, with an operator
///
/// Writes a wearer file. Every raise of an amplitude needs an order of the operator. With --check the thresholds of an
/// existing file are measured again.
#[derive(Args, Debug)]
pub struct CalibrateArgs {
    /// The wearer file to write (TOML); its journal lies beside it
    #[arg(long, required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Plan (TOML): wearer, limits and electrodes; or --wearer and --channels
    #[arg(long)]
    electrodes: Option<PathBuf>,
    /// The wearer's pseudonym, for the plan's
    #[arg(long)]
    wearer: Option<String>,
    /// Without a plan: channels, such as 1,2,3 or 1-10, as Lee 2020 stimulates
    #[arg(long, conflicts_with = "electrodes")]
    channels: Option<String>,
    /// With --channels: no level is above it, mA; default: 20
    #[arg(long, requires = "channels")]
    ceiling: Option<f64>,
    /// Go on where the journal beside --out ends
    #[arg(long)]
    resume: bool,
    /// Check the thresholds of this wearer file, and add what was found to it
    #[arg(long, conflicts_with_all = ["out", "electrodes", "wearer", "channels", "resume"])]
    check: Option<PathBuf>,
    /// With --check: how far a threshold may be off, mA or V; default: 1
    #[arg(long, requires = "check")]
    tolerance: Option<f64>,
    /// native, qemu, chip, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Let the program answer by the instrument, as fast as it can (simulators only)
    #[arg(long)]
    auto: bool,
    /// The simulated wearer
    #[arg(long, value_enum)]
    body: Option<BodyName>,
    /// Seed of the simulated wearer, to 2^63 - 1; default: 1
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
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
/// The plan, the device, the files; what ended it, or thresholds that have drifted.
pub fn main(args: &CalibrateArgs, output: Output) -> anyhow::Result<()> {
    let is_port = args.device.is_port();
    if is_port && (args.seed.is_some() || args.body.is_some()) {
        return usage_error(
            "--seed and --body need --device native or chip: a board's wearer has none",
        );
    }
    anyhow::ensure!(
        !(is_port && args.auto),
        "E679 --auto answers for simulated bodies only: on {} a person is asked before every raise",
        args.device
    );
    let task = Task::from_args(args)?;
    let has_terminal = std::io::stdin().is_terminal() && std::io::stdout().is_terminal();
    if !args.auto && !output.json && !has_terminal {
        return Err(CalibrationError::Nobody.into());
    }
    let interruption = interrupt::catch_signals()?;
    let worked = if args.auto {
        let bar = output.bar("calibrating");
        let worked = run_task(args, &task, &interruption, &mut ProgressOperator::new(&bar));
        bar.finish();
        worked?
    } else if output.json {
        let mut lines = Lines::default();
        let worked = run_task(args, &task, &interruption, &mut lines);
        lines.end();
        worked?
    } else {
        desk::calibrate_at_terminal(args, &task, &interruption)?
    };
    worked.print(output)
}
