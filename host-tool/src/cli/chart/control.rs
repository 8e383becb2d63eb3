//! `flexor chart control`: control laws on random plants, error against cycles.

use super::write;
use crate::cli::{Output, wrong};
use anyhow::ensure;
use clap::{Args, ValueEnum};
use methods::control::Form;
use std::path::PathBuf;
use studies::figures::control_picture;
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

/// The most plants: each is a few kilobytes and a second of computing.
const MOST_PLANTS: u64 = 100_000;

/// Chart the control laws on random wearers: error against cycles
#[derive(Args, Debug)]
pub struct Control {
    /// Decides the plants; any but the one the gains were searched on
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many plants; each runs one- and two-point
    #[arg(long, default_value_t = 200)]
    plants: u64,
    /// What the earlier wearers are to follow
    #[arg(long, value_enum, default_value_t = CourseName::Sine)]
    course: CourseName,
    /// Which wearers to draw
    #[arg(long, value_enum, default_value_t = WearersName::Earlier)]
    wearers: WearersName,
    /// Look for every law's numbers anew instead and write control_gains.csv
    #[arg(long)]
    search: bool,
    /// How many candidates the search tries for each law
    #[arg(long, default_value_t = 240)]
    evaluations: usize,
    /// Folder for control.csv, control.svg and control_gains.csv
    #[arg(long, default_value = "docs/charts")]
    out: PathBuf,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum CourseName {
    /// 45 ± 40° at 0.2 Hz
    Sine,
    /// Four slow sines drawn from the seed
    Smooth,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum WearersName {
    /// Gain ±50 %, delay to 60 ms; everyone follows the same course
    Earlier,
    /// Strength × 0.5…2.8, delay to 100 ms, loads, knocks; sines, steps, holds
    Widened,
}

/// # Errors
/// E560 to E564. E575: a file cannot be written.
pub fn main(args: &Control, output: Output) -> anyhow::Result<()> {
    ensure!(
        args.out.is_dir(),
        "E564 --out {}: no such folder; run in the checkout or name a folder that exists",
        args.out.display()
    );
    if args.search {
        return search(args, output);
    }
    if args.plants > MOST_PLANTS {
        return wrong("--plants: 100000 at most; 200 for a chart");
    }
    if args.plants < 2 {
        return wrong("--plants: 2 or more, since intervals are printed; 200 for a chart");
    }
    if args.seed == TRAINING_SEED {
        return wrong("--seed: the gains were searched on these plants; take any other");
    }
    let plan = Plan {
        seed: args.seed,
        plants: args.plants,
        wearers: match args.wearers {
            WearersName::Earlier => Wearers::Earlier,
            WearersName::Widened => Wearers::Widened,
        },
        course: match args.course {
            CourseName::Sine => Course::Sine,
            CourseName::Smooth => Course::Smooth { seed: args.seed },
        },
        with_optimum: matches!(args.wearers, WearersName::Earlier),
    };
    let searched = gains::read(gains::COMMITTED)?;
    let searched = searched
        .into_iter()
        .map(|(equipment, found)| Contender::Searched(equipment, found.candidate));
    let contenders = searched.chain([Contender::Shipped]).collect();
    let bar = output.bar("control");
    let campaign = Campaign::run(plan, contenders, |part| bar.set(part));
    bar.finish();
    let mut campaign = campaign?;
    if plan.wearers == Wearers::Widened {
        write(
            &args.out.join("control_widened.csv"),
            &widened::csv(&campaign),
        )?;
        return output.say(
            || widened::text(&campaign).trim_end().to_owned(),
            || widened::json(&campaign),
        );
    }
    let cost = Cost::on_chip();
    if let Ok(cost) = &cost {
        campaign.cycles = campaign.contenders.iter().map(|c| cost.of(c)).collect();
    }
    write(&args.out.join("control.csv"), &table::csv(&campaign))?;
    write(&args.out.join("control.svg"), &control_picture(&campaign))?;
    output.say(
        || {
            let why = cost.err().map_or_else(String::new, |e| {
                format!("\nno cycles: the image `laws` did not run: {e}")
            });
            table::text(&campaign).trim_end().to_owned() + &why
        },
        || table::json(&campaign),
    )?;
    Ok(())
}

fn search(args: &Control, output: Output) -> anyhow::Result<()> {
    if args.evaluations < 12 {
        return wrong("--evaluations: 12 or more");
    }
    let bar = output.bar("search");
    let training = Training::new()?;
    let all = || {
        Form::ALL
            .into_iter()
            .flat_map(|form| Equipment::ALL.map(|e| (form, e)))
    };
    let laws = all().count() as f64;
    let mut rows = Vec::new();
    for (n, (form, equipment)) in all().enumerate() {
        let found = training.search(form, equipment, args.evaluations, |part| {
            bar.set((n as f64 + part) / laws);
        })?;
        rows.extend(found.map(|found| (equipment, found)));
    }
    bar.finish();
    let path = args.out.join("control_gains.csv");
    write(&path, &gains::write(&rows, args.evaluations))?;
    output.say(
        || table::found(&rows, args.evaluations).trim_end().to_owned(),
        || table::found_json(&rows, args.evaluations),
    )?;
    Ok(())
}
