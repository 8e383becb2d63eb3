//! Searches the parameters of the control laws. Every law gets the same seed, the same plants and
//! the same number of evaluations.

use super::TrackingError;
use super::candidate::{Candidate, Equipment, Genome};
use super::default;
use super::driver::{Device, Driver};
use super::exercise::{Exercise, Wearers};
use super::plant::Plant;
use super::target::Course;
use super::trial::run;
use super::wearer::Points;
use hal_sim::body::random_finger::Draws;
use methods::control::Form;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Seed of the training plants and of the search itself. Campaigns refuse it, so that no law is
/// judged on its training plants.
pub const TRAINING_SEED: u64 = 0x7EAC;
/// Number of earlier and number of widened wearers on which every candidate is evaluated, besides
/// the nominal wearer. Each is stimulated at one point and at two.
pub const TRAINING_PLANTS: (u64, u64) = (7, 12);
/// Number of exercises after which the evaluation of a hopeless candidate is stopped. It still
/// counts as an evaluation.
const EARLY_CHECK: usize = 14;
/// Factor by which a candidate's cost must exceed that of the worst parent to be hopeless.
const HOPELESS_FACTOR: f64 = 1.3;
/// Number of best candidates from which the next ones are varied.
const PARENTS: usize = 6;
/// Number of candidates that are evaluated at the same time. It does not depend on the number of
/// cores, because it affects which candidates follow.
const BATCH: usize = 8;

/// The exercises on which all control laws are trained.
#[derive(Debug)]
pub struct Training {
    exercises: Vec<(Wearers, Exercise)>,
}

/// The best candidate that a search found for one control law.
#[derive(Clone, PartialEq, Debug)]
pub struct SearchResult<T> {
    /// The control law with the parameters found.
    pub candidate: T,
    /// Cost of the candidate, °, as [`Training::cost`] defines it.
    pub cost: f64,
}

/// For earlier and for widened wearers: sum of the squared RMSE, °², and number of exercises.
#[derive(Clone, Copy, Default)]
struct Sums([(f64, u32); 2]);

impl Sums {
    fn add(&mut self, wearers: Wearers, rmse: f64) {
        let [earlier, widened] = &mut self.0;
        let (sum, n) = match wearers {
            Wearers::Earlier => earlier,
            Wearers::Widened => widened,
        };
        *sum += rmse.powi(2);
        *n += 1;
    }

    /// Returns the cost, °: the geometric mean of the two quadratic means of the RMSE. Reducing
    /// either of them by one percent has the same effect.
    fn cost(&self) -> f64 {
        let mean = |(sum, n): (f64, u32)| sum / f64::from(n.max(1));
        let [earlier, widened] = self.0.map(mean);
        (earlier * widened).sqrt().sqrt()
    }
}

impl Training {
    /// Creates the training exercises: those of the nominal wearer first, then those of widened and
    /// earlier wearers in turn.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if a plant is not valid.
    pub fn new() -> Result<Self, TrackingError> {
        let (earlier, widened) = TRAINING_PLANTS;
        let nominal = (
            Wearers::Earlier,
            Plant::nominal(TRAINING_SEED),
            Course::Sine,
        );
        let mut plants = vec![nominal];
        for i in 0..earlier.max(widened) {
            for (wearers, count) in [(Wearers::Widened, widened), (Wearers::Earlier, earlier)] {
                if i < count {
                    let course = wearers.course(Course::Sine, TRAINING_SEED, i);
                    plants.push((wearers, wearers.plant(TRAINING_SEED, i), course));
                }
            }
        }
        let mut exercises = Vec::new();
        for (wearers, plant, course) in plants {
            for points in Points::ALL {
                exercises.push((wearers, Exercise::new(plant.clone(), points, course)?));
            }
        }
        Ok(Self { exercises })
    }

    /// Returns the cost of a law, °. It is the geometric mean of two quadratic means of the RMSE,
    /// one over the earlier and one over the widened training plants, each with one point and with
    /// two. Returns infinity as soon as `is_hopeless` holds for the cost of the first exercises.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if the candidate is not a valid law.
    pub fn cost(
        &self,
        driver: impl Fn(Points) -> Result<Box<dyn Driver>, TrackingError>,
        is_hopeless: impl Fn(f64) -> bool,
    ) -> Result<f64, TrackingError> {
        let mut sums = Sums::default();
        for (n, (wearers, exercise)) in self.exercises.iter().enumerate() {
            let mut driver = driver(exercise.points)?;
            let attempt = run(&exercise.plant, &mut *driver, &exercise.wanted)?;
            sums.add(*wearers, exercise.rmse(&attempt.angles));
            if n + 1 == EARLY_CHECK && is_hopeless(sums.cost()) {
                return Ok(f64::INFINITY);
            }
        }
        Ok(sums.cost())
    }

