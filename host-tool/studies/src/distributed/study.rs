//! The study as it is asked for.

use super::declared::{Condition, DistributedDeclaration};
use super::error::DistributedError;
use super::held::{Endurance, Series};
use super::person::DistributedWearer;
use super::play::play;
use serde::{Deserialize, Serialize};

/// What a command calls it.
pub const NAME: &str = "distributed";
/// Windows of the person who is shown that make a point of a course.
const COURSE: usize = 12;

/// The study.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: DistributedDeclaration,
    /// Of everybody's draws.
    pub(super) seed: u64,
    /// Persons.
    pub(super) draws: u64,
    /// Played on the person in the middle, whatever the seed.
    points: Vec<(&'static str, f64, Condition)>,
}

/// A condition on a person, judged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConditionResult {
    /// The condition.
    pub id: String,
    /// How long the force was held; of a constant amplitude it is of no meaning.
    pub endurance: Endurance,
    /// The device refused the force.
    pub is_refused: bool,
    /// In parts of the mean.
    pub ripple: Option<f64>,
    /// Of a constant amplitude: whether it was found for the wanted force.
    pub is_found: bool,
    /// Of the same: at first, in parts of the wanted force.
    pub first: Option<f64>,
    /// Of the same: at last, in parts of that at first.
    pub left: Option<f64>,
    /// Of a force that a model steers: mean distance over a minute, in parts of it.
    pub distance: Option<f64>,
    /// Force over time in parts of the wanted one, of the person who is shown.
    pub course: Vec<[f64; 2]>,
}

/// What came of a person.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawResult {
    /// From 0.
    pub index: u64,
    /// What was drawn, in the declaration's order.
    pub drawn: Vec<f64>,
    /// By condition.
    pub measured: Vec<ConditionResult>,
}

/// A point of a middle person's way along an axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AxisPoint {
    /// `crosstalk`, `reach`, `activation`, `rate_hz` or `wanted`.
    pub axis: String,
    /// Where on it.
    pub value: f64,
    /// What was played there.
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
    /// What was measured in this condition.
    #[must_use]
    pub fn condition_result(&self, id: &str) -> Option<&ConditionResult> {
        self.measured
            .iter()
            .find(|measurement| measurement.id == id)
    }
}

impl Study {
    /// With this seed and so many persons; the declaration's own without.
    ///
    /// # Errors
    /// E722: the declaration cannot be read.
    pub fn new(seed: Option<u64>, draws: Option<u64>) -> Result<Self, DistributedError> {
        let declared = DistributedDeclaration::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(declared.seed),
            draws: draws.unwrap_or(declared.draws),
            points: axis_points(&declared)?,
            declared,
        })
    }

    /// Persons.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    /// What was declared.
    #[must_use]
    pub const fn declaration(&self) -> &DistributedDeclaration {
        &self.declared
    }

    /// What comes of person `index`.
    ///
    /// # Errors
    /// E722 to E724.
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

    /// What is played on the person in the middle, whatever the seed: axis, value, condition.
    pub(super) fn points(&self) -> &[(&'static str, f64, Condition)] {
        &self.points
    }

    /// What comes of such a point.
    ///
    /// # Errors
    /// E722 to E724.
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

/// What is to be played on the person in the middle, whatever the seed.
///
/// # Errors
/// E722: a condition is missing.
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
