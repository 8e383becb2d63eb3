//! `flexor faults`: what gets past the device when something breaks, drawn and judged.

use super::{Output, interrupt, wrong};
use clap::Args;
use host_core::plot::words::in_columns;
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
    /// flips, declarations, registers or electrode; of these native plays declarations and
    /// electrode
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
    if !matches!(args.device, DeviceName::Chip | DeviceName::Native) {
        let device = args.device.typed();
        return wrong(format!("--device is {device}: allowed are chip and native"));
    }
    if args.device == DeviceName::Native && args.image.is_some() {
        return wrong("--image needs --device chip");
    }
    let interruption = interrupt::heed()?;
    let place = args.out.as_deref().map(|dir| Place::given(dir, false));
    let place = place.transpose()?;
    let campaign = match args.device {
        DeviceName::Native => Campaign::native(seed, &declaration)?,
        _ => Campaign::on_chip(seed, &declaration, &chip_image(args.image.as_deref())?)?,
    };
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
    let notes = campaign.notes();
    let on = (&*args.device.typed(), seed);
    let mut result = outcome.result(&declaration, on, &notes);
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
        || people(&outcome, &notes, args.only.is_some().then_some(&cases)),
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

fn people(outcome: &Outcome, notes: &[String], shown: Option<&Vec<Case>>) -> String {
    let mut text = format!("{}\n{}", Outcome::head(), outcome.lines());
    for case in shown.into_iter().flatten() {
        text += &format!("\n{case:#?}");
    }
    for note in notes {
        text += &format!("\n{}", in_columns(note, 80));
    }
    text + "\nSimulated: a model of chip and stages; no board and no person."
}
