//! `flexor faults`: what gets past the device when something breaks, drawn and judged.

use super::{Incomplete, Output, interrupt, wrong};
use clap::Args;
use host_core::plot::words::in_columns;
use host_core::record::{Place, replace_file};
use host_core::run::{DeviceName, chip_image};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::faults::{Campaign, Case, Class, Declaration, Outcome, csv};
use studies::laboratory;

/// Break something at random moments, in forks of a simulated board that stimulates,
/// and judge what comes out at the electrodes
///
/// Ends with 0 when all cases were played, whatever they came to: severe cases and what
/// the device did not find stand in the table and in result.json.
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
    args.check(count)?;
    let interruption = interrupt::heed()?;
    let campaign = match args.device {
        DeviceName::Native => Campaign::native(seed, &declaration)?,
        _ => Campaign::on_chip(seed, &declaration, &chip_image(args.image.as_deref())?)?,
    };
    let place = args.out.as_deref().map(|dir| Place::given(dir, false));
    let place = place.transpose()?;
    let bar = output.bar(&format!("faults: {}", args.class));
    let cases = match args.only {
        Some(index) => vec![campaign.case(index)?],
        None => campaign.play(count, &mut |part| {
            bar.set(part);
            interruption.asked().is_none()
        })?,
    };
    bar.finish();
    let (outcome, notes) = (Outcome::of(args.class, &cases), campaign.notes());
    let on = (&*args.device.typed(), seed);
    let mut result = outcome.result(&declaration, on, &notes);
    let is_whole = args.only.is_some() || cases.len() as u64 == count;
    let done = format!("{} of {count} cases, the first ones", cases.len());
    if !is_whole {
        result.cut_short = Some(format!("Cut short: {done}."));
    }
    let shown = args.only.is_some().then_some(&cases);
    // What was played is told, whatever becomes of the folder.
    let written = match &place {
        Some(place) => write(place.dir(), args.class, &result, &cases),
        None => Ok(()),
    };
    let folder = args.out.as_ref().filter(|_| written.is_ok());
    let machines = json!({ "result": result, "folder": folder });
    let ended = interruption.asked().filter(|_| !is_whole);
    let ended = ended.map(|signal| interrupt::Ended(signal, format!("after {done}")).into());
    match written.err().or(ended) {
        None => output.say(|| people(&outcome, &notes, shown), || machines),
        Some(error) => {
            if !output.json {
                output.say(|| people(&outcome, &notes, shown), || Value::Null)?;
            }
            let result = machines;
            Err(Incomplete { error, result }.into())
        }
    }
}

impl FaultsArgs {
    /// That it can be played at all.
    fn check(&self, count: u64) -> anyhow::Result<()> {
        if count == 0 || count > MOST {
            return wrong(format!("--count is {count}, allowed is 1 to {MOST}"));
        }
        match self.device {
            DeviceName::Chip => Ok(()),
            DeviceName::Native if self.image.is_none() => Ok(()),
            DeviceName::Native => wrong("--image needs --device chip"),
            _ => wrong(format!(
                "--device is {}: allowed are chip and native",
                self.device.typed()
            )),
        }
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
