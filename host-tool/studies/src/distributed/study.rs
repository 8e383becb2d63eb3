//! Carries out the study for one seed and number of wearers.

use super::declared::{Condition, DistributedDeclaration};
use super::error::DistributedError;
use super::held::{Endurance, Series};
use super::person::DistributedWearer;
use super::play::play;
use serde::{Deserialize, Serialize};

/// Name of the study on the command line.
pub const NAME: &str = "distributed";
/// Number of windows that are averaged for each point of a plotted force course.
const COURSE: usize = 12;

/// The study with its declaration, its seed and its number of wearers.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: DistributedDeclaration,
    pub(super) seed: u64,
    /// Number of random wearers that are generated.
    pub(super) draws: u64,
    /// Runs with the nominal wearer: name of the axis, value on it, and condition. They do not
    /// depend on the seed.
    points: Vec<(&'static str, f64, Condition)>,
}

/// Result of one condition on one wearer, judged from its windows.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ConditionResult {
    /// Identifier of the condition in the declaration.
    pub id: String,
    /// Time for which the force was held; meaningless for a constant amplitude.
    pub endurance: Endurance,
    /// Whether the device refused the reference force because its muscle model cannot produce it.
    pub is_refused: bool,
    /// Ripple: standard deviation of the force within windows, as a fraction of its mean.
    pub ripple: Option<f64>,
    /// Whether the search found an amplitude for the reference force. Like `first` and `left`, this
    /// field is meaningful only for a constant amplitude.
    pub is_found: bool,
    /// Initial force: mean at the start of the constant amplitude, as a fraction of the reference
    /// force.
    pub first: Option<f64>,
    /// Remaining force: mean at the end of the constant amplitude, as a fraction of the initial
    /// force.
    pub left: Option<f64>,
    /// Mean absolute difference between force and reference in the first minute, as a fraction of
    /// the reference. It is meaningful only if a muscle model determines the amplitudes.
    pub distance: Option<f64>,
    /// Course of the force as pairs of time, s, and force as a fraction of the reference. Empty
    /// except for the wearer whose course is plotted.
    pub course: Vec<[f64; 2]>,
}

/// Results of one random wearer in all conditions.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawResult {
    /// Index of the draw, from 0.
    pub index: u64,
    /// Random parameters of the wearer, in the order of the declared ranges.
    pub drawn: Vec<f64>,
    /// Results in the order of the declared conditions.
    pub measured: Vec<ConditionResult>,
}

/// Result of the nominal wearer at one value of an axis.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct AxisPoint {
    /// Name of the axis: `crosstalk`, `reach`, `activation`, `rate_hz` or `wanted`.
    pub axis: String,
    /// Value that replaces the nominal wearer's, or the condition's, along this axis.
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
    /// Returns the result of the condition `id`; `None` if this wearer has none.
    #[must_use]
    pub fn condition_result(&self, id: &str) -> Option<&ConditionResult> {
        self.measured
            .iter()
            .find(|measurement| measurement.id == id)
    }
}

impl Study {
    /// Creates the study. Where `seed` or `draws` is `None`, the value of the declaration applies.
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

    /// Returns the runs with the nominal wearer, each as the name of the axis, the value on it, and
    /// the condition.
    pub(super) fn points(&self) -> &[(&'static str, f64, Condition)] {
        &self.points
    }

    /// Plays one run with the nominal wearer, given as the name of the axis, the value on it, and
    /// the condition.
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

/// Lists the runs with the nominal wearer, each as the name of the axis, the value on it, and the
/// condition.
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
