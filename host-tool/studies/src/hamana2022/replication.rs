//! Evaluates a replication of experiment 1 or 2 (Hamana 2022, III-A4 and III-B2): averages of the
//! patterns over the participants, and the paper's tests.

use super::experiments::{Condition, Experiment, StimulationResult};
use super::pattern::Points;
use hal_sim::body::hand::spec::{A, B};
use host_core::statistics::{friedman, mean, paired_t};
use serde::{Deserialize, Serialize};

/// Number of patterns in figure 5.
pub const PATTERNS: usize = 14;
/// Numbers of the conducted patterns by rising phase difference. Each of the last four is followed
/// by its isolated counterpart.
pub const CONDUCTED: [usize; 10] = [0, 1, 2, 3, 4, 5, 6, 8, 10, 12];

/// Averages of one participant in one session.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Averages {
    /// Mean of each pattern over the trials, by the number in figure 5: the individuation index in
    /// experiment 1; the torque in experiment 2, as a fraction of that of the strongest pattern.
    /// `None` if every trial was left out.
    pub patterns: [Option<f64>; PATTERNS],
    /// Mean torque of one point, conducted and isolated, as a fraction of that of the strongest
    /// pattern: in each case that of A or B, whichever is larger. `None` in experiment 1.
    pub one_point: Option<[f64; 2]>,
    /// Mean torques of A conducted, A isolated, B conducted and B isolated, as fractions of that of
    /// the strongest pattern (table 4). `None` in experiment 1.
    pub points: [Option<f64>; 4],
    /// Number of stimulations that the paper's rule leaves out; always 0 in experiment 2.
    pub left_out: usize,
    /// Number of all stimulations of the session, including those left out.
    pub of: usize,
}

/// Statistic and p of a test; `None` if the data do not allow the test.
pub type Test = Option<[f64; 2]>;

/// Averages and tests over the participants of one draw.
#[derive(Clone, PartialEq, Debug)]
pub struct Replication {
    /// Averages of the patterns over participants.
    pub patterns: [Option<f64>; PATTERNS],
    /// Averages of one point over participants, conducted and isolated.
    pub one_point: Option<[f64; 2]>,
    /// Friedman test over the conducted phase differences: χ² and p.
    pub friedman: Test,
    /// Paired t-test of conducted against isolated, over the four phase differences that have both.
    pub isolation: Test,
    /// Paired t-tests of each pattern against one conducted point, over participants (table 5).
    pub table_5: [Test; PATTERNS],
    /// Number of participants.
    pub n: usize,
}

impl Averages {
    /// Computes the averages of a session of experiment 1 or 2.
    #[must_use]
    pub fn from_session(
        experiment: Experiment,
        conditions: &[Condition],
        results: &[StimulationResult],
    ) -> Self {
        let value = |stimulation: &StimulationResult| match experiment {
            Experiment::Torque => Some(stimulation.torque_nm),
            _ => stimulation.individuation,
        };
        let condition_mean = |is: &dyn Fn(&Condition) -> bool| {
            let own_results = results
                .iter()
                .filter(|stimulation| is(&conditions[stimulation.condition]));
            mean(own_results.filter_map(value))
        };
        let mut patterns: [Option<f64>; PATTERNS] = std::array::from_fn(|number| {
            condition_mean(&|condition| condition.pattern.number() == Some(number))
        });
        let alone = |point, isolated| {
            condition_mean(&|condition| {
                condition.pattern.points == Points::One(point)
                    && condition.pattern.isolated == isolated
            })
        };
        let mut points = [(A, false), (A, true), (B, false), (B, true)].map(|(p, i)| alone(p, i));
        let maximum = |at: [usize; 2]| at.iter().filter_map(|&at| points[at]).reduce(f64::max);
        let mut one_point = maximum([0, 2]).zip(maximum([1, 3])).map(|(c, i)| [c, i]);
        if experiment == Experiment::Torque {
            let greatest = patterns.into_iter().flatten().fold(0.0, f64::max);
            let part = |value: f64| (greatest > 0.0).then(|| value / greatest);
            patterns = patterns.map(|pattern| pattern.and_then(part));
            one_point = one_point.and_then(|[c, i]| Some([part(c)?, part(i)?]));
            points = points.map(|point| point.and_then(part));
        }
        Self {
            patterns,
            one_point,
            points,
            left_out: results
                .iter()
                .filter(|stimulation| value(stimulation).is_none())
                .count(),
            of: results.len(),
        }
    }
}

