//! Defines the order of an experiment's trials.

use hal_sim::random::word;
use host_core::session::Session;
use serde::Deserialize;

/// Random stream from which the order of the trials is generated.
const ORDER: u64 = 0x1AB2;

/// Protocol of an experiment: the order of its trials, with rests and prompts between them.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Protocol {
    /// Number of blocks of trials; `block_rest_s` separates them.
    pub blocks: usize,
    /// Number of times that each condition occurs in a block.
    pub repetitions: usize,
    /// Order of the trials in a block.
    pub order: Order,
    /// Rest between two trials, s.
    pub rest_s: f64,
    /// Rest between the last trial of a block and the first of the next, s.
    pub block_rest_s: f64,
    /// State of a simulated wearer at the start of a trial.
    pub wearer: Wearer,
    /// Text that is shown before each trial; on a board the operator must confirm it.
    pub prompt: Option<String>,
    /// Limits at which the protocol ends early.
    pub stop: Stop,
}

/// State of a simulated wearer at the start of a trial. On a board it is always the same person.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wearer {
    /// A new, rested wearer at the start of the movement, so that trials do not influence each
    /// other.
    #[default]
    Rested,
    /// The same wearer, as tired as the previous trials and rests have left them.
    Same,
}

/// Order of the trials in a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// The order in which the declaration lists the conditions.
    #[default]
    Listed,
    /// A random order for each block, which depends on the seed.
    Random,
}

/// Limits whose crossing ends a protocol before its last trial. A fault, a refusal or a signal
/// always ends it.
#[derive(Clone, Copy, PartialEq, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Stop {
    /// Largest allowed measured angle, °.
    pub angle_above_deg: Option<f64>,
    /// Smallest allowed measured angle, °.
    pub angle_below_deg: Option<f64>,
    /// Largest allowed predicted force, N.
    pub force_above_n: Option<f64>,
}

impl Stop {
    /// Returns the names of the stop limits that can never be crossed in this session, each with
    /// the measurement that is missing.
    pub(super) fn unusable_criteria(&self, session: &Session) -> Vec<(&'static str, &'static str)> {
        let has_angle = session.joint.is_some() || session.wall.is_some();
        let has_force = session
            .channels
            .iter()
            .any(|channel| channel.muscle.is_some());
        let angle = "measured angle (its session has neither `joint` nor `wall`)";
        let force = "predicted force (no channel of its session has a `muscle`)";
        [
            ("angle_above_deg", self.angle_above_deg, has_angle, angle),
            ("angle_below_deg", self.angle_below_deg, has_angle, angle),
            ("force_above_n", self.force_above_n, has_force, force),
        ]
        .into_iter()
        .filter(|(_, limit, is_there, _)| limit.is_some() && !is_there)
        .map(|(name, _, _, quantity)| (name, quantity))
        .collect()
    }
}

impl Default for Protocol {
    fn default() -> Self {
        Self {
            blocks: 1,
            repetitions: 1,
            order: Order::default(),
            rest_s: 0.0,
            block_rest_s: 0.0,
            wearer: Wearer::default(),
            prompt: None,
            stop: Stop::default(),
        }
    }
}

/// What happens next in a protocol.
#[derive(Clone, PartialEq, Debug)]
pub enum Step {
    /// A rest without stimulation, s.
    Rest(f64),
    /// A text that the operator confirms.
    Prompt(String),
    /// A trial, at this position in the protocol.
    Trial(Place),
}

/// Position of a trial in a protocol.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Place {
    /// Index of the block, from 0.
    pub block: usize,
    /// Number of earlier trials of the same condition in this block.
    pub repetition: usize,
    /// Index of the condition, from 0.
    pub condition: usize,
}

impl Protocol {
    /// Returns the number of trials that each condition has in the whole protocol.
    #[must_use]
    pub const fn rounds(&self) -> usize {
        self.blocks.saturating_mul(self.repetitions)
    }

    /// Returns all steps of the protocol for this number of conditions; `seed` determines a random
    /// order.
    #[must_use]
    pub fn steps(&self, conditions: usize, seed: u64) -> Vec<Step> {
        let mut steps = Vec::new();
        for block in 0..self.blocks {
            for place in self.block(block, conditions, seed) {
                let is_first_of_block = !matches!(steps.last(), Some(Step::Trial(before))
                    if before.block == block);
                let rest_s = match (steps.is_empty(), is_first_of_block) {
                    (true, _) => 0.0,
                    (false, true) => self.block_rest_s.max(self.rest_s),
                    (false, false) => self.rest_s,
                };
                if rest_s > 0.0 {
                    steps.push(Step::Rest(rest_s));
                }
                steps.extend(self.prompt.clone().map(Step::Prompt));
                steps.push(Step::Trial(place));
            }
        }
        steps
    }

