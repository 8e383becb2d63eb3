//! `flexor two-points`: counts in which random wearers Hamana 2022's claims hold, and under which
//! conditions.

use super::draw_cost::Cost;
use super::{Output, drawn, usage_error};
use clap::Args;
use std::path::PathBuf;
use studies::hamana2022::{Cells, CellsRun, TWO_POINTS};
use studies::laboratory::{Runnable, Shard, read_shard};

/// Judge the claims of Hamana 2022 on randomly generated forearms
///
/// Searches points and voltages on each forearm as the paper did. The same command with the same
/// --out resumes an interrupted study.
#[derive(Args, Debug)]
pub struct TwoPointsArgs {
    /// Number of a single cell (one set of model assumptions), from 0; default: all cells
    #[arg(long)]
    cell: Option<usize>,
    /// Wearers in each cell; default: the declaration's
    #[arg(long)]
    draws: Option<u64>,
    /// Seed of the wearers; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    /// Part I of N, such as 3/8
    #[arg(long)]
    shard: Option<Shard>,
    /// Merge the folders of all shards into one result
    #[arg(long, num_args = 1.., value_name = "DIR")]
    merge: Vec<PathBuf>,
    /// Folder for result.json, result.html and draws.csv: absent, empty, or with this study
    /// unfinished
    #[arg(long)]
    out: Option<PathBuf>,
    /// Only measure the computing time of a draw on this computer, separately for searches and
    /// trials
    #[arg(long)]
    timing: bool,
}

/// Largest number of random wearers in a cell.
const MOST: u64 = 100_000;

/// # Errors
/// Fails if an argument is out of range, a folder cannot be written, or a signal arrives.
pub fn main(args: &TwoPointsArgs, output: Output) -> anyhow::Result<()> {
    args.check_conflicts()?;
    if !args.merge.is_empty() {
        return merge(args, output);
    }
    let Some(cells) = Cells::load(args.cell)? else {
        let most = Cells::load(None)?.map_or(0, |cells| cells.count()) - 1;
        let cell = args.cell.unwrap_or_default();
        return usage_error(format!("--cell is {cell}; allowed: 0 to {most}"));
    };
    let population = cells.population();
    let draws = args.draws.unwrap_or(population.draws);
    if draws == 0 || draws > MOST {
        return usage_error(format!("--draws is {draws}; allowed: 1 to {MOST}"));
    }
    if args.timing {
        let seed = args.seed.unwrap_or(population.seed);
        return Cost::main((args.cell, args.draws), seed, output);
    }
    let (shard, out) = (args.shard.unwrap_or(Shard::WHOLE), args.out.as_deref());
    let study = CellsRun::new(cells, (args.seed, Some(draws)));
    let _mine = out.map(|dir| study.place(dir, shard)).transpose()?;
    drawn::run(&study, (out, shard), (TWO_POINTS, TWO_POINTS), output)
}

impl TwoPointsArgs {
    /// Refuses options that contradict each other.
    fn check_conflicts(&self) -> anyhow::Result<()> {
        let has = [
            ("--cell", self.cell.is_some()),
            ("--draws", self.draws.is_some()),
            ("--seed", self.seed.is_some()),
            ("--shard", self.shard.is_some()),
            ("--timing", self.timing),
        ];
        let given = has.into_iter().find(|(_, is_given)| *is_given);
        if let (Some((option, _)), false) = (given, self.merge.is_empty()) {
            return usage_error(format!(
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
            (Some((option, _)), None, false) => usage_error(format!(
                "{option} needs a folder to write in: add --out DIR"
            )),
            (Some(_), _, true) | (_, Some(_), true) => usage_error(
                "--timing measures this computer and writes no result: leave out --shard and \
                 --out",
            ),
            _ => Ok(()),
        }
    }
}

/// Merges shards; their folders name the cells.
fn merge(args: &TwoPointsArgs, output: Output) -> anyhow::Result<()> {
    let (Some(first), Some(out)) = (args.merge.first(), args.out.as_deref()) else {
        return usage_error("--merge needs folders, and --out DIR");
    };
    let first = read_shard(first)?;
    let decided = (Some(first.seed), Some(first.draws));
    let study = CellsRun::new(Cells::from_sweep(&first)?, decided);
    drawn::merge_shards(&study, &args.merge, out, output)
}
