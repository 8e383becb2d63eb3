//! `flexor two-points --timing`: measures the computing time of a random forearm.

use super::{Output, interrupt, usage_error};
use host_core::clock::{Clock, ProcessorClock};
use host_core::plot::words::wrap_columns;
use host_core::statistics::mean;
use serde_json::{Value, json};
use std::time::Duration;
use studies::hamana2022::{
    Cell, Experiment, Participants, Population, Protocol, TwoPointsError, Wearer,
};

/// Number of the cell that is measured by default. The study applies its ablations to this cell,
/// with searched voltages.
const CELL: usize = 15;
/// Default number of measured draws.
const DRAWS: u64 = 20;
/// Largest number of draws of one participant, of which the first with stimulation points is used.
const TRIED: u64 = 50;
/// Time that the study allows for one draw, s.
const DRAW_S: f64 = 0.5;
/// Time that the study allows for the paper's four participants with every pattern, s on two cores.
const FOUR_S: f64 = 20.0;

/// Processor time of one draw: the searches of points and voltages, the trials, and experiment 3
/// (intensities).
#[derive(Clone, Copy, Default)]
struct DrawCost {
    searches: Duration,
    trials: Duration,
    intensities: Duration,
}

/// Measured processor time, which other programs do not lengthen.
pub(super) struct Cost {
    cell: Cell,
    draws: Vec<DrawCost>,
    /// Number of draws for which every value was found.
    whole: usize,
    /// Time for the paper's four participants, including draws without points.
    four: DrawCost,
    /// Number of draws searched until each of the four participants had points.
    searched: u64,
    /// Number of stimulations of the four participants.
    stimulations: usize,
}

impl Cost {
    /// Measures and prints the cost for a cell and a number of draws, or for the defaults.
    ///
    /// # Errors
    /// Fails if the declaration is invalid or a hand cannot be built.
    pub(super) fn main(
        (cell, draws): (Option<usize>, Option<u64>),
        seed: u64,
        output: Output,
    ) -> anyhow::Result<()> {
        interrupt::end_at_once()?;
        let population = Population::load_embedded()?;
        let cells = population.cells();
        let number = cell.unwrap_or(CELL);
        let Some(cell) = cells.get(number) else {
            return usage_error(format!(
                "--cell is {number}; allowed: 0 to {}",
                cells.len().saturating_sub(1)
            ));
        };
        let draws = draws.unwrap_or(DRAWS);
        let bar = output.bar("two-points");
        let cost = Self::measure(&population, cell, (seed, draws), |part| bar.set(part));
        bar.finish();
        let cost = cost?;
        output.print(|| cost.to_text(), || cost.to_json())
    }

    fn measure(
        population: &Population,
        cell: &Cell,
        (seed, draws): (u64, u64),
        progress: impl Fn(f64),
    ) -> Result<Self, TwoPointsError> {
        let mut cost = Self {
            cell: cell.clone(),
            draws: Vec::new(),
            whole: 0,
            four: DrawCost::default(),
            searched: 0,
            stimulations: 0,
        };
        for index in 0..draws {
            cost.measure_draw(population, seed, index)?;
            progress(0.5 * (index + 1) as f64 / draws as f64);
        }
        cost.measure_participants(population, |part| progress(0.5 + 0.5 * part))?;
        Ok(cost)
    }

    /// Measures the time of one draw of the study, and of experiment 3 with the same wearer.
    fn measure_draw(
        &mut self,
        population: &Population,
        seed: u64,
        index: u64,
    ) -> Result<(), TwoPointsError> {
        let (cell, protocol) = (&self.cell, Protocol::load_embedded()?);
        let mut spent = DrawCost::default();
        let searched = timed(&mut spent.searches, || {
            population.prepare_wearer(cell, seed, index)
        })?;
        if let Ok(prepared) = searched {
            let wearer = Wearer {
                hand: prepared.hand.clone(),
                voltages: prepared.voltages,
                extensor_v: None, // experiment 3 does not use the extensor
            };
            timed(&mut spent.intensities, || {
                wearer.run_session(population, &protocol, Experiment::Intensities)
            })?;
            timed(&mut spent.trials, || {
                population.measure_patterns(cell, prepared)
            })?;
            self.whole += 1;
        }
        self.draws.push(spent);
        Ok(())
    }

