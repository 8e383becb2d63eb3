//! Simulates experiments 1 and 2 and the posture experiment (Hamana 2022, III-A, III-B, III-D6) on
//! one hand: every pattern in several trials.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::voltages::bent_deg;
use hal_sim::body::hand::Hand;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::random::standard_normal;

/// Number of trials, and the random variation between them.
#[derive(Clone, Copy, Debug)]
pub struct Trials {
    /// Number of trials of each pattern.
    pub count: u64,
    /// Standard deviation of the skin's shift over the muscles between trials, m.
    pub jitter_m: f64,
    /// Relative standard deviation of a contraction's strength between stimulations.
    pub force_noise: f64,
    /// Seed of both random variations.
    pub seed: u64,
}

/// Means of a pattern over its trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    pub pattern: Pattern,
    /// Isometric torque of the index finger, N·m.
    pub torque_nm: f64,
    /// Individuation index; `None` if every trial was left out.
    pub individuation: Option<f64>,
    /// Number of trials that the paper's rule leaves out.
    pub left_out: u64,
}

/// Flexion of the index finger from rest at 0, 45 and 90° of pronation, in degrees.
pub type Postures = [f64; 3];

impl Trials {
    /// Simulates all trials of every pattern at these voltages of A and B, V, and returns the means
    /// of each pattern. Moves the skin back to its position at rest afterwards.
    ///
    /// # Errors
    /// Fails if the hand's circuit cannot be solved.
    pub fn patterns(
        &self,
        hand: &mut Hand,
        volts: [f64; 2],
    ) -> Result<Vec<Outcome>, TwoPointsError> {
        let patterns: Vec<Pattern> = Pattern::all_two_point()
            .into_iter()
            .chain(Pattern::all_one_point())
            .collect();
        let mut sums = vec![(0.0, 0.0, 0u64); patterns.len()];
        for trial in 0..self.count {
            let jitter = |axis| self.jitter_m * standard_normal(self.seed, 2 * trial + axis);
            hand.shift(0.0, [jitter(0), jitter(1)]);
            for (place, (pattern, sum)) in patterns.iter().zip(&mut sums).enumerate() {
                let number = trial * patterns.len() as u64 + place as u64;
                let noise = 1.0 + self.force_noise * standard_normal(!self.seed, number);
                let response = hand.respond(&pattern.period(volts))?.scaled(noise.max(0.0));
                sum.0 += response.index_nm();
                if let Some(individuation) = response.individuation() {
                    sum.1 += individuation;
                    sum.2 += 1;
                }
            }
        }
        hand.shift(0.0, [0.0; 2]);
        let outcomes = patterns
            .into_iter()
            .zip(sums)
            .map(|(pattern, sum)| Outcome {
                pattern,
                torque_nm: sum.0 / self.count as f64,
                individuation: (sum.2 > 0).then(|| sum.1 / sum.2 as f64),
                left_out: self.count - sum.2,
            });
        Ok(outcomes.collect())
    }

    /// Returns how far the index finger bends from rest at each pronation, °: with A or B,
    /// isolated, whichever bends it further at 0°, and with both points in the default pattern.
    ///
    /// # Errors
    /// Fails if the hand's circuit cannot be solved.
    pub fn postures(
        &self,
        hand: &mut Hand,
        volts: [f64; 2],
    ) -> Result<[Postures; 2], TwoPointsError> {
        let at_rest = [
            bent_deg(hand, Pattern::isolated_point(A), volts)?,
            bent_deg(hand, Pattern::isolated_point(B), volts)?,
        ];
        let better = if at_rest[A] >= at_rest[B] { A } else { B };
        let mut bent = [[0.0; 3]; 2];
        for (place, pronated_deg) in [0.0, 45.0, 90.0].into_iter().enumerate() {
            hand.shift(pronated_deg, [0.0; 2]);
            bent[0][place] = bent_deg(hand, Pattern::isolated_point(better), volts)?;
            bent[1][place] = bent_deg(hand, Pattern::default_two_point(), volts)?;
        }
        hand.shift(0.0, [0.0; 2]);
        Ok(bent)
    }
}
