//! Measures one random wearer in all tests.

use super::angles::torque_deviation;
use super::course::{Answer, Course};
use super::declared::{PulseOf, RampsDeclaration, TraceCriteria};
use super::error::RampsError;
use super::person::{RampsWearer, Setting, is_triceps};
use super::strength_duration::{StrengthDurationFit, Threshold, fit_law};
use super::test::{Stimulation, Test};
use hal_sim::body::Pulse;
use hal_sim::body::bench::arms::Muscle;
use hal_sim::body::bench::elbow::{BICEPS, TRICEPS};
use serde::{Deserialize, Serialize};

/// Pulses of each stimulation, as intended or as a device played them.
pub type Pulses = Vec<(Stimulation, Vec<Pulse>)>;

/// Quantities measured in one test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TestMeasurements {
    pub test: Test,
    /// Largest torque, N·m.
    pub peak_nm: f64,
    /// Value of the ramp at which the torque begins, mA or µs.
    pub detected_at: Option<f64>,
    /// R² of a straight line through the torque from `detected_at` on; `None` for fewer than ten
    /// samples.
    pub linearity: Option<f64>,
    /// Whether the torque is largest at the end of the ramp.
    pub rises: bool,
    /// Muscle that responds at the smallest value of the ramp; `None` if no muscle responds.
    pub first: Option<Muscle>,
    /// Response of each muscle.
    pub answers: Vec<Answer>,
}

/// Steady result of a constant pulse, without noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldPulse {
    /// Charge per phase, µC.
    pub charge_uc: f64,
    /// Torque, N·m, extension positive.
    pub torque_nm: f64,
    /// Muscles other than the triceps that count as stimulated.
    pub others: Vec<Muscle>,
}

/// Strength–duration relation of an electrode pair on one wearer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrengthDurationFound {
    /// Measured thresholds, one for each pulse width that has one.
    pub thresholds: Vec<Threshold>,
    /// Law fitted through the thresholds; `None` if the thresholds allow no fit.
    pub fitted: Option<StrengthDurationFit>,
}

/// A random wearer with its measurements.
#[derive(Clone, Debug)]
pub struct DrawResult {
    pub person: RampsWearer,
    /// Stored measurements, from which the wearer can be restored by seed and index.
    pub kept: DrawMeasurements,
}

impl std::ops::Deref for DrawResult {
    type Target = DrawMeasurements;

    fn deref(&self) -> &DrawMeasurements {
        &self.kept
    }
}

/// Measurements of one wearer, as they are stored.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DrawMeasurements {
    /// Measurements of every test, in the order of [`Test::all`].
    pub measured: Vec<TestMeasurements>,
    /// Records of the tests; empty unless the wearer is plotted.
    pub courses: Vec<Course>,
    /// Relation of the pair on the triceps, and that of the biceps if the wearer is plotted.
    pub strength_duration: Vec<StrengthDurationFound>,
    /// Results of the two pulses in the declaration's `beyond`.
    pub beyond: [HeldPulse; 2],
    /// Largest relative change of the torque at the end of a current ramp by ±15°.
    pub departs: f64,
}

impl TestMeasurements {
    fn from_course(course: &Course, judged: &TraceCriteria) -> Self {
        Self {
            test: course.test,
            peak_nm: course.peak_nm(),
            detected_at: course.detected_at(judged),
            linearity: course.linearity(judged),
            rises: course.rises(judged),
            first: course.first(),
            answers: course.answers.clone(),
        }
    }

    /// Returns whether a muscle other than the triceps counts as stimulated.
    #[must_use]
    pub fn has_others(&self, judged: &TraceCriteria) -> bool {
        let mut others = self
            .answers
            .iter()
            .filter(|answer| !is_triceps(answer.muscle));
        others.any(|answer| answer.is_stimulated(judged))
    }
}

