//! `flexor two-points`: in which drawn wearers Hamana 2022's claims hold, and what they
//! need to.

use super::draw_cost::Cost;
use super::drawn::{kept, say_shard};
use super::interrupt::{self, Ended};
use super::{Incomplete, Output, wrong};
use clap::Args;
use host_core::plot::words::in_columns;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use studies::hamana2022::{Cells, SIMULATED, Summary};
use studies::laboratory::{Drawing, Outcome, Shard, Sweep, join, part_of};

/// Draw forearms that are a mechanism, search points and voltages on each as Hamana 2022
/// did, and judge its claims; with --out the same command goes on where it was interrupted
#[derive(Args, Debug)]
pub struct TwoPointsArgs {
    /// One cell alone, by its number from 0; without, all
    #[arg(long)]
    cell: Option<usize>,
    /// Wearers in each cell; default: the declaration's
    #[arg(long)]
    draws: Option<u64>,
    /// Decides who is drawn; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    /// Part I of N, as 3/8
    #[arg(long)]
    shard: Option<Shard>,
    /// Make one result of the folders of all its shards
    #[arg(long, num_args = 1.., value_name = "DIR")]
    merge: Vec<PathBuf>,
    /// Folder for result.json, result.html and draws.csv: absent, empty, or this begun before
    #[arg(long)]
    out: Option<PathBuf>,
    /// Measure what a draw costs this computer, searches and trials apart, instead
    #[arg(long)]
    timing: bool,
}

/// Most wearers of a cell.
const MOST: u64 = 100_000;

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub fn main(args: &TwoPointsArgs, output: Output) -> anyhow::Result<()> {
    args.exclude()?;
    if !args.merge.is_empty() {
        return merge(args, output);
    }
    let Some(cells) = Cells::declared(args.cell)? else {
        let most = Cells::declared(None)?.map_or(0, |it| it.count()) - 1;
        let cell = args.cell.unwrap_or_default();
        return wrong(format!("--cell is {cell}, allowed is 0 to {most}"));
    };
    let population = cells.population();
    let draws = args.draws.unwrap_or(population.draws);
    if draws == 0 || draws > MOST {
        return wrong(format!("--draws is {draws}, allowed is 1 to {MOST}"));
    }
    let seed = args.seed.unwrap_or(population.seed);
    if args.timing {
        return Cost::main((args.cell, args.draws), seed, output);
    }
    let shard = args.shard.unwrap_or(Shard::WHOLE);
    let sweep = Sweep::drawing(&cells, (seed, draws), shard);
    draw(args, &cells, &sweep, output)
}

impl TwoPointsArgs {
    /// Refuses what does not go together.
    fn exclude(&self) -> anyhow::Result<()> {
        let has = [
            ("--cell", self.cell.is_some()),
            ("--draws", self.draws.is_some()),
            ("--seed", self.seed.is_some()),
            ("--shard", self.shard.is_some()),
            ("--timing", self.timing),
        ];
        let given = has.into_iter().find(|(_, is_given)| *is_given);
        if let (Some((option, _)), false) = (given, self.merge.is_empty()) {
            return wrong(format!(
                "--merge takes cell, draws and seed from the folders of its shards: leave out \
                 {option}"
            ));
        }
        let keeps = [
            ("--shard", self.shard.is_some()),
            ("--merge", !self.merge.is_empty()),
        ];
        let keeps = keeps.into_iter().find(|(_, is_given)| *is_given);
        match (keeps, &self.out, self.timing) {
            (Some((option, _)), None, false) => wrong(format!(
                "{option} needs a folder to write in: add --out DIR"
            )),
            (Some(_), _, true) | (_, Some(_), true) => wrong(
                "--timing measures this computer and writes no result: leave out --shard and \
                 --out",
            ),
            _ => Ok(()),
        }
    }
}

/// Draws what the folder does not hold yet, or all without one.
fn draw(args: &TwoPointsArgs, cells: &Cells, sweep: &Sweep, output: Output) -> anyhow::Result<()> {
    let out = args.out.as_deref();
    let interruption = interrupt::heed()?;
    let _mine = out.map(|dir| sweep.place(dir)).transpose()?;
    let bar = output.bar("two-points");
    let mut done = 0.0;
    let computed = sweep.compute(cells, out, &mut |part| {
        bar.set(part);
        done = part;
        interruption.asked().is_none()
    })?;
    bar.finish();
    let summaries = cells.summaries(sweep.draws, &computed.units);
    let is_shard = sweep.shard != Shard::WHOLE;
    if let (Some(signal), false) = (interruption.asked(), computed.is_whole) {
        let result = match is_shard {
            true => json!({}),
            false => told(&cells.outcome(sweep, &computed.units)?, out),
        };
        let when = match out {
            Some(_) => kept(done),
            None => format!(
                "after {} of {} cells, the first ones",
                summaries.len(),
                cells.count()
            ),
        };
        let error = Ended(signal, when).into();
        return Err(Incomplete { error, result }.into());
    }
    let result = match out {
        Some(dir) if is_shard => return say_shard("two-points", (sweep.shard, dir), output),
        Some(dir) => sweep.close(cells, dir, &computed.units)?,
        None => cells.outcome(sweep, &computed.units)?,
    };
    output.say(|| people(&summaries, out), || told(&result, out))
}

/// Joins shards.
fn merge(args: &TwoPointsArgs, output: Output) -> anyhow::Result<()> {
    let (Some(first), Some(out)) = (args.merge.first(), args.out.as_deref()) else {
        return wrong("--merge needs folders, and --out DIR");
    };
    let first = part_of(first)?;
    let cells = Cells::of(&first)?;
    let (units, result) = join(&args.merge, out, &cells)?;
    let summaries = cells.summaries(first.draws, &units);
    output.say(
        || people(&summaries, Some(out)),
        || told(&result, Some(out)),
    )
}

/// For machines.
fn told(result: &Outcome, out: Option<&Path>) -> Value {
    json!({ "result": result, "folder": out })
}

fn people(summaries: &[Summary], out: Option<&Path>) -> String {
    let mut text = Summary::head();
    for summary in summaries {
        text += &format!("\n{}\n{}", summary.line(), summary.below());
    }
    let told = "n: wearers with all numbers; columns: in how many of a hundred each claim holds \
                (host-tool/experiments/hamana-population.toml has them in this order).";
    text += &format!("\n{}\n{SIMULATED}", in_columns(told, 80));
    let page = out.map(|dir| format!("\nPage: {}", dir.join("result.html").display()));
    text + &page.unwrap_or_default()
}
