//! Experiments 1 to 3 and the one on posture (Hamana 2022, III-A to III-C, III-D6) on one
//! participant's forearm: every condition in random order, some trials.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::population::Population;
use super::voltages::Voltages;
use super::wearers::Wearer;
use hal_sim::body::hand::digits::{INDEX, normalised};
use hal_sim::body::hand::pools::DIGITS;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::random::{Random, standard_normal, word};
use serde::{Deserialize, Serialize};

/// `two_points/experiments.toml`.
pub const EXPERIMENTS: &str = include_str!("../../../experiments/hamana.toml");

/// What of the experiments was declared.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Trials of each condition.
    pub trials: u64,
    /// The same of each posture.
    pub posture_trials: u64,
    /// Equation 3: above the greatest selective voltage, V.
    pub over_v: f64,
    /// Individuation index that is called selective.
    pub selective: f64,
    /// p below which a difference is called significant.
    pub significant: f64,
    /// By how much two points bend at 45°, °.
    pub posture_deg: f64,
    /// What is printed.
    pub paper: PrintedTests,
}

/// What the paper printed of its tests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedTests {
    /// Of experiment 1.
    pub selectivity: Tests,
    /// Of experiment 2.
    pub torque: Tests,
    /// Table 4: averages of one point, conducted and isolated.
    pub one_point: [f64; 2],
    /// Table 5: t of each pattern against one point.
    pub table_5: [f64; 14],
}

/// A statistic and its p, each.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tests {
    /// χ² over phase differences.
    pub friedman: [f64; 2],
    /// t of conducted against isolated.
    pub isolation: [f64; 2],
}

/// Which experiment.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Experiment {
    /// 1: individuation.
    Selectivity,
    /// 2: torque.
    Torque,
    /// 3: nine intensities.
    Intensities,
    /// III-D6: pronation.
    Posture,
}

/// What is stimulated, and how the arm lies.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Condition {
    /// For people.
    pub name: String,
    /// Of pulses.
    pub pattern: Pattern,
    /// Of A and B, V.
    pub volts: [f64; 2],
    /// Of the forearm.
    pub pronated_deg: f64,
}

/// One stimulation.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct StimulationResult {
    /// Which condition, from 0.
    pub condition: usize,
    /// Which trial, from 0.
    pub trial: u64,
    /// Which of its trial, from 0.
    pub place: usize,
    /// Isometric torque about the index finger's joint, N·m.
    pub torque_nm: f64,
    /// Of free digits above rest, as parts of their ranges (equation 2).
    pub flexed: [f64; DIGITS],
    /// Of the free index finger, °.
    pub index_deg: f64,
    /// Equation 1; `None` where it leaves the trial out.
    pub individuation: Option<f64>,
}

/// Seed of a session's order, skin and strength.
const SESSION: u64 = 0x7123;

impl Protocol {
    /// The program's own.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        toml::from_str(EXPERIMENTS).map_err(|e| TwoPointsError::Declaration(e.to_string()))
    }

    /// Of each condition.
    #[must_use]
    pub const fn trials_of(&self, experiment: Experiment) -> u64 {
        match experiment {
            Experiment::Posture => self.posture_trials,
            _ => self.trials,
        }
    }
}

impl Experiment {
    /// Its conditions in a wearer of these voltages. Where two points bend the finger at
    /// no ratio, the intensity that needs it is missing.
    #[must_use]
    pub fn conditions(self, voltages: &Voltages, protocol: &Protocol) -> Vec<Condition> {
        let most_v = voltages.most_v;
        let of = |pattern: Pattern| Condition {
            name: pattern.in_words(),
            pattern,
            volts: most_v,
            pronated_deg: 0.0,
        };
        match self {
            Self::Selectivity => Pattern::all_two_point().into_iter().map(of).collect(),
            Self::Torque => {
                let all = Pattern::all_two_point()
                    .into_iter()
                    .chain(Pattern::all_one_point());
                all.map(of).collect()
            }
            Self::Intensities => intensities(voltages, protocol.over_v),
            Self::Posture => [0.0, 45.0, 90.0]
                .into_iter()
                .flat_map(|pronated_deg| {
                    [
                        Pattern::isolated_point(A),
                        Pattern::isolated_point(B),
                        Pattern::default_two_point(),
                    ]
                    .map(|pattern| Condition {
                        name: format!("{}, {pronated_deg}°", pattern.in_words()),
                        pronated_deg,
                        ..of(pattern)
                    })
                })
                .collect(),
        }
    }
}