impl Replication {
    /// Computes the averages and tests over these participants of one draw.
    #[must_use]
    pub fn from_averages(participants: &[Averages]) -> Self {
        let patterns = std::array::from_fn(|number| {
            mean(
                participants
                    .iter()
                    .filter_map(|averages| averages.patterns[number]),
            )
        });
        let pick = |measure: &dyn Fn(&Averages) -> Option<f64>| {
            mean(participants.iter().filter_map(measure))
        };
        let one_point_mean = |place: usize| {
            pick(&move |averages: &Averages| averages.one_point.map(|pair| pair[place]))
        };
        let subjects: Vec<Vec<f64>> = participants
            .iter()
            .filter_map(|averages| CONDUCTED.iter().map(|&n| averages.patterns[n]).collect())
            .collect();
        let friedman = friedman(&subjects)
            .ok()
            .map(|friedman| [friedman.chi_squared, friedman.p]);
        let late = |isolated: usize| {
            let numbers = [6, 8, 10, 12].map(|number| patterns[number + isolated]);
            numbers.into_iter().collect::<Option<Vec<f64>>>()
        };
        let isolation = late(0)
            .zip(late(1))
            .and_then(|(conducted, isolated)| paired_test(&conducted, &isolated));
        let table_5 = std::array::from_fn(|number| {
            let pairs = participants.iter().filter_map(|averages| {
                let [conducted, _] = averages.one_point?;
                Some((averages.patterns[number]?, conducted))
            });
            let (two, one_point): (Vec<f64>, Vec<f64>) = pairs.unzip();
            paired_test(&two, &one_point)
        });
        Self {
            patterns,
            one_point: one_point_mean(0)
                .zip(one_point_mean(1))
                .map(|(c, i)| [c, i]),
            friedman,
            isolation,
            table_5,
            n: participants.len(),
        }
    }
}

fn paired_test(first: &[f64], second: &[f64]) -> Test {
    paired_t(first, second)
        .ok()
        .map(|paired_t| [paired_t.t, paired_t.p])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn averages(value: impl Fn(usize) -> f64) -> Averages {
        Averages {
            patterns: std::array::from_fn(|number| Some(value(number))),
            one_point: Some([0.3, 0.2]),
            points: [None; 4],
            left_out: 0,
            of: 25,
        }
    }

    #[test]
    fn tests_are_of_what_the_paper_says() {
        // All participants rank the conducted patterns equally, so χ² is n (k - 1).
        let participants = [1.0, 2.0, 3.0].map(|by| averages(|number| by + 0.01 * number as f64));
        let replication = Replication::from_averages(&participants);
        let [chi_squared, _] = replication.friedman.unwrap();
        assert!((chi_squared - 27.0).abs() < 1e-9, "{chi_squared}");
        // The differences between conducted and isolated patterns vary with the phase difference; t
        // follows from their mean and standard deviation.
        let apart = Replication::from_averages(&[
            averages(|number| 0.1 * (number % 3) as f64),
            averages(|number| 0.01 * number as f64),
        ]);
        let means = |number: usize| apart.patterns[number].unwrap();
        let differences = [6, 8, 10, 12].map(|n| means(n) - means(n + 1));
        let mean = differences.iter().sum::<f64>() / 4.0;
        let spread = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / 3.0;
        let [t, _] = apart.isolation.unwrap();
        assert!((t - mean / (spread / 4.0).sqrt()).abs() < 1e-9, "{t}");
        let [conducted, isolated] = replication.one_point.unwrap();
        assert!((conducted - 0.3).abs() < 1e-12 && (isolated - 0.2).abs() < 1e-12);
        let mut gone = averages(|_| 1.0);
        gone.patterns[3] = None;
        let few = Replication::from_averages(&[gone, averages(|n| n as f64)]);
        assert_eq!(few.friedman, None, "one whole subject is none");
        assert_eq!(few.table_5[3], None);
        assert_eq!(few.n, 2);
    }
}
