//! `flexor experiment electrode-choice`: which of ten electrodes serve a wanted force.

use super::drawn::{conclude, until_asked};
use super::experiment::ExperimentArgs;
use super::{Output, interrupt, wrong};
use host_core::run::DeviceName;
use studies::electrodes::{Missed, NAME, Study, Told, Wearer, missed, outcome};
use studies::laboratory;

/// Most wearers: each is 400 kB.
const MOST: u64 = 2_000;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = Study::declared()?;
    let draws = args.draws.unwrap_or(study.draws);
    let seed = args.seed.unwrap_or(study.seed);
    allowed(args, draws)?;
    let place = args.out.place(NAME)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(NAME);
    let passed = |count| bar.set(count as f64 / draws as f64);
    let find = |index| missed(&study, &Wearer::drawn(seed, index)?);
    let all: Vec<Missed> = until_asked(draws, &interruption, passed, find)?;
    bar.finish();
    let of = format!("{} of {draws} wearers", all.len());
    let signal = interruption.asked().filter(|_| (all.len() as u64) < draws);
    let told = Told {
        seed,
        draws,
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
    };
    let result = outcome(&study, &all, told);
    let written = laboratory::publish(place.dir(), &result, &[]);
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    let failed = written.err().map(anyhow::Error::from).or(ended);
    conclude(output, place.dir(), &result, failed)
}

/// Refuses what does not go with it.
fn allowed(args: &ExperimentArgs, draws: u64) -> anyhow::Result<()> {
    if args.wearer.is_some() || args.departure.is_some() {
        return wrong(format!("--wearer and --departure do not belong to {NAME}"));
    }
    if args.device != DeviceName::Native {
        let device = args.device.typed();
        return wrong(format!(
            "{NAME} is of bodies alone, without a device; --device is {device}, allowed: native"
        ));
    }
    match (2..=MOST).contains(&draws) {
        true => Ok(()),
        false => wrong(format!("--draws is {draws}, allowed is 2 to {MOST}")),
    }
}
