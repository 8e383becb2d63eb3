//! Results of a calibration at one electrode so far.

use super::{Level, Refusal, Step};
use serde::{Deserialize, Serialize};

/// Result of one step of the calibration of an electrode.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Value {
    /// Level that the step found, in the channel's unit.
    Level(Level),
    /// Names of the movements that the electrode causes, from the last step.
    Moves(Vec<String>),
}

/// Results of the steps at one electrode; `None` for steps without a result so far. Levels are in
/// the channel's unit.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct ElectrodeResult {
    /// Level at which the operator confirmed that the electrode is over the right muscle.
    pub placement: Option<Level>,
    /// Motor threshold: the lowest level at which something moved twice.
    pub threshold: Option<Level>,
    /// Largest level that the wearer accepts.
    pub limit: Option<Level>,
    /// Smallest level to use in sessions, as the operator chose it.
    pub minimum: Option<Level>,
    /// Largest level to use in sessions, as the operator chose it.
    pub maximum: Option<Level>,
    /// Names of the movements that the electrode causes.
    pub moves: Option<Vec<String>>,
    /// Whether the operator left this electrode out of the calibration.
    pub is_skipped: bool,
}

impl ElectrodeResult {
    /// Returns the first step without a result; `None` if every step has one or the electrode was
    /// left out.
    #[must_use]
    pub fn next_step(&self) -> Option<Step> {
        self.first_missing_step().filter(|_| !self.is_skipped)
    }

    /// Returns the first step without a result, even if the electrode was left out.
    #[must_use]
    pub fn first_missing_step(&self) -> Option<Step> {
        let has = |step: &Step| match step {
            Step::Placement => self.placement.is_some(),
            Step::Threshold => self.threshold.is_some(),
            Step::Comfort => self.limit.is_some(),
            Step::Minimum => self.minimum.is_some(),
            Step::Maximum => self.maximum.is_some(),
            Step::Points => self.moves.is_some(),
        };
        Step::ALL.into_iter().find(|step| !has(step))
    }

    /// Returns whether every step has a result and the electrode was not left out.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        !self.is_skipped && self.next_step().is_none()
    }

    /// Stores the result of a step.
    ///
    /// # Errors
    /// The result is of the wrong kind for the step, or it contradicts other results: the required
    /// order is threshold ≤ minimum < maximum ≤ limit, and threshold < limit.
    pub fn store(&mut self, step: Step, value: &Value) -> Result<(), Refusal> {
        let level = match (step, value) {
            (Step::Points, Value::Moves(moves)) => {
                self.moves = Some(moves.clone());
                return Ok(());
            }
            (Step::Points, _) | (_, Value::Moves(_)) => {
                return Err(Refusal::out_of_order(
                    step,
                    "this step has a different kind of result".into(),
                ));
            }
            (_, Value::Level(level)) => *level,
        };
        self.check_order(step, level)?;
        match step {
            Step::Placement => self.placement = Some(level),
            Step::Threshold => self.threshold = Some(level),
            Step::Comfort => self.limit = Some(level),
            Step::Minimum => self.minimum = Some(level),
            Step::Maximum => self.maximum = Some(level),
            Step::Points => {}
        }
        Ok(())
    }

    fn check_order(&self, step: Step, level: Level) -> Result<(), Refusal> {
        let known = |level: Option<Level>| level.unwrap_or_default();
        let (threshold, limit, minimum) = (
            known(self.threshold),
            known(self.limit),
            known(self.minimum),
        );
        let wrong = match step {
            Step::Placement | Step::Threshold if level == Level(0) => {
                Some("no level was given; raise first".to_owned())
            }
            Step::Comfort if level <= threshold => Some(format!(
                "the limit of {level} is not above the motor threshold of {threshold}; move the \
                 electrode, or leave the electrode out"
            )),
            Step::Minimum if level < threshold => Some(format!(
                "the minimum of {level} is below the motor threshold of {threshold}; raise the \
                 level"
            )),
            Step::Minimum if level >= limit => Some(format!(
                "the minimum of {level} is not below the limit of {limit}; lower the level"
            )),
            Step::Maximum if level > limit => Some(format!(
                "the maximum of {level} is above the limit of {limit}; lower the level"
            )),
            Step::Maximum if level <= minimum => Some(format!(
                "the maximum of {level} is not above the minimum of {minimum}; raise the level"
            )),
            _ => None,
        };
        match wrong {
            Some(wrong) => Err(Refusal::out_of_order(step, wrong)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(units: f64) -> Value {
        Value::Level(Level::from_units(units).unwrap())
    }

    #[test]
    fn results_out_of_order_are_refused_by_name() {
        let mut found = ElectrodeResult::default();
        found.store(Step::Placement, &level(8.0)).unwrap();
        found.store(Step::Threshold, &level(9.0)).unwrap();
        let message = |result: Result<(), Refusal>| result.unwrap_err().to_string();
        let refused = message(found.store(Step::Comfort, &level(9.0)));
        assert!(refused.starts_with("E676") && refused.contains("the result of step `comfort`"));
        found.store(Step::Comfort, &level(13.0)).unwrap();
        assert!(
            message(found.store(Step::Minimum, &level(8.5)))
                .contains("below the motor threshold of 9")
        );
        assert!(message(found.store(Step::Minimum, &level(13.0))).contains("the limit of 13"));
        found.store(Step::Minimum, &level(10.0)).unwrap();
        assert!(message(found.store(Step::Maximum, &level(13.5))).contains("above the limit"));
        assert!(
            message(found.store(Step::Maximum, &level(10.0))).contains("not above the minimum")
        );
        assert_eq!(found.next_step(), Some(Step::Maximum));
        found.store(Step::Maximum, &level(13.0)).unwrap();
        assert!(found.store(Step::Points, &level(13.0)).is_err());
        found.store(Step::Points, &Value::Moves(vec![])).unwrap();
        assert!(found.is_complete());
    }
}
