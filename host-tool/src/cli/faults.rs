//! `flexor faults`: injects random faults into a simulated device and judges its outputs.

use super::drawn::{interruption_error, shard_complete_text, with_progress_bar};
use super::{Incomplete, Output, interrupt, usage_error};
use clap::Args;
use hal_sim::chip::image::Image;
use host_core::link::Interruption;
use host_core::plot::words::wrap_columns;
use host_core::run::{DeviceName, chip_image};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;
use studies::faults::{Case, Class, Declaration, Outcome, Run};
use studies::laboratory::{
    self, Lines, RunProgress, Runnable, Shard, merge_drawing, run_drawing, seed_and_draws,
};

/// Inject faults into a simulated board and judge the outputs
///
/// Judges the current at the electrodes. Faults are injected at random moments, in copies of a
/// board that stimulates. Exit code 0 if all cases ran, whatever their outcome: severe cases and
/// undetected faults are in the table and in result.json. The same command with the same --out
/// resumes an interrupted campaign.
#[derive(Args, Debug)]
pub struct FaultsArgs {
    /// Device: chip or native
    #[arg(long, default_value = "chip")]
    device: DeviceName,
    /// Class of faults, or `all`: every class that the device can run, each in its own folder
    #[arg(long)]
    class: ClassSelection,
    /// Number of cases of each class; default: the declaration's
    #[arg(long, conflicts_with = "merge")]
    draws: Option<u64>,
    /// Seed of the faults and their times; default: the declaration's
    #[arg(long, conflicts_with = "merge")]
    seed: Option<u64>,
    /// Run this case alone, counted from 0, and write no folder
    #[arg(long, conflicts_with_all = ["draws", "out"])]
    only: Option<u64>,
    /// Part I of N, such as 3/8
    #[arg(long, requires = "out", conflicts_with = "merge")]
    shard: Option<Shard>,
    /// Merge the folders of all shards into one campaign
    #[arg(long, num_args = 1.., value_name = "DIR", requires = "out")]
    merge: Vec<PathBuf>,
    /// Folder for result.json, result.html and faults.csv: absent, empty, or with the first cases
    /// of the same campaign
    #[arg(long)]
    out: Option<PathBuf>,
    /// ELF to flash instead of the board's own image (chip)
    #[arg(long)]
    image: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum ClassSelection {
    One(Class),
    All,
}

impl FromStr for ClassSelection {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "all" => Ok(Self::All),
            name => name
                .parse()
                .map(Self::One)
                .map_err(|e| format!("{e}, or all")),
        }
    }
}

/// Largest number of cases of a class.
const MOST: u64 = 1_000_000;

/// # Errors
/// Fails if there is no image, the board does not stimulate before the fault, a folder cannot be
/// written or has another campaign, the shards do not make a whole campaign, or a signal arrives.
/// The effect of a fault is never an error.
pub fn main(args: &FaultsArgs, output: Output) -> anyhow::Result<()> {
    args.check()?;
    let image = match args.device {
        DeviceName::Native => None,
        _ => Some(chip_image(args.image.as_deref())?),
    };
    let interruption = interrupt::catch_signals()?;
    let mut campaigns = Vec::new();
    for class in args.classes() {
        let played = args.play_or_merge(class, image.as_ref(), (output, &interruption))?;
        let is_over = played.error.is_some();
        campaigns.push(played);
        if is_over {
            break;
        }
    }
    let error = campaigns.last_mut().and_then(|run| run.error.take());
    let machines = match args.class {
        ClassSelection::One(_) => campaigns.first().map_or(Value::Null, PlayedClass::to_json),
        ClassSelection::All => {
            json!({ "campaigns": campaigns.iter().map(PlayedClass::to_json).collect::<Vec<_>>() })
        }
    };
    let shard = args.shard.filter(|shard| *shard != Shard::WHOLE);
    let Some(error) = error else {
        let text = || match (shard, &args.out) {
            (Some(_), Some(out)) => shard_complete_text(&args.merge_command(), out),
            _ => text_report(&campaigns),
        };
        return output.print(text, || machines);
    };
    if !output.json && shard.is_none() {
        output.print(|| text_report(&campaigns), || Value::Null)?;
    }
    let result = machines;
    Err(Incomplete { error, result }.into())
}

impl FaultsArgs {
    /// Checks that the options fit together and are in range.
    fn check(&self) -> anyhow::Result<()> {
        if let Some(count) = self.draws.filter(|count| !(1..=MOST).contains(count)) {
            return usage_error(format!("--draws is {count}; allowed: 1 to {MOST}"));
        }
        if let Some(only) = self.only.filter(|only| *only >= MOST) {
            return usage_error(format!("--only is {only}; allowed: 0 to {}", MOST - 1));
        }
        if self.only.is_some() && self.class == ClassSelection::All {
            return usage_error("--only needs a class; with --class all, use --draws");
        }
        match self.device {
            DeviceName::Chip => Ok(()),
            DeviceName::Native if self.image.is_none() => Ok(()),
            DeviceName::Native => usage_error("--image needs --device chip"),
            _ => usage_error(format!(
                "--device is {}; allowed: chip and native",
                self.device.to_argument()
            )),
        }
    }

    /// Returns the requested class, or all classes that the device can run.
    fn classes(&self) -> Vec<Class> {
        let is_chip = self.device == DeviceName::Chip;
        match self.class {
            ClassSelection::One(class) => vec![class],
            ClassSelection::All => {
                let classes = Class::ALL.into_iter();
                classes
                    .filter(|class| is_chip || class.is_native())
                    .collect()
            }
        }
    }

