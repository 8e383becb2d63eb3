//! Simulates experiments 1 to 3 and the posture experiment (Hamana 2022, III-A to III-C, III-D6) on
//! one participant's forearm: every condition in random order, in several trials.

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

/// Text of the declaration `host-tool/experiments/hamana.toml`.
pub const EXPERIMENTS: &str = include_str!("../../../experiments/hamana.toml");

/// Content of the declaration `hamana.toml`: numbers of trials, thresholds of the claims, and
/// results that the paper prints.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Number of trials of each condition in experiments 1 to 3.
    pub trials: u64,
    /// Number of trials of each condition in the posture experiment.
    pub posture_trials: u64,
    /// Voltage that equation 3 adds to the largest selective voltages, V.
    pub over_v: f64,
    /// Individuation index above which a stimulation counts as selective.
    pub selective: f64,
    /// p below which a difference counts as significant.
    pub significant: f64,
    /// Angle that two points should reach at 45° of pronation, °.
    pub posture_deg: f64,
    /// Results of the paper's statistical tests, with which the simulated ones are compared.
    pub paper: PrintedTests,
}

/// Results of the paper's statistical tests, as printed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedTests {
    /// Tests of experiment 1, which measures individuation.
    pub selectivity: Tests,
    /// Tests of experiment 2, which measures torque.
    pub torque: Tests,
    /// Average torques of one point, conducted and isolated, as fractions of the torque of the
    /// strongest pattern (table 4).
    pub one_point: [f64; 2],
    /// t of the comparison of each two-point pattern with one point (table 5), by pattern number.
    pub table_5: [f64; 14],
}

/// Statistic and p of the two tests that the paper makes in experiments 1 and 2.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tests {
    /// χ² and p of the Friedman test over phase differences.
    pub friedman: [f64; 2],
    /// t and p of conducted against isolated patterns.
    pub isolation: [f64; 2],
}

/// The experiments that are simulated without the device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Experiment {
    /// Experiment 1: individuation.
    Selectivity,
    /// Experiment 2: torque.
    Torque,
    /// Experiment 3: nine intensities.
    Intensities,
    /// Posture experiment (III-D6): pronation.
    Posture,
}

/// Pattern, voltages and pronation of a stimulation.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Condition {
    /// Name in rows and figures.
    pub name: String,
    /// Points that are pulsed, their timing, and their state between pulses.
    pub pattern: Pattern,
    /// Voltages of A and B, V.
    pub volts: [f64; 2],
    /// Pronation of the forearm, °; 0 in the searches for points and voltages.
    pub pronated_deg: f64,
}

/// Measurements of one stimulation.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct StimulationResult {
    /// Index of the condition in [`Experiment::conditions`], from 0.
    pub condition: usize,
    /// Index of the trial, from 0.
    pub trial: u64,
    /// Position in the random order of the trial, from 0.
    pub place: usize,
    /// Isometric torque about the joint of the index finger, N·m.
    pub torque_nm: f64,
    /// Flexion of the free digits from rest as fractions of their ranges, thumb first (equation 2).
    pub flexed: [f64; DIGITS],
    /// Angle of the free index finger, 0 to 100°; a relaxed finger is at 10°.
    pub index_deg: f64,
    /// Individuation index (equation 1); `None` if the paper's rule excludes this stimulation.
    pub individuation: Option<f64>,
}

/// Mixed into the hand's seed for the random order, skin shifts and contraction strengths of a
/// session.
const SESSION: u64 = 0x7123;

impl Protocol {
    /// Parses the declaration `hamana.toml` that is part of the program.
    ///
    /// # Errors
    /// Fails if the declaration cannot be parsed.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        toml::from_str(EXPERIMENTS).map_err(|e| TwoPointsError::Declaration(e.to_string()))
    }

    /// Returns the number of trials of each condition in this experiment.
    #[must_use]
    pub const fn trials_of(&self, experiment: Experiment) -> u64 {
        match experiment {
            Experiment::Posture => self.posture_trials,
            _ => self.trials,
        }
    }
}

impl Experiment {
    /// Returns the conditions of this experiment for a wearer with these voltages. Intensity c of
    /// experiment 3 is missing if `voltages.ratio` is `None`.
    #[must_use]
    pub fn conditions(self, voltages: &Voltages, protocol: &Protocol) -> Vec<Condition> {
        let most_v = voltages.most_v;
        let condition = |pattern: Pattern| Condition {
            name: pattern.in_words(),
            pattern,
            volts: most_v,
            pronated_deg: 0.0,
        };
        match self {
            Self::Selectivity => Pattern::all_two_point()
                .into_iter()
                .map(condition)
                .collect(),
            Self::Torque => {
                let patterns = Pattern::all_two_point()
                    .into_iter()
                    .chain(Pattern::all_one_point());
                patterns.map(condition).collect()
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
                        ..condition(pattern)
                    })
                })
                .collect(),
        }
    }
}

/// Returns the nine intensities of table 6, without c if `voltages.ratio` is `None`. Intensities g
/// to i are `over_v` above the largest voltages.
fn intensities(voltages: &Voltages, over_v: f64) -> Vec<Condition> {
    let (least, most) = (voltages.threshold_v, voltages.most_v);
    let over = most.map(|v| v + over_v);
    let two_points = Pattern::default_two_point();
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
            two_points,
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
        ("f: both at greatest", two_points, Some(most)),
        ("g: A 4 V above", Pattern::isolated_point(A), Some(over)),
        ("h: B 4 V above", Pattern::isolated_point(B), Some(over)),
        ("i: both 4 V above", two_points, Some(over)),
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

/// Returns 0 to `count` − 1 in random order.
fn shuffled(count: usize, random: &mut Random) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    random.shuffle(&mut order);
    order
}

impl Wearer {
    /// Simulates a session of `experiment`: each trial contains each condition once, in random
    /// order.
    ///
    /// # Errors
    /// Fails if the hand's circuit cannot be solved.
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
        let (mut results, mut lay) = (Vec::new(), None);
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
                results.push(StimulationResult {
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
        Ok(results)
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