impl DrawResult {
    /// Measures wearer `index` of `seed` with these pulses. `is_shown` adds the records and the
    /// thresholds of the biceps.
    ///
    /// # Errors
    /// Returns E690 or E691 if the declaration or the test rig is invalid.
    pub fn measure(
        declared: &RampsDeclaration,
        (seed, index): (u64, u64),
        pulses: &Pulses,
        is_shown: bool,
    ) -> Result<Self, RampsError> {
        let person = RampsWearer::random(declared, seed, index)?;
        let (mut measured, mut courses) = (Vec::new(), Vec::new());
        for test in Test::all(&declared.protocol) {
            let own = pulses
                .iter()
                .find(|(stimulation, _)| *stimulation == test.stimulation);
            let Some((_, own)) = own else { continue };
            let course = person.perform(declared, test, own)?;
            measured.push(TestMeasurements::from_course(&course, &declared.judged));
            if is_shown {
                courses.push(course);
            }
        }
        let mut strength_duration = Vec::new();
        let pairs = [TRICEPS, BICEPS].into_iter();
        for pair in pairs.take(if is_shown { 2 } else { 1 }) {
            let thresholds = person.thresholds(declared, pair)?;
            let fitted = fit_law(&thresholds, declared.strength_duration.step_ma);
            strength_duration.push(StrengthDurationFound { thresholds, fitted });
        }
        let beyond = declared.beyond;
        let held = |pulse| person.hold_pulse(&declared.judged, pulse);
        let kept = DrawMeasurements {
            measured,
            courses,
            strength_duration,
            beyond: [held(beyond.first)?, held(beyond.second)?],
            departs: torque_deviation(declared, &person)?,
        };
        Ok(Self { person, kept })
    }

    /// Returns the measurements of all current ramps or of all width ramps.
    pub fn ramps(&self, of_current: bool) -> impl Iterator<Item = &TestMeasurements> {
        self.measured
            .iter()
            .filter(move |measurement| match measurement.test.stimulation {
                Stimulation::Current(_) => of_current,
                Stimulation::Width(_) => !of_current,
                Stimulation::Biceps => false,
            })
    }

    /// Returns the measured chronaxie of the triceps with its interval, and the true one, µs.
    #[must_use]
    pub fn chronaxies_us(&self) -> Option<(f64, [f64; 2], f64)> {
        let fitted = self.strength_duration.first()?.fitted?;
        let truth = self.person.muscles.first()?.strength.chronaxie_us;
        Some((fitted.chronaxie_us, fitted.chronaxie_within, truth))
    }

    /// Returns the measurements of this stimulation at this angle.
    #[must_use]
    pub fn find_test(
        &self,
        stimulation: Stimulation,
        included_deg: f64,
    ) -> Option<&TestMeasurements> {
        let is = |measurement: &&TestMeasurements| {
            measurement.test.stimulation == stimulation
                && measurement.test.included_deg == included_deg
        };
        self.measured.iter().find(is)
    }
}

impl RampsWearer {
    /// Computes the steady result of a constant pulse from the pair on the triceps at 90°, with a
    /// contraction of mean strength.
    fn hold_pulse(&self, judged: &TraceCriteria, pulse: PulseOf) -> Result<HeldPulse, RampsError> {
        let spec = self.rig_spec(Setting::exact(90.0));
        let width_us = f64::from(pulse.width_us);
        let parts = self.steady(&spec, TRICEPS, (pulse.current_ma, width_us))?;
        let counts = |&(muscle, nm, share): &(Muscle, f64, f64)| {
            let answer = Answer {
                muscle,
                from: None,
                share,
                torque_nm: nm.abs(),
            };
            !is_triceps(muscle) && answer.is_stimulated(judged)
        };
        let others = parts.iter().filter(|part| counts(part)).map(|part| part.0);
        Ok(HeldPulse {
            charge_uc: 1e-3 * pulse.current_ma * width_us,
            torque_nm: parts.iter().map(|part| part.1).sum(),
            others: others.collect(),
        })
    }
}