    /// Returns the command that merges shards.
    fn merge_command(&self) -> String {
        let class = match self.class {
            ClassSelection::One(class) => class.name(),
            ClassSelection::All => "all",
        };
        format!(
            "faults --class {class} --device {}",
            self.device.to_argument()
        )
    }

    /// Returns `dir` for a single class, otherwise its subfolder with the name of `class`.
    fn folder(&self, dir: &Path, class: Class) -> PathBuf {
        match self.class {
            ClassSelection::One(_) => dir.to_owned(),
            ClassSelection::All => dir.join(class.name()),
        }
    }

    /// Runs or merges the cases of a class.
    fn play_or_merge(
        &self,
        class: Class,
        image: Option<&Image>,
        (output, interruption): (Output, &Interruption),
    ) -> anyhow::Result<PlayedClass> {
        let parts = self.merge.iter().map(|dir| self.folder(dir, class));
        let parts: Vec<PathBuf> = parts.collect();
        let out = self.out.as_ref().map(|dir| self.folder(dir, class));
        let decided = match parts.first() {
            Some(first) => {
                let (seed, count) = seed_and_draws(first)?;
                (Some(seed), Some(count))
            }
            None => (self.seed, self.draws),
        };
        let study = Run::new(Declaration::for_class(class)?, image, decided)?;
        let mut played = PlayedClass {
            notes: study.campaign().notes(),
            class,
            device: study.device(),
            analysed: None,
            alone: None,
            shard: self.shard.unwrap_or(Shard::WHOLE),
            folder: out,
            speed: None,
            error: None,
        };
        match (&played.folder, self.only) {
            (Some(out), _) if !parts.is_empty() => {
                let (ran, cases) = merge_drawing(&Lines(&study), &parts, out)?;
                played.store_outcome(ran, cases);
            }
            (_, Some(index)) => played.play_single_case(&study, index)?,
            _ => played.play(&study, (output, interruption))?,
        }
        Ok(played)
    }
}

/// A class whose cases were run or merged.
struct PlayedClass {
    class: Class,
    /// `chip` or `native`.
    device: &'static str,
    /// Outcome of its cases, for people and for `result.json`; `None` for a shard.
    analysed: Option<(Outcome, laboratory::Outcome)>,
    notes: Vec<String>,
    /// The single case of `--only`.
    alone: Option<Case>,
    shard: Shard,
    folder: Option<PathBuf>,
    speed: Option<String>,
    /// Error that ended the class early.
    error: Option<anyhow::Error>,
}

impl PlayedClass {
    /// Runs the cases that the folder lacks.
    fn play(
        &mut self,
        study: &Run,
        (output, interruption): (Output, &Interruption),
    ) -> anyhow::Result<()> {
        let folder = self.folder.clone();
        let dir = folder.as_deref();
        if let Some(dir) = dir {
            Run::refuse_earlier(dir)?;
        }
        let _mine = dir.map(|dir| study.place(dir, self.shard)).transpose()?;
        let (label, begun) = (format!("faults: {}", self.class), Instant::now());
        let sweep = study.sweep(self.shard);
        let work =
            |go_on: &mut dyn FnMut(f64) -> bool| run_drawing(&Lines(study), &sweep, dir, go_on);
        let (mut ran, cases) = with_progress_bar((&label, output), interruption, work)?;
        let failed = ran.failed.take();
        if failed.is_some() {
            self.folder = None;
        }
        self.speed = (ran.fresh > 0).then(|| speed_text(ran.fresh, begun));
        self.error = failed.or_else(|| interruption_error(&ran, dir, interruption));
        self.store_outcome(ran, cases);
        Ok(())
    }

    /// Keeps the cases and their analysis for the record and the summary.
    fn store_outcome(&mut self, ran: RunProgress, cases: BTreeMap<u64, Case>) {
        let cases: Vec<Case> = cases.into_values().collect();
        let result = ran.outcome;
        self.analysed = result.map(|result| (Outcome::from_cases(self.class, &cases), result));
    }

    /// Runs one case alone.
    fn play_single_case(&mut self, study: &Run, index: u64) -> anyhow::Result<()> {
        let case = study.campaign().case(index)?;
        let (outcome, mut result) = study.compute_outcomes(std::slice::from_ref(&case));
        let (class, device) = (self.class, self.device);
        let alone = format!("faults --class {class} --device {device} --only {index}");
        result.declared.command = Some(alone);
        self.analysed = Some((outcome, result));
        self.alone = Some(case);
        Ok(())
    }

    fn to_json(&self) -> Value {
        let result = self.analysed.as_ref().map(|(_, result)| result);
        match result {
            None => json!({ "shard": self.shard, "folder": self.folder }),
            Some(result) => json!({ "result": result, "folder": self.folder }),
        }
    }
}

/// Formats how many cases this computer ran per second and core, by the wall clock.
fn speed_text(played: u64, begun: Instant) -> String {
    let cores = rayon::current_num_threads() as f64;
    let rate = played as f64 / begun.elapsed().as_secs_f64().max(1e-3) / cores;
    format!("Ran {played} cases, {rate:.2} per second and core.")
}

fn text_report(campaigns: &[PlayedClass]) -> String {
    let mut text = Outcome::head();
    for (outcome, _) in campaigns.iter().filter_map(|run| run.analysed.as_ref()) {
        text += &format!("\n{}", outcome.lines());
    }
    for run in campaigns {
        if let Some(case) = &run.alone {
            text += &format!("\n{case:#?}");
        }
        let remarks = run
            .analysed
            .iter()
            .flat_map(|(outcome, _)| outcome.remarks());
        let notes = run.notes.iter().cloned().chain(remarks);
        for note in notes.chain(run.speed.clone()) {
            text += &format!("\n{}", wrap_columns(&note, 80));
        }
    }
    text + "\nSimulated with a model of chip and output stages: no board, no person."
}
