//! `flexor calibrate`: measures a wearer's thresholds and limits into a wearer file, or checks a
//! file.

mod desk;
mod lines;
mod ordered;
mod work;

use super::{Output, interrupt, usage_error};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use desk::ProgressOperator;
use host_core::calibration::{CalibrationError, SimulatedWearer};
use host_core::run::DeviceName;
use lines::Lines;
use ordered::Task;
use std::io::IsTerminal;
use std::path::PathBuf;
use work::{print, run_task};

/// Find a wearer's thresholds and limits, with an operator
///
/// Writes a wearer file. Every increase of an amplitude needs an order of the operator. --check
/// measures the thresholds of an existing file again.
#[derive(Args, Debug)]
pub struct CalibrateArgs {
    /// Wearer file to write (TOML); its journal is written beside it
    #[arg(long, required_unless_present = "check")]
    out: Option<PathBuf>,
    /// Plan (TOML): wearer, limits and electrodes; or use --pseudonym and --channels
    #[arg(long)]
    electrodes: Option<PathBuf>,
    /// Pseudonym of the wearer, instead of the plan's
    #[arg(long)]
    pseudonym: Option<String>,
    /// Without a plan: channels, such as 1,2,3 or 1-10, stimulated as in Lee 2020
    #[arg(long, conflicts_with = "electrodes")]
    channels: Option<String>,
    /// With --channels: largest level, mA; default: 20
    #[arg(long, requires = "channels")]
    ceiling: Option<f64>,
    /// Continue at the end of the journal beside --out
    #[arg(long)]
    resume: bool,
    /// Check the thresholds of this wearer file, and add the results to it
    #[arg(long, conflicts_with_all = ["out", "electrodes", "pseudonym", "channels", "resume"])]
    check: Option<PathBuf>,
    /// With --check: largest accepted change of a threshold, mA or V; default: 1
    #[arg(long, requires = "check")]
    tolerance: Option<f64>,
    /// Device: native, qemu, chip, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Answer automatically from the measurements, as fast as possible (simulators only)
    #[arg(long)]
    auto: bool,
    /// Body under the electrodes of a simulated device
    #[arg(long, value_parser = simulated_wearers())]
    body: Option<SimulatedWearer>,
    /// Seed of the simulated wearer, at most 2^63 - 1; default: 1
    #[arg(long, value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
    /// Pseudonym of the operator
    #[arg(long, default_value = "operator")]
    operator: String,
    /// Date and time for the file; default: this computer's clock, or "simulated" on simulators
    #[arg(long)]
    at: Option<String>,
    /// Acknowledge a latched fault first, after you have found its cause
    #[arg(long)]
    acknowledge: bool,
}

/// # Errors
/// Fails if the plan, the device or a file is unusable, if the calibration ends early, or if
/// thresholds have drifted.
pub fn main(args: &CalibrateArgs, output: Output) -> anyhow::Result<()> {
    let is_port = args.device.is_port();
    if is_port && (args.seed.is_some() || args.body.is_some()) {
        return usage_error(
            "--seed and --body describe a simulated wearer: they need --device native or chip",
        );
    }
    anyhow::ensure!(
        !(is_port && args.auto),
        "E679 --auto works only with simulated wearers; on {} an operator must order each raise: \
         leave out --auto",
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
    print(&worked, output)
}

/// Returns the parser of a simulated wearer's name, which also lists the names in the help.
fn simulated_wearers() -> impl TypedValueParser<Value = SimulatedWearer> {
    let value =
        |wearer: SimulatedWearer| PossibleValue::new(wearer.name()).help(wearer.description());
    PossibleValuesParser::new(SimulatedWearer::ALL.map(value))
        .map(|name| SimulatedWearer::from_name(&name).unwrap_or_default()) // a listed name
}
