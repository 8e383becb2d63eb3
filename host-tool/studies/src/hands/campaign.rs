//! Runs all contenders on the same random hands and computes their scores.

use super::HandsError;
use super::contender::{Contender, Outcome};
use super::drawn::DrivenHand;
use crate::hamana2022::{Participants, Population};
use crate::tracking::statistics::{Interval, paired};
use crate::tracking::wearer::Points;
use host_core::statistics::{mean, quantile};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Plan of a campaign: seed and number of the random hands.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    pub seed: u64,
    /// Number of hands that are generated.
    pub draws: u64,
}

/// Results of all contenders on one hand, with the ranges of angles that the hand can hold.
#[derive(Clone, PartialEq, Debug)]
pub struct Case {
    /// Index of the hand, from 0.
    pub index: u64,
    /// Width of the range of angles that the hand holds with one stimulation point, and with two,
    /// °.
    pub held_deg: [f64; 2],
    /// Width of the range of angles that the hand holds both with one point and with two, °. The
    /// reference is scaled to this range.
    pub holds_deg: f64,
    /// Outcomes with one stimulation point and with two, each in the order of the contenders.
    pub outcomes: [Vec<Outcome>; 2],
}

/// Result of a campaign in which every contender drives every hand.
#[derive(Clone, PartialEq, Debug)]
pub struct Hands {
    /// Seed and number of hands that were asked for.
    pub plan: Plan,
    /// Name of the wearer if all hands are draws of this wearer's forearm; `None` if they come from
    /// the population.
    pub wearer: Option<String>,
    /// Contenders, in the order of all outcomes.
    pub contenders: Vec<Contender>,
    /// Hands that could be driven, in the order of their index.
    pub cases: Vec<Case>,
    /// Number of hands that no controller could drive, by reason. Together with `cases` they are
    /// all hands of the plan.
    pub missing: BTreeMap<&'static str, u64>,
    /// Number of time intervals, over all trials, in which the simulation found no consistent
    /// currents.
    pub unsettled: u64,
}

/// Score of one contender over all hands, with one stimulation point or with two.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Score {
    /// Number of hands on which the device refused the joint or stopped.
    pub refused: usize,
    /// Number of hands on which the contender tracked no better than a finger held still in the
    /// middle of the reference. Refusals are not counted.
    pub no_better: usize,
    /// Mean RMSE over the hands without a refusal, °. NaN if every hand was refused; this also
    /// holds for the following fields.
    pub mean_deg: f64,
    /// 95th percentile of the RMSE over the hands without a refusal, °.
    pub p95_deg: f64,
    /// Mean of the RMSE relative to the width of the range that the hand holds, 0 to 1.
    pub mean_part: f64,
    /// 95th percentile of the RMSE relative to the width of the range that the hand holds.
    pub p95_part: f64,
    /// Mean difference between the RMSE and that of the best PID on the same hand, °, with its 95 %
    /// interval.
    pub over_pid: Interval,
}

fn place(points: Points) -> usize {
    usize::from(points == Points::Two)
}

/// A hand with its outcomes, and its number of time intervals without consistent currents; or the
/// reason why no controller can drive the hand.
type HandOutcomes = Result<(Case, u64), &'static str>;

fn drive(
    (population, whom): (&Population, Option<&Participants>),
    contenders: &[Contender],
    (seed, index): (u64, u64),
) -> Result<HandOutcomes, HandsError> {
    let drawn = match whom {
        None => DrivenHand::draw(population, seed, index),
        Some(whom) => DrivenHand::of_wearer(population, whom, (seed, index)),
    };
    let drawn = match drawn? {
        Ok(drawn) => drawn,
        Err(missing) => return Ok(Err(missing)),
    };
    let mut unsettled = 0;
    let mut outcomes = [Vec::new(), Vec::new()];
    for (way, outcomes) in drawn.ways.iter().zip(&mut outcomes) {
        for contender in contenders {
            let (outcome, without) = contender.attempt(&drawn, way)?;
            outcomes.push(outcome);
            unsettled += without;
        }
    }
    let case = Case {
        index,
        held_deg: drawn.ways.map(|way| way.held_deg[1] - way.held_deg[0]),
        holds_deg: drawn.holds_deg[1] - drawn.holds_deg[0],
        outcomes,
    };
    Ok(Ok((case, unsettled)))
}

