//! `flexor sweep`: simulates an experiment's wearers on all cores, in shards if requested.

use super::drawn::{GOES_ON, print_shard_complete};
use super::outcome::claims_text;
use super::wearer_args::{ForearmArgs, WearerArgs};
use super::{Output, WrongUse, drawn, interrupt, usage_error};
use clap::Args;
use host_core::run::DeviceName;
use interrupt::EndedBySignal;
use std::path::PathBuf;
use studies::catalog::{Entry, StudyRequest};
use studies::experiments::load_experiment;
use studies::laboratory::{DeviceCheck, MOST_DRAWS, Outcome, Shard, Sweep, merge};

/// Run a study with many draws on all cores
///
/// The same command resumes an interrupted sweep.
#[derive(Args, Debug)]
pub struct SweepArgs {
    /// Name of a study, as in `flexor experiment`, or a declaration file
    name: String,
    #[command(flatten)]
    wearer: WearerArgs,
    #[command(flatten)]
    forearms: ForearmArgs,
    /// Device on which studies with random wearers run a sample: native, chip or qemu
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Wearers at each point of the grid; default: the declaration's
    #[arg(long, conflicts_with = "merge")]
    draws: Option<u64>,
    /// Seed of wearers and noise; default: the declaration's
    #[arg(long, conflicts_with = "merge")]
    seed: Option<u64>,
    /// Part I of N, such as 3/8
    #[arg(long, conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Merge the folders of all shards into one sweep
    #[arg(long, num_args = 1.., value_name = "DIR")]
    merge: Vec<PathBuf>,
    /// Folder of the sweep: absent, empty, or with this sweep unfinished
    #[arg(long)]
    out: PathBuf,
}

/// # Errors
/// Fails if the experiment is unknown, the folder holds something else, the shards do not make a
/// whole sweep, a session fails, or a signal arrives.
pub fn main(args: &SweepArgs, output: Output) -> anyhow::Result<()> {
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let asked = StudyRequest {
        name: &args.name,
        wearer: args.wearer.name(),
        ablation: args.forearms.ablation(),
        participants: args.forearms.source(),
        device: &args.device,
        decided: (args.seed, args.draws),
    };
    if let Some(entry) = Entry::find(&asked).map_err(WrongUse)? {
        return drawn::run_sweep(entry, &asked, (shard, &args.merge), &args.out, output);
    }
    if args.wearer.name().is_some() || args.device != DeviceName::Native {
        return usage_error(format!(
            "a sweep of {} accepts none of --wearer, --participant and --device",
            args.name
        ));
    }
    let experiment = load_experiment(&args.name)?;
    if !args.merge.is_empty() {
        let outcome = merge(&args.merge, &args.out, &experiment)?;
        return print_outcome(args, output, &outcome);
    }
    let draws = args.draws.unwrap_or(experiment.declaration.draws);
    if draws == 0 || experiment.units(draws) > MOST_DRAWS {
        return usage_error(format!(
            "--draws is {draws}; allowed: 1 to {MOST_DRAWS} over all points"
        ));
    }
    let seed = args.seed.unwrap_or(experiment.declaration.seed);
    let sweep = Sweep::new(&experiment, seed, draws, shard);
    let interruption = interrupt::catch_signals()?;
    let _mine = sweep.place(&args.out)?;
    let bar = output.bar(&experiment.declaration.name);
    let mut done = 0.0;
    let swept = sweep.run(&experiment, &args.out, &[], &mut |part| {
        bar.set(part);
        done = part;
        interruption.received_signal().is_none()
    })?;
    bar.finish();
    if let (Some(signal), true) = (interruption.received_signal(), done < 1.0) {
        let percent = 100.0 * done;
        let when = format!("after {percent:.0} % of the sweep; {GOES_ON}");
        return Err(EndedBySignal(signal, when).into());
    }
    if let Some(checked) = swept.checked {
        eprintln!("{}", device_check_text(checked));
    }
    match swept.outcome {
        Some(outcome) => print_outcome(args, output, &outcome),
        None => print_shard_complete(&format!("sweep {}", args.name), (shard, &args.out), output),
    }
}

/// Describes how many units ran without the device, and how their speed compares.
fn device_check_text(checked: DeviceCheck) -> String {
    let DeviceCheck {
        units,
        whole,
        alone,
    } = checked;
    let ratio = whole.as_secs_f64() / alone.as_secs_f64();
    match units {
        0 => "open loop: simulated without the device; no unit was repeated on it".to_owned(),
        _ => format!(
            "open loop: simulated without the device, {ratio:.1} times as fast; {units} units were \
             repeated on the device, with equal results"
        ),
    }
}

fn print_outcome(args: &SweepArgs, output: Output, outcome: &Outcome) -> anyhow::Result<()> {
    let page = args.out.join("result.html").display().to_string();
    output.print(
        || claims_text(outcome, &page),
        || serde_json::json!({ "result": outcome, "page": page }),
    )
}
