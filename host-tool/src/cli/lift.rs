//! `flexor experiment buatier`: arms that lift while stimulation follows their joints.

use super::drawn::{conclude, until_asked};
use super::experiment::ExperimentArgs;
use super::{Output, interrupt, wrong};
use host_core::record::replace_file;
use std::path::Path;
use studies::laboratory::{self, Outcome};
use studies::lift::{
    Decides, LiftError, NAME, Replication, Study, Told, deciding, outcome, replication,
};

/// Most studies.
const MOST: u64 = 10_000;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a person who cannot be, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = Study::declared()?;
    let draws = args.draws.unwrap_or(study.studies);
    let seed = args.seed.unwrap_or(study.seed);
    allowed(args, draws)?;
    let place = args.out.place(NAME)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(NAME);
    let passed = |count| bar.set(count as f64 / (draws + 1) as f64);
    let is_asked = || interruption.asked().is_some();
    let find = |index| unless_asked(replication(&study, seed, index, &is_asked));
    let studies = until_asked(draws, &interruption, passed, find)?;
    let studies: Vec<Replication> = studies.into_iter().flatten().collect();
    // A quick look does not ask which assumption decides.
    let is_asked_for = draws >= study.studies;
    let decides = match studies.len() as u64 == draws && is_asked_for {
        true => unless_asked(deciding(&study, seed, &is_asked))?,
        false => None,
    };
    let is_whole = studies.len() as u64 == draws && (decides.is_some() || !is_asked_for);
    bar.finish();
    let of = format!("{} of {draws} studies", studies.len());
    let signal = interruption.asked().filter(|_| !is_whole);
    let told = Told {
        seed,
        draws,
        command: format!("experiment {NAME} --draws {draws}"),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
    };
    let result = outcome(&study, &studies, decides.as_ref(), told)?;
    let written = write(place.dir(), &result, &studies, decides.as_ref());
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    conclude(output, place.dir(), &result, written.err().or(ended))
}

/// Nothing of what a signal ended.
fn unless_asked<T>(found: Result<T, LiftError>) -> Result<Option<T>, LiftError> {
    match found {
        Err(LiftError::Asked) => Ok(None),
        found => found.map(Some),
    }
}

/// Refuses what does not go with it.
fn allowed(args: &ExperimentArgs, draws: u64) -> anyhow::Result<()> {
    if args.wearer.is_some() || args.departure.is_some() {
        return wrong(format!(
            "{NAME} draws its persons: no --wearer, no --departure"
        ));
    }
    let device = args.device.typed();
    if device != "native" {
        return wrong(format!(
            "{NAME} takes the device's own modulation without the rest of it; --device is \
             {device}, allowed: native"
        ));
    }
    match (1..=MOST).contains(&draws) {
        true => Ok(()),
        false => wrong(format!("--draws is {draws}, allowed is 1 to {MOST}")),
    }
}

fn write(
    dir: &Path,
    result: &Outcome,
    studies: &[Replication],
    decides: Option<&Decides>,
) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    let mut lines = String::new();
    for it in studies {
        lines += &serde_json::to_string(it)?;
        lines.push('\n');
    }
    replace_file(&dir.join("studies.jsonl"), lines.as_bytes())?;
    if let Some(decides) = decides {
        let text = serde_json::to_string_pretty(decides)? + "\n";
        replace_file(&dir.join("deciding.json"), text.as_bytes())?;
    }
    Ok(())
}