impl Hands {
    /// Lets every contender drive every hand, with one stimulation point and with two. The hands
    /// come from the population or, if `whom` is given, are draws of its first person. The same
    /// plan gives bit-identical results on any number of threads.
    ///
    /// # Errors
    /// Fails if the population's declaration cannot be read, or a hand or control law is invalid.
    pub fn run(
        plan: Plan,
        whom: Option<&Participants>,
        contenders: Vec<Contender>,
        mut progress: impl FnMut(f64),
    ) -> Result<Self, HandsError> {
        let population = Population::load_embedded()?;
        let (mut cases, mut missing, mut unsettled) = (Vec::new(), BTreeMap::new(), 0);
        let indices: Vec<u64> = (0..plan.draws).collect();
        let mut done = 0;
        for some in indices.chunks(2 * rayon::current_num_threads()) {
            let driven = some
                .par_iter()
                .map(|index| drive((&population, whom), &contenders, (plan.seed, *index)));
            for driven in driven.collect::<Result<Vec<_>, _>>()? {
                match driven {
                    Ok((case, without)) => {
                        cases.push(case);
                        unsettled += without;
                    }
                    Err(why) => *missing.entry(why).or_insert(0) += 1,
                }
            }
            done += some.len();
            progress(done as f64 / indices.len() as f64);
        }
        let wearer = whom.and_then(|whom| Some(whom.all.first()?.name.clone()));
        Ok(Self {
            plan,
            wearer,
            contenders,
            cases,
            missing,
            unsettled,
        })
    }

    /// Returns the file name of table and picture, without its extension.
    pub fn file_stem(&self) -> String {
        let stem = |name| format!("control_wearer_{name}");
        self.wearer
            .as_ref()
            .map_or("control_hands".to_owned(), stem)
    }

    /// Returns the hands that a contender drove without a refusal, each with its RMSE, °.
    pub fn tracked(&self, points: Points, contender: usize) -> Vec<(&Case, f64)> {
        let rmse = |case: &Case| {
            let outcome = &case.outcomes[place(points)][contender];
            outcome.refused.is_none().then_some(outcome.rmse_deg)
        };
        let cases = self.cases.iter();
        cases.filter_map(|case| Some((case, rmse(case)?))).collect()
    }

    /// Returns the index of the PID contender with the smallest mean RMSE, or 0 if there is no PID.
    pub fn best_pid(&self, points: Points) -> usize {
        let mean_rmse = |n: &usize| {
            let tracked = self.tracked(points, *n);
            mean(tracked.iter().map(|pair| pair.1)).unwrap_or(f64::NAN)
        };
        let pids = (0..self.contenders.len()).filter(|n| self.contenders[*n].is_pid());
        pids.min_by(|a, b| mean_rmse(a).total_cmp(&mean_rmse(b)))
            .unwrap_or(0)
    }

    /// Returns the 5th percentile, the median and the 95th percentile of the width of the range
    /// that the hands hold with these points, °.
    pub fn held_range_deg(&self, points: Points) -> [f64; 3] {
        let held = self.cases.iter().map(|case| case.held_deg[place(points)]);
        let held: Vec<f64> = held.collect();
        [0.05, 0.5, 0.95].map(|part| quantile(&held, part).unwrap_or(f64::NAN))
    }

    /// Counts on how many hands a contender was refused, by the reason that the device names.
    pub fn refusals(&self, points: Points, contender: usize) -> BTreeMap<&str, u64> {
        let mut counts = BTreeMap::new();
        for case in &self.cases {
            if let Some(name) = &case.outcomes[place(points)][contender].refused {
                *counts.entry(name.as_str()).or_insert(0) += 1;
            }
        }
        counts
    }

    /// Computes the score of one contender over all hands that it drove without a refusal.
    pub fn score(&self, points: Points, contender: usize) -> Score {
        let tracked = self.tracked(points, contender);
        let errors: Vec<f64> = tracked.iter().map(|pair| pair.1).collect();
        let parts = tracked.iter().map(|(case, rmse)| rmse / case.holds_deg);
        let parts: Vec<f64> = parts.collect();
        let pid = self.best_pid(points);
        // Compares only hands on which neither was refused.
        let pairs = tracked.iter().filter_map(|(case, rmse)| {
            let pid = &case.outcomes[place(points)][pid];
            pid.refused.is_none().then_some((*rmse, pid.rmse_deg))
        });
        let (ours, theirs): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let is_no_better =
            |(case, rmse): &&(&Case, f64)| *rmse >= DrivenHand::STILL * case.holds_deg;
        let nothing = Interval {
            mean: f64::NAN,
            low: f64::NAN,
            high: f64::NAN,
        };
        let number_or_nan = |number: Option<f64>| number.unwrap_or(f64::NAN);
        Score {
            refused: self.cases.len() - tracked.len(),
            no_better: tracked.iter().filter(is_no_better).count(),
            mean_deg: number_or_nan(mean(&errors)),
            p95_deg: number_or_nan(quantile(&errors, 0.95)),
            mean_part: number_or_nan(mean(&parts)),
            p95_part: number_or_nan(quantile(&parts, 0.95)),
            over_pid: match ours.is_empty() {
                true => nothing,
                false => paired(&ours, &theirs),
            },
        }
    }
}
