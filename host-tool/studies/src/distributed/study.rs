//! Carries out the study for one seed and number of wearers.

use super::declared::{Condition, DistributedDeclaration};
use super::error::DistributedError;
use super::held::{Endurance, Series};
use super::person::DistributedWearer;
use super::play::play;
use serde::{Deserialize, Serialize};

/// Name of the study on the command line.
pub const NAME: &str = "distributed";
/// Number of windows that are averaged for each point of a plotted course.
const COURSE: usize = 12;

/// Declaration, seed and size of the study.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: DistributedDeclaration,
    pub(super) seed: u64,
    /// Number of random wearers.
    pub(super) draws: u64,
    /// Axis, value and condition of each run with the nominal wearer; independent of the seed.
    points: Vec<(&'static str, f64, Condition)>,
}

/// Judged result of one condition on one wearer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConditionResult {
    /// Id of the condition.
    pub id: String,
    /// Time for which the force was held; meaningless for a constant amplitude.
    pub endurance: Endurance,
    /// Whether the device refused the force.
    pub is_refused: bool,
    /// Standard deviation of the force as a fraction of its mean.
    pub ripple: Option<f64>,
    /// Whether feedback found an amplitude for the reference force. This and the next two fields
    /// apply to a constant amplitude.
    pub is_found: bool,
    /// Force at the start of the constant amplitude, as a fraction of the reference.
    pub first: Option<f64>,
    /// Force at the end of the constant amplitude, as a fraction of that at its start.
    pub left: Option<f64>,
    /// Mean absolute difference from the reference in the first minute, as a fraction of it, if a
    /// model drives the electrodes.
    pub distance: Option<f64>,
    /// Time, s, and force as a fraction of the reference; empty except for the plotted wearer.
    pub course: Vec<[f64; 2]>,
}

/// Results of one random wearer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawResult {
    /// Index of the draw, from 0.
    pub index: u64,
    /// Random parameters, in the order of the declared ranges.
    pub drawn: Vec<f64>,
    /// Results in the order of the conditions.
    pub measured: Vec<ConditionResult>,
}

/// Result of the nominal wearer at one point of an axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AxisPoint {
    /// Name of the axis: `crosstalk`, `reach`, `activation`, `rate_hz` or `wanted`.
    pub axis: String,
    /// Value on the axis.
    pub value: f64,
    /// Result of one condition at this point.
    pub measured: ConditionResult,
}

impl ConditionResult {
    fn from_series(condition: &Condition, series: &Series, is_shown: bool) -> Self {
        Self {
            id: condition.id.clone(),
            endurance: series.endurance(),
            is_refused: series.is_refused,
            ripple: series.ripple(),
            is_found: series.is_found(),
            first: series.initial_force(),
            left: series.remaining_force(),
            distance: series.distance(),
            course: if is_shown {
                series.course(COURSE)
            } else {
                Vec::new()
            },
        }
    }
}

impl DrawResult {
    /// Returns the result of the condition `id`.
    #[must_use]
    pub fn condition_result(&self, id: &str) -> Option<&ConditionResult> {
        self.measured
            .iter()
            .find(|measurement| measurement.id == id)
    }
}

impl Study {
    /// Creates the study with this seed and number of wearers, or with the declared ones.
    ///
    /// # Errors
    /// Returns E722 if the declaration cannot be read.
    pub fn new(seed: Option<u64>, draws: Option<u64>) -> Result<Self, DistributedError> {
        let declared = DistributedDeclaration::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(declared.seed),
            draws: draws.unwrap_or(declared.draws),
            points: axis_points(&declared)?,
            declared,
        })
    }

    /// Returns the number of random wearers.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    #[must_use]
    pub const fn declaration(&self) -> &DistributedDeclaration {
        &self.declared
    }

    /// Plays every condition on the random wearer `index`.
    ///
    /// # Errors
    /// Returns E722 if a declared range is missing, E723 if the muscle is invalid, and E724 if the
    /// device does not play the condition.
    pub fn compute_person(&self, index: u64) -> Result<DrawResult, DistributedError> {
        let person = DistributedWearer::random(&self.declared, self.seed, index);
        let conditions = self.declared.conditions.iter();
        let measured = conditions.map(|condition| {
            let series = play(&self.declared, condition, &person)?;
            Ok(ConditionResult::from_series(condition, &series, index == 0))
        });
        Ok(DrawResult {
            index,
            measured: measured.collect::<Result<_, DistributedError>>()?,
            drawn: person.drawn,
        })
    }

    /// Returns axis, value and condition of each run with the nominal wearer.
    pub(super) fn points(&self) -> &[(&'static str, f64, Condition)] {
        &self.points
    }

    /// Plays one such run with the nominal wearer.
    ///
    /// # Errors
    /// Returns E722 if a declared range is missing, E723 if the muscle is invalid, and E724 if the
    /// device does not play the condition.
    pub fn compute_point(
        &self,
        (axis, value, condition): &(&'static str, f64, Condition),
    ) -> Result<AxisPoint, DistributedError> {
        let mut declared = self.declared.clone();
        if *axis == "wanted" {
            declared.hold.wanted = *value;
        }
        let person = DistributedWearer::nominal(&declared).with_value(axis, *value);
        let series = play(&declared, condition, &person)?;
        Ok(AxisPoint {
            axis: (*axis).to_owned(),
            value: *value,
            measured: ConditionResult::from_series(condition, &series, false),
        })
    }
}

/// Lists the runs with the nominal wearer: axis, value and condition.
///
/// # Errors
/// Returns E722 if a condition is missing.
fn axis_points(
    declared: &DistributedDeclaration,
) -> Result<Vec<(&'static str, f64, Condition)>, DistributedError> {
    let axes = &declared.axes;
    let ids = ["one", "four-half", "four-fast"];
    let along: [(&str, &[f64], [&str; 3]); 4] = [
        ("crosstalk", &axes.crosstalk, ids),
        ("reach", &axes.reach, ids),
        ("activation", &axes.activation, ids),
        ("wanted", &axes.wanted, ["one", "four", "four-half"]),
    ];
    let mut points = Vec::new();
    for (axis, values, ids) in along {
        for &value in values {
            for id in ids {
                points.push((axis, value, declared.condition(id)?.clone()));
            }
        }
    }
    for &rate_hz in &axes.rate_hz {
        let four = declared.condition("four")?.clone();
        points.push(("rate_hz", rate_hz, Condition { rate_hz, ..four }));
    }
    Ok(points)
}
