//! `flexor faults`: what gets past the device when something breaks, drawn and judged.

use super::{Incomplete, Output, interrupt, wrong};
use clap::Args;
use hal_sim::chip::image::Image;
use host_core::link::Interruption;
use host_core::plot::words::in_columns;
use host_core::record::{Place, replace_file, sha256};
use host_core::run::{DeviceName, chip_image};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;
use studies::faults::{
    Campaign, Case, Class, Declaration, FaultsError, Identity, JOURNAL, Journal, Outcome, csv,
};
use studies::laboratory;

/// Break something at random moments, in forks of a simulated board that stimulates,
/// and judge what comes out at the electrodes
///
/// Ends with 0 when all cases were played, whatever they came to: severe cases and what
/// the device did not find stand in the table and in result.json. What was interrupted
/// goes on where it stopped when it is asked for again with the same --out.
#[derive(Args, Debug)]
pub struct FaultsArgs {
    /// chip or native
    #[arg(long, default_value = "chip")]
    device: DeviceName,
    /// What breaks, or `all` that this device can play, each in a folder of its own
    #[arg(long)]
    class: Asked,
    /// Cases to draw of each class; default: the declaration's
    #[arg(long)]
    count: Option<u64>,
    /// Decides what breaks when; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    /// Play this case alone, from 0; only to look at, into no folder
    #[arg(long, conflicts_with_all = ["count", "out"])]
    only: Option<u64>,
    /// Folder for result.json, result.html, faults.csv and faults.jsonl: absent, empty, or
    /// with the first cases of the same campaign
    #[arg(long)]
    out: Option<PathBuf>,
    /// ELF to flash instead of the board's own image (chip)
    #[arg(long)]
    image: Option<PathBuf>,
}

/// One class or all.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Asked {
    One(Class),
    All,
}

impl FromStr for Asked {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "all" => Ok(Self::All),
            name => name
                .parse()
                .map(Self::One)
                .map_err(|e| format!("{e}; or all")),
        }
    }
}

/// Most cases of a class.
const MOST: u64 = 1_000_000;

/// # Errors
/// No image, a board that does not stimulate before anything breaks, a folder that cannot
/// be written or has another campaign, a signal. What a fault does is no error.
pub fn main(args: &FaultsArgs, output: Output) -> anyhow::Result<()> {
    args.check()?;
    let image = match args.device {
        DeviceName::Native => None,
        _ => Some(chip_image(args.image.as_deref())?),
    };
    let interruption = interrupt::heed()?;
    let mut all = Vec::new();
    for class in args.classes() {
        let played = match Played::of(args, class, image.as_ref(), output, &interruption) {
            Err(error) if is_elsewhere(&error) && args.class == Asked::All => continue,
            played => played?,
        };
        let is_over = played.error.is_some();
        all.push(played);
        if is_over {
            break;
        }
    }
    let error = all.last_mut().and_then(|it| it.error.take());
    let machines = match args.class {
        Asked::One(_) => all.first().map_or(Value::Null, Played::machines),
        Asked::All => json!({ "campaigns": all.iter().map(Played::machines).collect::<Vec<_>>() }),
    };
    let Some(error) = error else {
        return output.say(|| people(&all), || machines);
    };
    if !output.json {
        output.say(|| people(&all), || Value::Null)?;
    }
    let result = machines;
    Err(Incomplete { error, result }.into())
}

/// Whether another simulator than the one asked for has what it takes.
fn is_elsewhere(error: &anyhow::Error) -> bool {
    let error = error.downcast_ref::<FaultsError>();
    matches!(error, Some(FaultsError::ChipOnly(_)))
}

