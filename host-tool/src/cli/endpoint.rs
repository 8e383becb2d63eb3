//! `flexor experiment sierotowicz`: a wanted force at the hand of drawn arms.

use super::experiment::ExperimentArgs;
use super::hamana::people::people;
use super::{Incomplete, Output, interrupt, wrong};
use host_core::record::replace_file;
use host_core::run::DeviceName;
use rayon::prelude::*;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::endpoint::{Replication, Study, Told, arms_page, outcome, played_c3, replication};
use studies::laboratory::{self, Outcome};

/// Its name.
const NAME: &str = "sierotowicz";
/// Most studies.
const MOST: u64 = 10_000;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = Study::declared()?;
    let draws = args.draws.unwrap_or(study.replications);
    let seed = args.seed.unwrap_or(study.seed);
    allowed(args, draws)?;
    // Whatever is wrong with the device is told before anybody is drawn.
    let device = &args.device;
    let played = played_c3(&study, seed, device)?.in_words(device);
    let place = args.out.place(NAME)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(NAME);
    let done = AtomicUsize::new(0);
    let all: Vec<_> = (0..draws)
        .into_par_iter()
        .filter_map(|index| {
            if interruption.asked().is_some() {
                return None;
            }
            let found = replication(&study, seed, index);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set(count as f64 / draws as f64);
            Some(found.map_err(|error| format!("number {index}: {error}")))
        })
        .collect();
    bar.finish();
    let computed = all.len() as u64;
    let mut studies = Vec::new();
    let mut failed = Vec::new();
    for it in all {
        match it {
            Ok(it) => studies.push(it),
            Err(why) => failed.push(why),
        }
    }
    let of = format!("{computed} of {draws} studies");
    let signal = interruption.asked().filter(|_| computed < draws);
    let told = Told {
        seed,
        draws,
        command: format!(
            "experiment {NAME} --device {} --draws {draws}",
            device.typed()
        ),
        played: Some((device.typed(), played)),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
        failed,
    };
    let result = outcome(&study, &studies, told)?;
    let written = write(place.dir(), &result, &studies);
    let page = place.dir().join("result.html").display().to_string();
    let arms = place.dir().join("arms.html").display().to_string();
    let told = || format!("{}\nPage: {page}\nArms: {arms}", people(&result));
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    match written.err().or(ended) {
        None => output.say(
            told,
            || json!({ "result": result, "page": page, "arms": arms }),
        ),
        Some(error) => {
            if !output.json {
                output.say(|| people(&result), || Value::Null)?;
            }
            let result = json!({ "result": result });
            Err(Incomplete { error, result }.into())
        }
    }
}

/// Refuses what does not go with it.
fn allowed(args: &ExperimentArgs, draws: u64) -> anyhow::Result<()> {
    if args.wearer.is_some() || args.departure.is_some() {
        return wrong(format!("--wearer and --departure do not belong to {NAME}"));
    }
    let device = &args.device;
    if !matches!(device, DeviceName::Native | DeviceName::Chip) {
        return wrong(format!(
            "{NAME} is of simulated bodies; --device is {device}, allowed: native, chip"
        ));
    }
    match (1..=MOST).contains(&draws) {
        true => Ok(()),
        false => wrong(format!("--draws is {draws}, allowed is 1 to {MOST}")),
    }
}

fn write(dir: &Path, result: &Outcome, studies: &[Replication]) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    let mut lines = String::new();
    for it in studies {
        lines += &serde_json::to_string(it)?;
        lines.push('\n');
    }
    replace_file(&dir.join("studies.jsonl"), lines.as_bytes())?;
    if let Some(first) = studies.first() {
        replace_file(&dir.join("arms.html"), arms_page(first).as_bytes())?;
    }
    Ok(())
}