/// Table 6.
fn intensities(voltages: &Voltages, over_v: f64) -> Vec<Condition> {
    let (least, most) = (voltages.threshold_v, voltages.most_v);
    let over = most.map(|v| v + over_v);
    let both = Pattern::default_two_point();
    let rows = [
        (
            "a: A at its threshold",
            Pattern::isolated_point(A),
            Some(least),
        ),
        (
            "b: B at its threshold",
            Pattern::isolated_point(B),
            Some(least),
        ),
        (
            "c: both at r_th of greatest",
            both,
            voltages.ratio.map(|r| most.map(|v| r * v)),
        ),
        (
            "d: A at its greatest",
            Pattern::isolated_point(A),
            Some(most),
        ),
        (
            "e: B at its greatest",
            Pattern::isolated_point(B),
            Some(most),
        ),
        ("f: both at greatest", both, Some(most)),
        ("g: A 4 V above", Pattern::isolated_point(A), Some(over)),
        ("h: B 4 V above", Pattern::isolated_point(B), Some(over)),
        ("i: both 4 V above", both, Some(over)),
    ];
    let rows = rows.into_iter();
    rows.filter_map(|(name, pattern, volts)| {
        Some(Condition {
            name: name.to_owned(),
            pattern,
            volts: volts?,
            pronated_deg: 0.0,
        })
    })
    .collect()
}

/// 0 to `count`, in random order.
fn shuffled(count: usize, random: &mut Random) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    random.shuffle(&mut all);
    all
}

impl Wearer {
    /// A session of `experiment`: all trials, each condition once in each, in random
    /// order.
    ///
    /// # Errors
    /// The hand's circuit cannot be solved.
    pub fn run_session(
        &self,
        population: &Population,
        protocol: &Protocol,
        experiment: Experiment,
    ) -> Result<Vec<StimulationResult>, TwoPointsError> {
        let conditions = experiment.conditions(&self.voltages, protocol);
        let seed = word(self.hand.spec().seed ^ SESSION, experiment as u64);
        let (mut random, mut hand) = (Random::new(seed), self.hand.clone());
        let normal = |index: u64| standard_normal(seed, index);
        let (mut all, mut lay) = (Vec::new(), None);
        for trial in 0..protocol.trials_of(experiment) {
            let jitter = |axis| 1e-3 * population.jitter_mm * normal(2 * trial + axis);
            let jitter = [jitter(0), jitter(1)];
            for (place, index) in shuffled(conditions.len(), &mut random)
                .into_iter()
                .enumerate()
            {
                let condition = &conditions[index];
                let number = trial * conditions.len() as u64 + place as u64;
                let strength = 1.0 + population.force_noise * standard_normal(!seed, number);
                let lies = Some((trial, condition.pronated_deg));
                if lay != lies {
                    hand.shift(condition.pronated_deg, jitter);
                    lay = lies;
                }
                let period = condition.pattern.period(condition.volts);
                let response = hand.respond(&period)?.scaled(strength.max(0.0));
                let angles_deg = response.angles_deg();
                all.push(StimulationResult {
                    condition: index,
                    trial,
                    place,
                    torque_nm: response.index_nm(),
                    flexed: normalised(&angles_deg),
                    index_deg: angles_deg[INDEX],
                    individuation: response.individuation(),
                });
            }
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_has_everything_once() {
        let mut random = Random::new(3);
        let (first, second) = (shuffled(29, &mut random), shuffled(29, &mut random));
        assert_ne!(first, second);
        for mut order in [first, second] {
            order.sort_unstable();
            assert_eq!(order, (0..29).collect::<Vec<_>>());
        }
    }

    #[test]
    fn conditions_are_the_paper_s() {
        let protocol = Protocol::load_embedded().unwrap();
        let mut voltages = Voltages {
            threshold_v: [24.0, 28.0],
            most_v: [28.0, 36.0],
            ratio: Some(0.7),
        };
        let count = |experiment: Experiment, voltages: &Voltages| {
            experiment.conditions(voltages, &protocol).len()
        };
        assert_eq!(count(Experiment::Selectivity, &voltages), 25);
        assert_eq!(count(Experiment::Torque, &voltages), 29);
        assert_eq!(count(Experiment::Posture, &voltages), 9);
        let nine = Experiment::Intensities.conditions(&voltages, &protocol);
        assert_eq!(nine[8].volts, [32.0, 40.0], "equation 3");
        assert!((nine[2].volts[0] - 19.6).abs() < 1e-12, "table 6 (c)");
        voltages.ratio = None;
        assert_eq!(count(Experiment::Intensities, &voltages), 8);
    }
}
