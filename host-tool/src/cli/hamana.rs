//! `flexor experiment hamana-1` to `hamana-4`, `hamana-posture` and `hamana-hold`: Hamana
//! 2022's studies by drawn participants on a forearm that is a mechanism. `hamana-4`
//! without `--wearer` is a declaration of the laboratory's.

pub(super) mod people;

use super::drawn::conclude;
use super::experiment::{ExperimentArgs, command};
use super::{Output, interrupt, wrong};
use host_core::record::replace_file;
use host_core::wearer::shipped;
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use studies::laboratory::{self, Outcome};
use studies::two_points::TwoPointsError;
use studies::two_points::paper::{Kind, Part, Study, Told};

/// Most replications.
const MOST: u64 = 1_000;
/// Who has a study of these by its name alone too.
const CONTROL: &str = "hamana-4";

/// Whether `args` means one of them.
pub(super) fn is_meant(args: &ExperimentArgs) -> bool {
    let is_study = Kind::named(&args.name).is_some();
    let wearer = args.wearer.as_deref();
    let is_file = wearer.is_some_and(|it| it.ends_with(".toml") || shipped(it).is_some());
    // On a wearer file anything else is a declaration's.
    args.departure.is_some()
        || (wearer.is_some() && (is_study || !is_file))
        || (args.name != CONTROL && is_study)
}

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub(super) fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let study = asked(args)?;
    let place = args.out.place(&args.name)?;
    let interruption = interrupt::heed()?;
    let bar = output.bar(&args.name);
    let all = study.units();
    let done = AtomicUsize::new(0);
    let parts: Vec<Option<Part>> = all
        .par_iter()
        .map(|unit| {
            let part = study.part(*unit, &|| interruption.asked().is_none())?;
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            bar.set(count as f64 / all.len() as f64);
            Ok(part)
        })
        .collect::<Result<_, TwoPointsError>>()?;
    bar.finish();
    let parts: Vec<Part> = parts.into_iter().flatten().collect();
    let of = format!("{} of {} draws", parts.len(), all.len());
    let signal = interruption.asked().filter(|_| parts.len() < all.len());
    let told = Told {
        command: command(args, study.draws()),
        cut_short: signal.map(|_| format!("Cut short after {of}.")),
    };
    let result = study.outcome(&parts, told)?;
    // What was computed is told, whatever becomes of the folder.
    let written = write(place.dir(), &result, &study.csv(&parts));
    let ended = signal.map(|it| interrupt::Ended(it, format!("after {of}")).into());
    conclude(output, place.dir(), &result, written.err().or(ended))
}

/// The study that `args` means, its arguments within what it allows.
fn asked(args: &ExperimentArgs) -> anyhow::Result<Study> {
    let Some(kind) = Kind::named(&args.name) else {
        let (name, own) = (
            &args.name,
            "hamana-1 to hamana-4, hamana-posture and hamana-hold",
        );
        return wrong(match (&args.departure, &args.wearer) {
            (None, Some(wearer)) => format!(
                "--wearer of {name} is a wearer file, NAME.toml, or one that is shipped, not `{wearer}`"
            ),
            _ => format!("--departure belongs to {own}, not to {name}"),
        });
    };
    let device = &args.device;
    if device.is_port() {
        return wrong(format!(
            "a drawn forearm is simulated, --device is {device}; allowed: native, chip, qemu"
        ));
    }
    let decided = (args.seed, args.draws);
    let whom = (args.wearer.as_deref(), args.departure.as_deref());
    let study = Study::asked(kind, whom, decided, device.clone()).map_err(told)?;
    let draws = study.draws();
    match (1..=MOST).contains(&draws) {
        // Whatever is wrong with the device is told before anybody is drawn.
        true => study.greet().map(|()| study).map_err(Into::into),
        false => wrong(format!("--draws is {draws}, allowed is 1 to {MOST}")),
    }
}

/// A wearer file's mistakes are shown with their lines.
pub(super) fn told(error: TwoPointsError) -> anyhow::Error {
    match error {
        TwoPointsError::File(error) => error.into(),
        error => error.into(),
    }
}

fn write(dir: &Path, result: &Outcome, rows: &str) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    replace_file(&dir.join("draws.csv"), rows.as_bytes())?;
    Ok(())
}