    /// Returns the trials of a block in the order in which they run.
    fn block(&self, block: usize, conditions: usize, seed: u64) -> Vec<Place> {
        let rounds = 0..self.repetitions;
        let place = |repetition, condition| Place {
            block,
            repetition,
            condition,
        };
        let places = rounds.flat_map(|r| (0..conditions).map(move |c| place(r, c)));
        let mut places: Vec<Place> = places.collect();
        if self.order == Order::Random {
            // Fisher–Yates shuffle, from the last element on.
            let stream = word(word(seed, ORDER), block as u64);
            for last in (1..places.len()).rev() {
                let other = word(stream, last as u64) % (last as u64 + 1);
                places.swap(last, other as usize);
            }
        }
        places
    }

    /// Returns a message for every invalid setting.
    pub(super) fn mistakes(&self) -> Vec<String> {
        let mut mistakes = Vec::new();
        if self.blocks == 0 || self.repetitions == 0 {
            let message = "protocol: a block is empty; blocks and repetitions must be 1 or more";
            mistakes.push(message.to_owned());
        }
        for (name, rest_s) in [("rest_s", self.rest_s), ("block_rest_s", self.block_rest_s)] {
            if !(0.0..=86_400.0).contains(&rest_s) {
                mistakes.push(format!(
                    "protocol: {name} is {rest_s} s; allowed: 0 to 86400 s"
                ));
            }
        }
        let Stop {
            angle_above_deg: above,
            angle_below_deg: below,
            ..
        } = self.stop;
        let limits = [
            ("angle_above_deg", above),
            ("angle_below_deg", below),
            ("force_above_n", self.stop.force_above_n),
        ];
        for (name, limit) in limits {
            if limit.is_some_and(|limit| !limit.is_finite()) {
                mistakes.push(format!("protocol: stop: {name} must be a finite number"));
            }
        }
        if above
            .zip(below)
            .is_some_and(|(above, below)| above <= below)
        {
            let message = "protocol: stop: every angle would end the protocol; angle_above_deg must \
                        be larger than angle_below_deg";
            mistakes.push(message.to_owned());
        }
        mistakes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trials(steps: &[Step]) -> Vec<Place> {
        let place = |step: &Step| match step {
            Step::Trial(place) => Some(*place),
            _ => None,
        };
        steps.iter().filter_map(place).collect()
    }

    #[test]
    fn blocks_have_every_condition_and_rests_lie_between_them() {
        let protocol = Protocol {
            blocks: 3,
            repetitions: 2,
            order: Order::Random,
            rest_s: 5.0,
            block_rest_s: 60.0,
            ..Protocol::default()
        };
        let steps = protocol.steps(4, 1);
        assert_eq!(steps, protocol.steps(4, 1));
        assert_ne!(steps, protocol.steps(4, 2));
        let places = trials(&steps);
        for block in 0..3 {
            let mut own: Vec<_> = places.iter().filter(|p| p.block == block).collect();
            assert_eq!(own.len(), 8);
            own.sort_by_key(|p| (p.condition, p.repetition));
            own.dedup();
            assert_eq!(own.len(), 8);
        }
        let rests = |s: f64| steps.iter().filter(|step| **step == Step::Rest(s)).count();
        assert_eq!((rests(60.0), rests(5.0)), (2, 3 * 7));
        assert!(!matches!(steps[0], Step::Rest(_)));
    }

    #[test]
    fn an_order_as_listed_is_that_of_the_conditions_and_every_trial_is_prompted() {
        let protocol = Protocol {
            prompt: Some("Push.".to_owned()),
            ..Protocol::default()
        };
        let steps = protocol.steps(3, 1);
        let conditions: Vec<usize> = trials(&steps).iter().map(|p| p.condition).collect();
        assert_eq!(conditions, [0, 1, 2]);
        assert_eq!(steps.len(), 6);
    }

    #[test]
    fn what_cannot_be_is_told_at_once() {
        let protocol = Protocol {
            blocks: 0,
            rest_s: -1.0,
            stop: Stop {
                angle_above_deg: Some(10.0),
                angle_below_deg: Some(20.0),
                ..Stop::default()
            },
            ..Protocol::default()
        };
        assert_eq!(protocol.mistakes().len(), 3);
    }
}
