//! Runs the two-point study as a sweep: the wearers of one cell after those of another.

use super::error::TwoPointsError;
use super::population::{DECLARED, Population};
use super::row;
use super::study::{Cell, DrawOutcome};
use super::summary::Summary;
use crate::laboratory::{
    Drawing, LaboratoryError, Outcome, Preregistration, RunProgress, Runnable, Shard, Sweep,
    merge_drawing, run_drawing,
};
use host_core::plot::words::wrap_columns;
use host_core::record::sha256;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Name of the study and of its command.
pub const TWO_POINTS: &str = "two-points";
/// Disclaimer under the printed table and in the notes of the report.
pub const SIMULATED: &str =
    "Simulated: random forearms with assumed parameters; no evidence about people.";
const MEANING: &str = "Ours is the median; low and high are the 5th and 95th percentiles over the \
                       wearers that have points and voltages. They show how bodies differ and are \
                       not a confidence interval. The paper prints no such numbers for a \
                       population.";
const COLUMNS: &str = "n: number of wearers that have all numbers. Columns: percentage of these \
                       wearers for whom each claim holds, in the order of the claims in \
                       host-tool/experiments/hamana-population.toml.";
const COUNTED: &str = "A draw has no numbers if its searches find no two points, no coupling or \
                       no voltages. Its row in draws.csv gives the reason, and the list below \
                       counts such draws. Claims are judged in the other draws only.";

/// The cells of the study that a run computes: all of them, or a single one. A cell is a
/// combination of recruitment rule, return impedance and operating point, applied to many random
/// wearers.
pub struct Cells {
    population: Population,
    all: Vec<Cell>,
    only: Option<usize>,
}

impl Cells {
    /// Loads all preregistered cells, or only cell number `only`, counted from 0. Returns `None` if
    /// there is no cell with this number.
    ///
    /// # Errors
    /// Returns E621 if the declaration cannot be read.
    pub fn load(only: Option<usize>) -> Result<Option<Self>, TwoPointsError> {
        let population = Population::load_embedded()?;
        let mut cells = population.cells();
        if let Some(number) = only {
            match cells.get(number).cloned() {
                Some(cell) => cells = vec![cell],
                None => return Ok(None),
            }
        }
        Ok(Some(Self {
            population,
            all: cells,
            only,
        }))
    }

    /// Loads the cells to which a stored sweep belongs.
    ///
    /// # Errors
    /// Returns E604 if this program does not have these cells, and E621 if the declaration cannot
    /// be read.
    pub fn from_sweep(sweep: &Sweep) -> Result<Self, TwoPointsError> {
        let every = Population::load_embedded()?.cells().len();
        for only in std::iter::once(None).chain((0..every).map(Some)) {
            if let Some(cells) = Self::load(only)?
                && cells.subset() == sweep.only
            {
                return Ok(cells);
            }
        }
        let only = sweep.only.as_deref().unwrap_or_default();
        let why = format!("they belong to {only}, which this version of the program does not have");
        Err(LaboratoryError::Merge(why).into())
    }

    /// Returns the number of cells that the run computes: 1 if a single cell was chosen.
    #[must_use]
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// Returns the preregistered population: the random ranges of the wearers, and the claims that
    /// are judged for them.
    #[must_use]
    pub const fn population(&self) -> &Population {
        &self.population
    }

    /// Summarises the cells in their order, up to the first cell of which a wearer is not yet
    /// computed. `units` has the computed wearers by unit number; each cell has `draws` wearers.
    #[must_use]
    pub fn summaries(&self, draws: u64, units: &BTreeMap<u64, DrawOutcome>) -> Vec<Summary> {
        let cells = self.all.iter().zip(0..);
        let summary = |(cell, nth): (&Cell, u64)| {
            let own = units.range(nth * draws..(nth + 1) * draws);
            let drawn: Vec<DrawOutcome> = own.map(|(_, drawn)| drawn.clone()).collect();
            let cell = cell.clone();
            (drawn.len() as u64 == draws).then_some(Summary { cell, drawn })
        };
        cells.map_while(summary).collect()
    }

    /// Returns the cell of a unit and the index of the wearer in that cell. There is no cell if the
    /// sweep has fewer units.
    fn place(&self, draws: u64, unit: u64) -> (Option<&Cell>, u64) {
        let nth = usize::try_from(unit / draws.max(1)).unwrap_or(usize::MAX);
        (self.all.get(nth), unit % draws.max(1))
    }

    /// Returns the command line that repeats the sweep, without its seed.
    fn command(&self, draws: u64) -> String {
        let only = self.only.map(|number| format!(" --cell {number}"));
        format!("{TWO_POINTS}{} --draws {draws}", only.unwrap_or_default())
    }

    fn notes(&self, summaries: &[Summary]) -> Vec<String> {
        let ranges = self.population.ranges.iter().map(|range| {
            let (field, low, high, source) = (&range.field, range.low, range.high, &range.source);
            format!("Random range: {field} from {low} to {high} ({source}).")
        });
        let missing = summaries.iter().map(|summary| {
            let (name, missing, draws) =
                (summary.cell.name(), summary.missing(), summary.drawn.len());
            format!("{name}, {draws} draws: {missing}.")
        });
        let statements = [SIMULATED, MEANING, COUNTED].map(str::to_owned);
        statements
            .into_iter()
            .chain(ranges)
            .chain(missing)
            .collect()
    }
}

