//! `flexor two-points`: in which drawn wearers Hamana 2022's claims hold, and what they
//! need to.

use super::{Incomplete, Output, interrupt, wrong};
use clap::Args;
use host_core::plot::words::in_columns;
use host_core::record::{Place, replace_file, sha256};
use rayon::prelude::*;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::PathBuf;
use studies::laboratory::{self, Declared, Outcome};
use studies::two_points::{Cell, DECLARED, Drawn, HEAD, Population, Summary, TwoPointsError};

/// Draw forearms that are a mechanism, search points and voltages on each as Hamana 2022
/// did, and judge its claims
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
    /// Folder for result.json, result.html and draws.csv, absent or empty
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Most wearers of a cell.
const MOST: u64 = 100_000;
/// Wearers between two questions whether to go on.
const AT_ONCE: usize = 8;

/// # Errors
/// Arguments out of range, a folder that cannot be written, a signal.
pub fn main(args: &TwoPointsArgs, output: Output) -> anyhow::Result<()> {
    let population = Population::declared()?;
    let seed = args.seed.unwrap_or(population.seed);
    let draws = args.draws.unwrap_or(population.draws);
    if draws == 0 || draws > MOST {
        return wrong(format!("--draws is {draws}, allowed is 1 to {MOST}"));
    }
    let mut cells = population.cells();
    if let Some(index) = args.cell {
        let count = cells.len();
        let Some(cell) = cells.get(index).cloned() else {
            return wrong(format!("--cell is {index}, allowed is 0 to {}", count - 1));
        };
        cells = vec![cell];
    }
    let place = args.out.as_deref().map(|dir| Place::given(dir, false));
    let place = place.transpose()?;
    let interruption = interrupt::heed()?;
    let bar = output.bar("two-points");
    let mut summaries = Vec::new();
    let of = cells.len() as f64;
    for (number, cell) in cells.iter().enumerate() {
        let drawn = play(&population, cell, (seed, draws), &mut |part| {
            bar.set((number as f64 + part) / of);
            interruption.asked().is_none()
        })?;
        let Some(drawn) = drawn else { break };
        summaries.push(Summary {
            cell: cell.clone(),
            drawn,
        });
    }
    bar.finish();
    let done = format!(
        "{} of {} cells, the first ones",
        summaries.len(),
        cells.len()
    );
    let is_whole = summaries.len() == cells.len();
    let mut result = result(&population, &summaries, (seed, draws));
    if !is_whole {
        result.cut_short = Some(format!("Cut short: {done}."));
    }
    if let Some(place) = &place {
        laboratory::publish(place.dir(), &result, &[])?;
        let rows: String = summaries.iter().map(Summary::rows).collect();
        replace_file(
            &place.dir().join("draws.csv"),
            format!("{HEAD}{rows}").as_bytes(),
        )?;
    }
    let machines = json!({ "result": result, "folder": args.out });
    match interruption.asked().filter(|_| !is_whole) {
        None => output.say(|| people(&summaries), || machines),
        Some(signal) => {
            let error = interrupt::Ended(signal, format!("after {done}")).into();
            let result = machines;
            Err(Incomplete { error, result }.into())
        }
    }
}

/// All wearers of a cell; `None` if `go_on` said no before they were all drawn.
fn play(
    population: &Population,
    cell: &Cell,
    (seed, draws): (u64, u64),
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Option<Vec<Drawn>>, TwoPointsError> {
    let indices: Vec<u64> = (0..draws).collect();
    let mut all = Vec::with_capacity(indices.len());
    for some in indices.chunks(AT_ONCE * rayon::current_num_threads()) {
        if !go_on(all.len() as f64 / draws as f64) {
            return Ok(None);
        }
        let each = some
            .par_iter()
            .map(|index| population.draw(cell, seed, *index));
        all.extend(each.collect::<Result<Vec<_>, _>>()?);
    }
    Ok(Some(all))
}

fn result(population: &Population, summaries: &[Summary], (seed, draws): (u64, u64)) -> Outcome {
    let ranges = population.ranges.iter().map(|range| {
        let (field, low, high, source) = (&range.field, range.low, range.high, &range.source);
        format!("Drawn: {field} from {low} to {high} ({source}).")
    });
    let cells = summaries.iter().map(|it| {
        let (name, below) = (it.cell.name(), it.below());
        format!("{name}: {}.", below.trim())
    });
    let notes = [SIMULATED.to_owned()]
        .into_iter()
        .chain(ranges)
        .chain(cells);
    Outcome {
        name: "two-points".to_owned(),
        title: population.title.clone(),
        seed,
        simulated: Some(true),
        cut_short: None,
        declared: Declared {
            asked: "two-points".to_owned(),
            command: Some(format!("two-points --draws {draws}")),
            device: None,
            sha256: BTreeMap::from([("population.toml".to_owned(), sha256(DECLARED.as_bytes()))]),
            source: population.source.clone(),
            draws,
            as_declared: (seed, draws) == (population.seed, population.draws),
        },
        conditions: Vec::new(),
        rows: Vec::new(),
        shares: summaries
            .iter()
            .flat_map(|it| it.shares(population))
            .collect(),
        decides: Vec::new(),
        sheets: Vec::new(),
        notes: notes.collect(),
    }
}

/// What is said of every result.
const SIMULATED: &str =
    "Simulated: drawn forearms of assumed parameters; no evidence about people.";

fn people(summaries: &[Summary]) -> String {
    let mut text = Summary::head();
    for summary in summaries {
        text += &format!("\n{}\n{}", summary.line(), summary.below());
    }
    let told = "n: wearers with all numbers; columns: in how many of a hundred each claim holds \
                (host-tool/two_points/population.toml has them in this order).";
    text += &format!("\n{}", in_columns(told, 80));
    text + &format!("\n{SIMULATED}")
}
