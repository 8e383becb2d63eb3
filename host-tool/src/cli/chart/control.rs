//! `flexor chart control`: charts the errors of controllers on random plants against their cycles.

use super::{files, hands, write};
use crate::cli::wearer_args::WearerArgs;
use crate::cli::{Output, usage_error};
use anyhow::ensure;
use clap::{Args, ValueEnum};
use methods::control::Form;
use std::path::PathBuf;
use studies::figures::{control_picture, failure_picture};
use studies::tracking::ablation::Term;
use studies::tracking::ablation_table;
use studies::tracking::campaign::{Campaign, Plan};
use studies::tracking::candidate::Equipment;
use studies::tracking::contender::Contender;
use studies::tracking::cost::Cost;
use studies::tracking::exercise::Wearers;
use studies::tracking::gains;
use studies::tracking::search::{TRAINING_SEED, Training};
use studies::tracking::table;
use studies::tracking::target::Course;
use studies::tracking::widened;

/// Largest number of plants: each takes a few kilobytes and a second of computing time.
const MOST_PLANTS: u64 = 100_000;
/// Default number of plants, without and with `--quick`.
const PLANTS: (u64, u64) = (200, 60);

/// Chart controllers on random wearers: errors, cycles, failures
#[derive(Args, Debug)]
pub struct Control {
    #[arg(long, default_value_t = 1, help = format!(
        "Seed of the plants; not {TRAINING_SEED}, whose plants were used to search the gains"
    ))]
    seed: u64,
    /// Number of plants, each with one and with two points; default: 200, or 60 with --quick; for
    /// hands 60, or 8 with --quick
    #[arg(long)]
    plants: Option<u64>,
    /// Reference for --wearers earlier; default: sine
    #[arg(long, value_enum)]
    course: Option<CourseName>,
    /// Population of random wearers
    #[arg(long, value_enum, default_value_t = WearersName::Earlier, conflicts_with_all = ["wearer", "participant"])]
    wearers: WearersName,
    #[command(flatten)]
    wearer: WearerArgs,
    /// Run only the default controller, the two best others and the PID controllers; write no file
    #[arg(long, conflicts_with_all = ["optimum", "out"])]
    quick: bool,
    /// Run the default controller without each of its terms on both populations; write
    /// control_ablation.csv
    #[arg(long, conflicts_with_all = ["quick", "course", "wearers", "optimum", "wearer", "participant"])]
    ablate: bool,
    /// Compare the default controller without a wearer file, with true ones and with those that
    /// `flexor calibrate` writes, on all three populations; write control_files.csv
    #[arg(long, conflicts_with_all = ["course", "wearers", "ablate", "optimum", "wearer", "participant"])]
    files: bool,
    /// Number of the earlier plants on which the offline optimum is searched; default: 40
    #[arg(long)]
    optimum: Option<u64>,
    /// Search the gains of every controller again, and write control_gains.csv
    #[arg(long, conflicts_with_all = ["seed", "plants", "course", "wearers", "quick", "ablate", "optimum", "wearer", "participant", "files"])]
    search: bool,
    /// Number of candidates that the search tries for each controller
    #[arg(long, default_value_t = 100, requires = "search")]
    evaluations: usize,
    /// Folder for control*.csv and control*.svg
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CourseName {
    /// 45 ± 40° at 0.2 Hz
    Sine,
    /// Four slow sines that depend on the seed
    Smooth,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WearersName {
    /// Gain ±50 %, delay up to 60 ms; all follow the same reference
    Earlier,
    /// Strength × 0.5…2.8, delay up to 100 ms, loads, knocks; references: sines, steps, holds
    Widened,
    /// Multibody forearm models, as in `two-points`; reference: a sine that each can hold
    Hands,
}

/// # Errors
/// E560 to E564; E621 to E623 of hands. E575: a file cannot be written.
pub fn main(args: &Control, output: Output) -> anyhow::Result<()> {
    ensure!(
        args.quick || args.out.is_dir(),
        "E564 --out {}: no such folder; run in the checkout or name a folder that exists",
        args.out.display()
    );
    if args.search {
        return search(args, output);
    }
    if args.files {
        let out = (!args.quick).then_some(&*args.out);
        return match args.plants.map(|_| plant_count(args, PLANTS)).transpose() {
            Ok(draws) => files::main((args.seed, draws), out, output),
            Err(refused) => usage_error(refused),
        };
    }
    if args.wearer.name().is_some() || matches!(args.wearers, WearersName::Hands) {
        let out = (!args.quick).then_some(&*args.out);
        return match hands_plan(args) {
            Ok(plan) => hands::main(plan, args.wearer.name(), out, output),
            Err(refused) => usage_error(refused),
        };
    }
    let plan = match plan(args) {
        Ok(plan) => plan,
        Err(refused) => return usage_error(refused),
    };
    if args.ablate {
        return ablate(args, plan, output);
    }
    let campaign = run(plan, contenders(args.quick)?, output)?;
    match plan.wearers {
        Wearers::Earlier => chart_earlier_wearers(args, campaign, output),
        Wearers::Widened => chart_widened_wearers(args, &campaign, output),
    }
}

/// Returns the plan for hands, or the reason why the options do not fit it.
fn hands_plan(args: &Control) -> Result<hands::Plan, String> {
    if args.course.is_some() || args.optimum.is_some() {
        let why = "a hand has its own reference, and no optimum is searched for it";
        return Err(format!(
            "--course and --optimum need --wearers earlier: {why}"
        ));
    }
    Ok(hands::Plan {
        seed: args.seed,
        draws: plant_count(args, hands::DRAWS)?,
    })
}

/// Returns the number of plants, given the defaults of a chart and of `--quick`.
fn plant_count(args: &Control, (chart, quick): (u64, u64)) -> Result<u64, String> {
    let usual = if args.quick { quick } else { chart };
    let plants = args.plants.unwrap_or(usual);
    if !(2..=MOST_PLANTS).contains(&plants) {
        return Err(format!(
            "--plants is {plants}; allowed: 2 to {MOST_PLANTS} (a chart uses {chart})"
        ));
    }
    Ok(plants)
}

/// Returns the plan of the campaign, or the reason why the options do not fit.
fn plan(args: &Control) -> Result<Plan, String> {
    let plants = plant_count(args, PLANTS)?;
    if args.seed == TRAINING_SEED {
        let seed = args.seed;
        return Err(format!(
            "--seed is {seed}, on whose plants the gains were searched; give another seed"
        ));
    }
    let wearers = match args.wearers {
        WearersName::Earlier => Wearers::Earlier,
        WearersName::Widened if args.course.is_some() || args.optimum.is_some() => {
            let why = "a widened wearer has its own reference, and no optimum is searched for it";
            return Err(format!(
                "--course and --optimum need --wearers earlier: {why}"
            ));
        }
        WearersName::Widened => Wearers::Widened,
        // Hands have their own plan ([`hands_plan`]).
        WearersName::Hands => Wearers::Earlier,
    };
    let has_optimum = wearers == Wearers::Earlier && !args.quick && !args.ablate;
    Ok(Plan {
        seed: args.seed,
        plants,
        wearers,
        course: match args.course {
            None | Some(CourseName::Sine) => Course::Sine,
            Some(CourseName::Smooth) => Course::Smooth { seed: args.seed },
        },
        optimum_plants: if has_optimum {
            args.optimum.unwrap_or(40)
        } else {
            0
        },
    })
}

/// Returns all controllers with the gains that the search found, and the default controller. With
/// `--quick`, returns only the default controller, the PID controllers and the two others that were
/// best in training.
fn contenders(is_quick: bool) -> anyhow::Result<Vec<Contender>> {
    let mut searched = gains::read(gains::COMMITTED)?;
    if is_quick {
        searched.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
        let mut others = 0;
        searched.retain(|(_, found)| {
            let is_pid = found.candidate.form == Form::Pid;
            others += u32::from(!is_pid);
            is_pid || others <= 2
        });
    }
    let searched = searched
        .into_iter()
        .map(|(equipment, found)| Contender::Searched(equipment, found.candidate));
    Ok(searched.chain([Contender::Shipped]).collect())
}

fn run(plan: Plan, contenders: Vec<Contender>, output: Output) -> anyhow::Result<Campaign> {
    let bar = output.bar("control");
    let campaign = Campaign::run(plan, contenders, |part| bar.set(part));
    bar.finish();
    Ok(campaign?)
}

fn chart_earlier_wearers(
    args: &Control,
    mut campaign: Campaign,
    output: Output,
) -> anyhow::Result<()> {
    let cost = Cost::on_chip();
    if let Ok(cost) = &cost {
        campaign.cycles = campaign
            .contenders
            .iter()
            .map(|c| cost.contender_cycles(c))
            .collect();
    }
    if !args.quick {
        write(&args.out.join("control.csv"), &table::csv(&campaign))?;
        write(&args.out.join("control.svg"), &control_picture(&campaign))?;
    }
    output.print(
        || {
            let why = cost.err().map_or_else(String::new, |e| {
                format!("\nno cycles: the image `laws` did not run: {e}")
            });
            table::text(&campaign).trim_end().to_owned() + &why
        },
        || table::json(&campaign),
    )
}

fn chart_widened_wearers(
    args: &Control,
    campaign: &Campaign,
    output: Output,
) -> anyhow::Result<()> {
    if !args.quick {
        let name = |end: &str| args.out.join(format!("control_widened.{end}"));
        write(&name("csv"), &widened::csv(campaign))?;
        write(&name("svg"), &failure_picture(campaign))?;
    }
    output.print(
        || widened::text(campaign).trim_end().to_owned(),
        || widened::json(campaign),
    )
}

/// Runs the default controller, whole and without each of its terms, on the earlier and the widened
/// wearers.
fn ablate(args: &Control, plan: Plan, output: Output) -> anyhow::Result<()> {
    let shipped = std::iter::once(Contender::Shipped);
    let contenders: Vec<_> = shipped.chain(Term::ALL.map(Contender::Ablated)).collect();
    let on = |wearers| run(Plan { wearers, ..plan }, contenders.clone(), output);
    let results = [on(Wearers::Earlier)?, on(Wearers::Widened)?];
    write(
        &args.out.join("control_ablation.csv"),
        &ablation_table::csv(&results),
    )?;
    output.print(
        || ablation_table::text(&results).trim_end().to_owned(),
        || ablation_table::json(&results),
    )
}

fn search(args: &Control, output: Output) -> anyhow::Result<()> {
    if args.evaluations < 12 {
        return usage_error(format!(
            "--evaluations is {}; allowed: 12 or more",
            args.evaluations
        ));
    }
    let bar = output.bar("search");
    let training = Training::new()?;
    let pairs = || {
        Form::ALL
            .into_iter()
            .flat_map(|form| Equipment::ALL.map(|e| (form, e)))
    };
    let laws = (pairs().count() + 1) as f64;
    let default = training.search_default(args.evaluations, |part| bar.set(part / laws))?;
    let default = default.as_ref();
    let mut rows = Vec::new();
    for (n, (form, equipment)) in pairs().enumerate() {
        let found = training.search(form, equipment, args.evaluations, |part| {
            bar.set((1.0 + n as f64 + part) / laws);
        })?;
        rows.extend(found.map(|found| (equipment, found)));
    }
    bar.finish();
    let path = args.out.join("control_gains.csv");
    write(&path, &gains::write(&rows, default, args.evaluations))?;
    output.print(
        || {
            table::search_text(&rows, default, args.evaluations)
                .trim_end()
                .to_owned()
        },
        || table::search_json(&rows, default, args.evaluations),
    )?;
    Ok(())
}