impl Drawing for Cells {
    type Unit = DrawOutcome;
    type Error = TwoPointsError;

    fn name(&self) -> &str {
        TWO_POINTS
    }

    fn subset(&self) -> Option<String> {
        let (number, cell) = self.only.zip(self.all.first())?;
        Some(format!("cell {number} ({})", cell.name()))
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        BTreeMap::from([("population.toml".to_owned(), sha256(DECLARED.as_bytes()))])
    }

    fn declaration(&self) -> &str {
        DECLARED
    }

    fn columns(&self) -> Vec<String> {
        let place = ["unit", "cell", "wearer"].map(str::to_owned);
        let drawn = self
            .population
            .ranges
            .iter()
            .map(|range| range.field.clone());
        let own = row::columns(&self.population);
        place.into_iter().chain(drawn).chain(own).collect()
    }

    fn units(&self, draws: u64) -> u64 {
        self.all.len() as u64 * draws
    }

    fn rows_per_unit(&self) -> usize {
        1
    }

    fn row_prefixes(&self, sweep: &Sweep, unit: u64) -> Vec<String> {
        let (cell, wearer) = self.place(sweep.draws, unit);
        let cell = cell.map(Cell::name).unwrap_or_default();
        let drawn = self.population.draw_values(sweep.seed, wearer).into_iter();
        let drawn: String = drawn.map(|value| format!(",{value}")).collect();
        vec![format!("{unit},{cell},{wearer}{drawn}")]
    }

    fn compute(
        &self,
        sweep: &Sweep,
        unit: u64,
        _: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<DrawOutcome>, TwoPointsError> {
        match self.place(sweep.draws, unit) {
            (Some(cell), wearer) => self.population.draw(cell, sweep.seed, wearer).map(Some),
            (None, _) => {
                let why = format!("the sweep has no unit {unit}");
                Err(TwoPointsError::Declaration(why))
            }
        }
    }

    fn row_suffixes(&self, unit: &DrawOutcome) -> Vec<String> {
        vec![row::format_row(unit, &self.population)]
    }

    fn parse_unit(&self, rest: &[&str]) -> Result<DrawOutcome, (usize, String)> {
        let row = rest.first().copied().unwrap_or_default();
        row::parse_row(row, &self.population).map_err(|mistake| (0, mistake))
    }

    fn outcome(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, DrawOutcome>,
    ) -> Result<Outcome, TwoPointsError> {
        let (seed, draws) = (sweep.seed, sweep.draws);
        let summaries = self.summaries(draws, units);
        let (done, total) = (summaries.len(), self.count());
        let population = &self.population;
        Ok(Outcome {
            name: TWO_POINTS.to_owned(),
            title: population.title.clone(),
            seed,
            simulated: Some(true),
            cut_short: (done < total).then(|| {
                format!(
                    "Cut short: {done} of {total} cells are complete; the cells after them are \
                     missing."
                )
            }),
            declared: Preregistration {
                asked: TWO_POINTS.to_owned(),
                command: Some(self.command(draws)),
                device: None,
                sha256: self.hashes(),
                source: population.source.clone(),
                draws,
                drawn: None,
                as_declared: (seed, draws) == (population.seed, population.draws),
            },
            conditions: Vec::new(),
            rows: summaries.iter().flat_map(Summary::rows).collect(),
            shares: summaries
                .iter()
                .flat_map(|summary| summary.shares(population))
                .collect(),
            decides: Vec::new(),
            sheets: Vec::new(),
            notes: self.notes(&summaries),
        })
    }

    fn progress_text(&self, sweep: &Sweep, done: u64) -> String {
        format!("{done} of {} draws", self.units(sweep.draws))
    }

    fn table(&self, sweep: &Sweep, units: &BTreeMap<u64, DrawOutcome>) -> Option<String> {
        let summaries = self.summaries(sweep.draws, units);
        let lines = summaries
            .iter()
            .map(|summary| format!("\n{}\n{}", summary.line(), summary.details()));
        let table = Summary::head() + &lines.collect::<String>();
        Some(format!(
            "{table}\n{}\n{SIMULATED}",
            wrap_columns(COLUMNS, 80)
        ))
    }
}

/// One run of the study: its cells, its seed and its number of wearers per cell.
pub struct CellsRun {
    cells: Cells,
    seed: u64,
    draws: u64,
}

impl CellsRun {
    /// Creates a run with this seed and this number of wearers per cell. `None` takes the
    /// preregistered value.
    #[must_use]
    pub fn new(cells: Cells, (seed, draws): (Option<u64>, Option<u64>)) -> Self {
        let population = &cells.population;
        let (seed, draws) = (
            seed.unwrap_or(population.seed),
            draws.unwrap_or(population.draws),
        );
        Self { cells, seed, draws }
    }
}

impl Runnable for CellsRun {
    fn sweep(&self, shard: Shard) -> Sweep {
        Sweep::from_drawing(&self.cells, (self.seed, self.draws), shard)
    }

    fn run(
        &self,
        dir: Option<&Path>,
        shard: Shard,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> anyhow::Result<RunProgress> {
        Ok(run_drawing(&self.cells, &self.sweep(shard), dir, go_on)?.0)
    }

    fn merge(&self, parts: &[PathBuf], out: &Path) -> anyhow::Result<RunProgress> {
        Ok(merge_drawing(&self.cells, parts, out)?.0)
    }
}
