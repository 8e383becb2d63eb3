//! `flexor experiment distributed`: one muscle's pulses shared by several electrodes.

use super::drawn::conclude;
use super::experiment::ExperimentArgs;
use super::{Output, interrupt, wrong};
use host_core::record::replace_file;
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::distributed::{AxisPoint, DistributedError, Found, NAME, Study, Told};
use studies::laboratory::{self, Outcome};

/// Most persons.
const MOST: u64 = 10_000;
/// Points of the middle person that last as long as a drawn person's conditions.
const POINTS_PER_PERSON: usize = 14;

/// Whether `args` means it.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    args.name == NAME
}

/// # Errors
/// Arguments out of range, a device that plays something else, a folder that cannot be
/// written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = asked(args)?;
    let place = args.out.place(NAME)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(NAME);
    let draws = study.draws();
    let points = study.axis_points()?;
    let whole = draws as usize * POINTS_PER_PERSON + points.len();
    let done = AtomicUsize::new(0);
    let passed = |by: usize| {
        let done = done.fetch_add(by, Ordering::Relaxed) + by;
        bar.set(done as f64 / whole as f64);
    };
    let is_asked = || interruption.asked().is_some();
    let all: Vec<Found> = (0..draws)
        .into_par_iter()
        .filter(|_| !is_asked())
        .map(|index| study.part(index).inspect(|_| passed(POINTS_PER_PERSON)))
        .collect::<Result<_, DistributedError>>()?;
    let along: Vec<AxisPoint> = points
        .par_iter()
        .filter(|_| !is_asked())
        .map(|point| study.at(point).inspect(|_| passed(1)))
        .collect::<Result<_, DistributedError>>()?;
    bar.finish();
    let of = format!(
        "{} of {draws} persons and {} of {} points of charts",
        all.len(),
        along.len(),
        points.len()
    );
    let is_whole = all.len() as u64 == draws && along.len() == points.len();
    let signal = interruption.asked().filter(|_| !is_whole);
    let told = Told {
        command: format!("experiment {NAME} --draws {draws}"),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
    };
    let result = study.outcome(&all, &along, told)?;
    // What was computed is told, whatever becomes of the folder.
    let written = write(place.dir(), &result, &study.csv(&all));
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    conclude(output, place.dir(), &result, written.err().or(ended))
}

/// The study that `args` means, its arguments within what it allows; every mistake told.
fn asked(args: &ExperimentArgs) -> anyhow::Result<Study> {
    let mut mistakes = Vec::new();
    if args.wearer.is_some() || args.departure.is_some() {
        mistakes.push(format!(
            "{NAME} draws its persons: no --wearer, no --departure"
        ));
    }
    let device = args.device.typed();
    if device != "native" {
        mistakes.push(format!(
            "a drawn muscle is simulated for hours of its time, --device is {device}; allowed: native"
        ));
    }
    let study = Study::asked(args.seed, args.draws)?;
    let draws = study.draws();
    if !(1..=MOST).contains(&draws) {
        mistakes.push(format!("--draws is {draws}, allowed is 1 to {MOST}"));
    }
    match mistakes.is_empty() {
        true => Ok(study),
        false => wrong(mistakes.join("; ")),
    }
}

fn write(dir: &Path, result: &Outcome, rows: &str) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    replace_file(&dir.join("draws.csv"), rows.as_bytes())?;
    Ok(())
}