    /// Searches the best parameters of a law in floating point, with exactly `evaluations`
    /// evaluations. `progress` receives the finished part, 0 to 1.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if a candidate is not a valid law.
    pub fn search(
        &self,
        form: Form,
        equipment: Equipment,
        evaluations: usize,
        progress: impl FnMut(f64),
    ) -> Result<Option<SearchResult<Candidate>>, TrackingError> {
        let names: Vec<_> = Genome::parameters().iter().map(|p| p.name).collect();
        let driver = |genome: &Genome, points| -> Result<Box<dyn Driver>, _> {
            Ok(Box::new(
                genome.candidate(form, equipment).driver::<f64>(points)?,
            ))
        };
        let first = Genome::from_default(form);
        let best = self.best(&names, first, driver, evaluations, progress)?;
        Ok(best.map(|(cost, genome)| SearchResult {
            candidate: genome.candidate(form, equipment),
            cost,
        }))
    }

    /// Searches the best parameters, by name, of the default controller in fixed point, with
    /// exactly `evaluations` evaluations. `progress` receives the finished part, 0 to 1.
    ///
    /// # Errors
    /// Returns [`TrackingError`] if the device refuses parameters within their bounds.
    pub fn search_default(
        &self,
        evaluations: usize,
        progress: impl FnMut(f64),
    ) -> Result<Option<SearchResult<BTreeMap<String, f64>>>, TrackingError> {
        let parameters = &default::PARAMETERS;
        let names = parameters.map(|p| p.name);
        let shipped = default::shipped();
        let first = Genome::from_values(|name| shipped.get(name).copied(), parameters);
        let driver = |genome: &Genome, points| -> Result<Box<dyn Driver>, _> {
            let spec = default::joint(&genome.values(parameters), points);
            Ok(Box::new(Device::new(&spec)?))
        };
        let best = self.best(&names, first, driver, evaluations, progress)?;
        Ok(best.map(|(cost, genome)| SearchResult {
            candidate: genome.values(parameters),
            cost,
        }))
    }

    /// Returns the best candidate and its cost. The first candidate is `first`. The rest of the
    /// first third of the evaluations tries random candidates, and all further ones vary the best
    /// candidates less and less. The result does not depend on the order in which the candidates of
    /// a batch are finished.
    fn best(
        &self,
        names: &[&'static str],
        first: Genome,
        driver: impl Fn(&Genome, Points) -> Result<Box<dyn Driver>, TrackingError> + Sync,
        evaluations: usize,
        mut progress: impl FnMut(f64),
    ) -> Result<Option<(f64, Genome)>, TrackingError> {
        let mut draws = Draws::new(TRAINING_SEED, 0, 5);
        let mut best: Vec<(f64, Genome)> = Vec::new();
        let broad = evaluations / 3;
        let mut done = 0;
        while done < evaluations {
            let batch = (evaluations - done).min(BATCH);
            let tried: Vec<Genome> = (done..done + batch)
                .map(|n| {
                    if n == 0 {
                        first.clone()
                    } else if n < broad || best.is_empty() {
                        random_genome(names, &mut draws)
                    } else {
                        let rest = (n - broad) as f64 / (evaluations - broad) as f64;
                        mutated(&best, 0.25 * (1.0 - rest) + 0.03, &mut draws)
                    }
                })
                .collect();
            let hopeless_cost = match best.last() {
                Some((worst, _)) if best.len() == PARENTS => worst * HOPELESS_FACTOR,
                _ => f64::INFINITY,
            };
            let costs = tried.into_par_iter().map(|genome| {
                let cost = self.cost(
                    |points| driver(&genome, points),
                    |cost_so_far| cost_so_far > hopeless_cost,
                )?;
                Ok((cost, genome))
            });
            best.extend(costs.collect::<Result<Vec<_>, TrackingError>>()?);
            best.sort_by(|a, b| a.0.total_cmp(&b.0));
            best.truncate(PARENTS);
            done += batch;
            progress(done as f64 / evaluations as f64);
        }
        Ok(best.into_iter().next())
    }
}

/// Returns a genome in which every position and choice is uniformly random from 0 to 1.
fn random_genome(names: &[&'static str], draws: &mut Draws) -> Genome {
    Genome {
        places: names
            .iter()
            .map(|name| (*name, draws.uniform(0.0, 1.0)))
            .collect(),
        choices: [(); 6].map(|()| draws.uniform(0.0, 1.0)),
    }
}

/// Returns a random variation of one of the parents, with positions changed by up to `spread`.
/// Better parents are chosen more often.
fn mutated(parents: &[(f64, Genome)], spread: f64, draws: &mut Draws) -> Genome {
    let rank = draws.uniform(0.0, 1.0).powi(2) * parents.len() as f64;
    let (_, parent) = &parents[(rank as usize).min(parents.len() - 1)];
    let mut child = parent.clone();
    for place in child.places.values_mut() {
        *place = (*place + draws.uniform(-spread, spread)).clamp(0.0, 1.0);
    }
    for choice in &mut child.choices {
        if draws.uniform(0.0, 1.0) < 0.1 {
            *choice = draws.uniform(0.0, 1.0);
        }
    }
    child
}
