//! `flexor experiment lee`: Lee 2020's protocol on a bench whose truth is known.

use super::drawn::conclude;
use super::experiment::ExperimentArgs;
use super::{Output, interrupt, wrong};
use host_core::record::replace_file;
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::laboratory::{self, Outcome};
use studies::lee::{LeeError, Part, Study, Told};

/// Its name.
const NAME: &str = "lee";
/// Most replications.
const MOST: u64 = 1_000;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a device that is not there, a folder that cannot be written, a
/// signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = asked(args)?;
    let place = args.out.place(NAME)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(NAME);
    // The device first: what is wrong with it is told before minutes pass.
    let device = study.on_device()?;
    let all = study.units();
    let done = AtomicUsize::new(0);
    let parts: Vec<Option<Part>> = all
        .par_iter()
        .map(|unit| {
            if interruption.asked().is_some() {
                return Ok(None);
            }
            let part = study.part(unit)?;
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set(count as f64 / all.len() as f64);
            Ok(Some(part))
        })
        .collect::<Result<_, LeeError>>()?;
    bar.finish();
    let parts: Vec<Part> = parts.into_iter().flatten().collect();
    let of = format!("{} of {} sessions", parts.len(), all.len());
    let signal = interruption.asked().filter(|_| parts.len() < all.len());
    let told = Told {
        command: format!(
            "experiment {NAME} --device {} --draws {}",
            args.device.typed(),
            study.draws
        ),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
        device,
    };
    let result = study.outcome(&parts, told)?;
    let written = write(place.dir(), &result, &study, &parts);
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    conclude(output, place.dir(), &result, written.err().or(ended))
}

fn asked(args: &ExperimentArgs) -> anyhow::Result<Study> {
    if args.wearer.is_some() || args.departure.is_some() {
        return wrong(format!("--wearer and --departure do not belong to {NAME}"));
    }
    let device = &args.device;
    if device.is_port() {
        return wrong(format!(
            "a bench is simulated, --device is {device}; allowed: native, chip, qemu"
        ));
    }
    let study = Study::asked(args.seed, args.draws, device.clone())?;
    match (1..=MOST).contains(&study.draws) {
        true => Ok(study),
        false => wrong(format!(
            "--draws is {}, allowed is 1 to {MOST}",
            study.draws
        )),
    }
}

fn write(dir: &Path, result: &Outcome, study: &Study, parts: &[Part]) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    replace_file(&dir.join("draws.csv"), study.csv(parts).as_bytes())?;
    replace_file(
        &dir.join("mismatch.csv"),
        study.mismatch_csv(parts).as_bytes(),
    )?;
    for (file, text) in study.wearers(parts)? {
        replace_file(&dir.join(file), text.as_bytes())?;
    }
    Ok(())
}