    /// Measures the time of the paper's four participants, once each, with every pattern of
    /// experiment 2.
    fn measure_participants(
        &mut self,
        population: &Population,
        progress: impl Fn(f64),
    ) -> Result<(), TwoPointsError> {
        let (protocol, participants) = (Protocol::load_embedded()?, Participants::load(None)?);
        let count = participants.all.len() as f64;
        for (nth, participant) in participants.all.iter().enumerate() {
            for draw in 0..TRIED {
                self.searched += 1;
                let drawn = timed(&mut self.four.searches, || {
                    participants.draw(participant, population, (participants.seed, draw))
                })?;
                let Ok(wearer) = drawn else { continue };
                let stimulations = timed(&mut self.four.trials, || {
                    wearer.run_session(population, &protocol, Experiment::Torque)
                })?;
                self.stimulations += stimulations.len();
                break;
            }
            progress((nth + 1) as f64 / count);
        }
        Ok(())
    }

    /// Returns mean and maximum, over the draws, of the time that `duration` selects, s.
    fn mean_and_max_s(&self, duration: impl Fn(&DrawCost) -> Duration) -> [f64; 2] {
        let times_s: Vec<f64> = self
            .draws
            .iter()
            .map(|cost| duration(cost).as_secs_f64())
            .collect();
        [
            mean(&times_s).unwrap_or(f64::NAN),
            times_s.iter().copied().fold(0.0, f64::max),
        ]
    }

    /// Returns the name of each part of a draw (searches, trials, experiment 3, and their sum),
    /// with the mean and the maximum of its time, s.
    fn parts(&self) -> [(&'static str, [f64; 2]); 4] {
        [
            ("searches", self.mean_and_max_s(|cost| cost.searches)),
            ("trials", self.mean_and_max_s(|cost| cost.trials)),
            ("intensities", self.mean_and_max_s(|cost| cost.intensities)),
            (
                "all",
                self.mean_and_max_s(|cost| cost.searches + cost.trials + cost.intensities),
            ),
        ]
    }

    /// Formats the results in at most 80 columns.
    fn to_text(&self) -> String {
        let head = format!(
            "{} draws of `{}`; {} of them have every value",
            self.draws.len(),
            self.cell.name(),
            self.whole
        );
        let mut text = format!(
            "{head}\n{:<52}{:>9}{:>9}\n",
            "seconds on one core", "mean", "max"
        );
        let meaning = [
            "searches: points, thresholds, largest voltages, r",
            "trials: 29 patterns, 5 times each, and postures",
            "experiment 3: nine intensities, 5 times each",
            "the whole draw",
        ];
        for ((_, [mean, most]), meaning) in self.parts().into_iter().zip(meaning) {
            text += &format!("{meaning:<52}{mean:>9.3}{most:>9.3}\n");
        }
        let DrawCost {
            searches, trials, ..
        } = self.four;
        let (count, searched) = (self.stimulations, self.searched);
        text += &format!("\n{:<52}{:>9}\n", "P to S, seconds on one core", "total");
        for (label, spent) in [
            (
                format!("searches of {searched} draws, until each has points"),
                searches,
            ),
            (
                format!("29 patterns, 5 times each: {count} stimulations"),
                trials,
            ),
        ] {
            text += &format!("{label:<52}{:>9.3}\n", spent.as_secs_f64());
        }
        let budget = format!(
            "Budget: {DRAW_S} s for a draw, {FOUR_S} s for the patterns of all four on two cores. \
             These are processor times of this computer; no result depends on them."
        );
        text + "\n" + &wrap_columns(&budget, 80)
    }

    fn to_json(&self) -> Value {
        let parts = self.parts().into_iter();
        let parts = parts.map(|(name, [mean, most])| {
            (name.to_owned(), json!({ "mean_s": mean, "most_s": most }))
        });
        let DrawCost {
            searches, trials, ..
        } = self.four;
        json!({ "timing": {
            "cell": self.cell.name(), "draws": self.draws.len(), "whole": self.whole,
            "draw": parts.collect::<serde_json::Map<_, _>>(),
            "wearers": {
                "searched": self.searched, "searches_s": searches.as_secs_f64(),
                "stimulations": self.stimulations, "trials_s": trials.as_secs_f64(),
            },
        } })
    }
}

/// Adds the processor time of `work` to `spent`.
fn timed<T>(spent: &mut Duration, work: impl FnOnce() -> T) -> T {
    let clock = ProcessorClock::start();
    let done = work();
    *spent += clock.now();
    done
}
