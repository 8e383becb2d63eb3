//! `flexor faults`: what gets past the device when something breaks, drawn and judged.

use super::{Output, interrupt, wrong};
use clap::Args;
use host_core::record::{Place, replace_file};
use host_core::run::{DeviceName, chip_image};
use std::path::{Path, PathBuf};
use studies::faults::{Campaign, Case, Class, Declaration, Outcome, csv};
use studies::laboratory;

/// Break something at random moments, in forks of a simulated board that stimulates,
/// and judge what comes out at the electrodes
#[derive(Args, Debug)]
pub struct FaultsArgs {
    /// chip or native
    #[arg(long, default_value = "chip")]
    device: DeviceName,
    /// flips
    #[arg(long)]
    class: Class,
    /// Cases to draw; default: the declaration's
    #[arg(long)]
    count: Option<u64>,
    /// Decides what breaks when; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    /// Play this case alone, from 0
    #[arg(long, conflicts_with = "count")]
    only: Option<u64>,
    /// Folder for result.json, result.html and faults.csv, absent or empty
    #[arg(long)]
    out: Option<PathBuf>,
    /// ELF to flash instead of the board's own image (chip)
    #[arg(long)]
    image: Option<PathBuf>,
}

/// Most cases of a class.
const MOST: u64 = 1_000_000;

/// # Errors
/// No image, a board that does not stimulate before anything breaks, a folder that cannot
/// be written, a signal. What a fault does is no error.
pub fn main(args: &FaultsArgs, output: Output) -> anyhow::Result<()> {
    let declaration = Declaration::of(args.class)?;
    let seed = args.seed.unwrap_or(declaration.seed());
    let count = args.count.unwrap_or(declaration.count());
    if count == 0 || count > MOST {
        return wrong(format!("--count is {count}, allowed is 1 to {MOST}"));
    }
    if args.device != DeviceName::Chip {
        return wrong(format!("--device {}: flips need chip", args.device.typed()));
    }
    let interruption = interrupt::heed()?;
    let place = args.out.as_deref().map(|dir| Place::given(dir, false));
    let place = place.transpose()?;
    let image = chip_image(args.image.as_deref())?;
    let campaign = Campaign::on_chip(seed, &declaration, &image)?;
    let bar = output.bar(&format!("faults: {}", args.class));
    let cases = match args.only {
        Some(index) => vec![campaign.case(index)?],
        None => campaign.play(count, &mut |part| {
            bar.set(part);
            interruption.asked().is_none()
        })?,
    };
    bar.finish();
    let outcome = Outcome::of(args.class, &cases);
    let on = (&*args.device.typed(), seed);
    let mut result = outcome.result(&declaration, on, &campaign.notes());
    let is_whole = args.only.is_some() || cases.len() as u64 == count;
    if !is_whole {
        let done = cases.len();
        result.cut_short = Some(format!(
            "Cut short: {done} of {count} cases, the first ones."
        ));
    }
    if let Some(place) = &place {
        write(place.dir(), args.class, &result, &cases)?;
    }
    output.say(
        || people(&outcome, &result, &cases, args.only.is_some()),
        || serde_json::json!({ "result": result, "folder": args.out }),
    )?;
    match interruption.asked() {
        Some(signal) if !is_whole => {
            let when = format!("after {} of {count} cases", cases.len());
            Err(interrupt::Ended(signal, when).into())
        }
        _ => Ok(()),
    }
}

fn write(
    dir: &Path,
    class: Class,
    result: &laboratory::Outcome,
    cases: &[Case],
) -> anyhow::Result<()> {
    laboratory::publish(dir, result, &[])?;
    replace_file(&dir.join("faults.csv"), &csv(class, cases)?)?;
    Ok(())
}

fn people(
    outcome: &Outcome,
    result: &laboratory::Outcome,
    cases: &[Case],
    shows_all: bool,
) -> String {
    let mut text = format!("{}\n{}", Outcome::head(), outcome.lines());
    if shows_all {
        for case in cases {
            text += &format!("\n{case:#?}");
        }
    }
    for note in result.notes.iter().take(4) {
        text += &format!("\n{note}");
    }
    text
}