impl FaultsArgs {
    /// That it can be played at all.
    fn check(&self) -> anyhow::Result<()> {
        if let Some(count) = self.count.filter(|count| !(1..=MOST).contains(count)) {
            return wrong(format!("--count is {count}, allowed is 1 to {MOST}"));
        }
        if let Some(only) = self.only.filter(|only| *only >= MOST) {
            return wrong(format!("--only is {only}, allowed is 0 to {}", MOST - 1));
        }
        if self.only.is_some() && self.class == Asked::All {
            return wrong("--only needs a class: allowed with --class all is --count".to_owned());
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

    fn classes(&self) -> Vec<Class> {
        match self.class {
            Asked::One(class) => vec![class],
            Asked::All => Class::ALL.to_vec(),
        }
    }

    /// The folder of a class.
    fn dir(&self, class: Class) -> Option<PathBuf> {
        let out = self.out.as_ref()?;
        Some(match self.class {
            Asked::One(_) => out.clone(),
            Asked::All => out.join(class.name()),
        })
    }
}

/// A class that was played.
struct Played {
    outcome: Outcome,
    result: laboratory::Outcome,
    notes: Vec<String>,
    /// The case that was asked for alone.
    alone: Option<Case>,
    folder: Option<PathBuf>,
    speed: Option<String>,
    /// What came in between, with what there is.
    error: Option<anyhow::Error>,
}

/// The folder of a class and its journal, which others may not write.
struct Kept {
    place: Place,
    journal: Journal,
}

impl Played {
    fn of(
        args: &FaultsArgs,
        class: Class,
        image: Option<&Image>,
        output: Output,
        interruption: &Interruption,
    ) -> anyhow::Result<Self> {
        let declaration = Declaration::of(class)?;
        let seed = args.seed.unwrap_or(declaration.seed());
        let count = args
            .count
            .unwrap_or_else(|| declaration.count(image.is_none()));
        let campaign = match image {
            None => Campaign::native(seed, &declaration)?,
            Some(image) => Campaign::on_chip(seed, &declaration, image)?,
        };
        let flashed = image.map(|image| sha256(&image.flash));
        let device = args.device.typed();
        let identity = Identity::of(&declaration, &device, seed, flashed);
        let folder = args.dir(class);
        let (mut kept, mut cases) = match &folder {
            Some(dir) => Kept::open(dir, &identity).map(|(kept, cases)| (Some(kept), cases))?,
            None => (None, Vec::new()),
        };
        if let Some(dir) = folder.as_ref().filter(|_| cases.len() as u64 > count) {
            let (dir, has) = (dir.display().to_string(), cases.len() as u64);
            return Err(FaultsError::FewerThanPlayed { dir, has, count }.into());
        }
        let (mut speed, mut lost) = (None, None);
        if let Some(index) = args.only {
            cases = vec![campaign.case(index)?];
        } else {
            let bar = output.bar(&format!("faults: {class}"));
            let (known, begun) = (cases.len() as u64, Instant::now());
            let mut go_on = |part| {
                bar.set(part);
                interruption.asked().is_none()
            };
            lost = play(&campaign, (&mut cases, count), kept.as_mut(), &mut go_on)?;
            bar.finish();
            let played = (cases.len() as u64).saturating_sub(known);
            speed = (played > 0).then(|| in_words(played, begun));
        }
        let (outcome, notes) = (Outcome::of(class, &cases), campaign.notes());
        let mut result = outcome.result(&declaration, (&device, seed), &notes);
        if let Some(index) = args.only {
            let alone = format!("faults --class {class} --device {device} --only {index}");
            result.declared.command = Some(alone);
        }
        let is_whole = args.only.is_some() || cases.len() as u64 == count;
        let done = format!("{} of {count} cases, the first ones", cases.len());
        if !is_whole {
            result.cut_short = Some(format!("Cut short: {done}."));
        }
        let written = kept.map_or(Ok(()), |it| write(it.place.dir(), class, &result, &cases));
        let written = written.and(lost.map_or(Ok(()), |error| Err(error.into())));
        let ended = interruption.asked().filter(|_| !is_whole);
        let ended = ended.map(|signal| interrupt::Ended(signal, format!("after {done}")).into());
        Ok(Self {
            outcome,
            result,
            notes,
            alone: args.only.and_then(|_| cases.pop()),
            folder: folder.filter(|_| written.is_ok()),
            speed,
            error: written.err().or(ended),
        })
    }

    fn machines(&self) -> Value {
        json!({ "result": self.result, "folder": self.folder })
    }
}

impl Kept {
    /// The folder `dir` and what it has: nothing, or the first cases of the same campaign.
    fn open(dir: &Path, identity: &Identity) -> anyhow::Result<(Self, Vec<Case>)> {
        let place = match dir.join(JOURNAL).exists() {
            true => Place::existing(dir)?,
            false => Place::given(dir, false)?,
        };
        let (journal, cases) = Journal::open(dir, identity)?;
        Ok((Self { place, journal }, cases))
    }
}

/// Plays what is missing of the first cases; gives why the folder could not take them all:
/// what was played is told, whatever becomes of it.
fn play(
    campaign: &Campaign,
    (cases, count): (&mut Vec<Case>, u64),
    mut kept: Option<&mut Kept>,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<FaultsError>, FaultsError> {
    let mut lost = None;
    campaign.play_from(cases.len() as u64, count, &mut |part, some| {
        cases.extend_from_slice(some);
        lost = kept.as_mut().and_then(|it| it.journal.add(some).err());
        Ok(go_on(part) && lost.is_none())
    })?;
    Ok(lost)
}

/// How fast it went, by the clock of this machine, whatever else it did.
fn in_words(played: u64, begun: Instant) -> String {
    let cores = rayon::current_num_threads() as f64;
    let rate = played as f64 / begun.elapsed().as_secs_f64().max(1e-3) / cores;
    format!("Played {played} cases, {rate:.2} a second and core.")
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

fn people(all: &[Played]) -> String {
    let mut text = Outcome::head();
    for it in all {
        text += &format!("\n{}", it.outcome.lines());
    }
    for it in all {
        if let Some(case) = &it.alone {
            text += &format!("\n{case:#?}");
        }
        let notes = it.notes.iter().cloned().chain(it.outcome.remarks());
        for note in notes.chain(it.speed.clone()) {
            text += &format!("\n{}", in_columns(&note, 80));
        }
    }
    text + "\nSimulated: a model of chip and stages; no board and no person."
}
