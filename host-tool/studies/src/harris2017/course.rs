//! Records a test: the signal of the load cell, and the true torque beside it.

use super::declared::{Protocol, RampsDeclaration, TraceCriteria};
use super::error::RampsError;
use super::person::{RampsWearer, is_triceps};
use super::test::{Stimulation, Test, micros, period_us};
use hal_sim::body::bench::arms::Muscle;
use hal_sim::body::bench::{IsometricElbow, IsometricSpec};
use hal_sim::body::{Body, Drive, Pulse};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Sample of a ramp at the time of one of its pulses.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Value of the ramped quantity, mA or µs.
    pub at: f64,
    /// Torque by the load cell, averaged and with its zero removed, N·m, positive in the direction
    /// in which the cell holds.
    pub measured_nm: f64,
    /// True torque, N·m, with the same sign.
    pub true_nm: f64,
}

/// Response of one muscle over a ramp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    pub muscle: Muscle,
    /// Value of the ramp at which the muscle begins to respond, mA or µs; `None` if it never does.
    pub from: Option<f64>,
    /// Largest excited share of the muscle, 0 to 1.
    pub share: f64,
    /// Largest absolute torque of the muscle, N·m.
    pub torque_nm: f64,
}

/// Record of a test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// Stimulation and angle of the test.
    pub test: Test,
    /// One sample for each pulse.
    pub moments: Vec<Moment>,
    /// Response of each muscle.
    pub answers: Vec<Answer>,
}

/// Moving mean of the latest samples.
struct Average {
    samples: VecDeque<f64>,
    most: usize,
    sum: f64,
}

impl Average {
    fn new(ms: f64) -> Self {
        Self {
            samples: VecDeque::new(),
            most: ms.round().max(1.0) as usize, // one sample per millisecond
            sum: 0.0,
        }
    }

    fn push(&mut self, sample: f64) -> f64 {
        self.samples.push_back(sample);
        self.sum += sample;
        if self.samples.len() > self.most {
            self.sum -= self.samples.pop_front().unwrap_or_default();
        }
        self.sum / self.samples.len() as f64
    }
}

impl RampsWearer {
    /// Performs this test on the wearer with these pulses.
    ///
    /// # Errors
    /// Returns E691 if the test rig is invalid.
    pub fn perform(
        &self,
        declared: &RampsDeclaration,
        test: Test,
        pulses: &[Pulse],
    ) -> Result<Course, RampsError> {
        let (protocol, judged) = (&declared.protocol, &declared.judged);
        let holds = test.stimulation.holds();
        let error_deg = protocol.setting_error_deg;
        let setting = self.setting(test.nth, test.included_deg, error_deg, holds);
        let arm = IsometricElbow::new(self.rig_spec(setting), self.seed(test.nth))?;
        Ok(record_test(arm, test, pulses, (protocol, judged)))
    }
}

/// Records the test on an arm that is already in its test rig.
#[must_use]
pub fn record_test(
    mut arm: IsometricElbow,
    test: Test,
    pulses: &[Pulse],
    (protocol, judged): (&Protocol, &TraceCriteria),
) -> Course {
    let (lever_m, sign) = (arm.spec().cell.lever_m, sign(test.stimulation));
    let mut average = Average::new(judged.average_ms);
    let mut answers: Vec<Answer> = (arm.parts()).map(|parts| Answer::none(parts.0)).collect();
    let (mut moments, mut zero) = (Vec::new(), (0.0, 0.0));
    let begin_ms = micros(protocol.settle_s) / 1_000;
    // A pulse acts only after the electromechanical delay and the rise of the force.
    let end_ms = begin_ms + (micros(protocol.ramp_s) + period_us(protocol)) / 1_000;
    let (mut next, mut last) = (0, None);
    for ms in 0..end_ms {
        while let Some(pulse) = pulses
            .get(next)
            .filter(|pulse| pulse.t_us < (ms + 1) * 1_000)
        {
            arm.pulse(pulse);
            next += 1;
            last = Some(pulse);
        }
        arm.advance((ms + 1) * 1_000);
        let n = average.push(arm.instrument_n().unwrap_or_default());
        if ms < begin_ms {
            zero = (
                zero.0 + arm.instrument_n().unwrap_or_default(),
                zero.1 + 1.0,
            );
        }
        let is_moment = (ms + 1) * 1_000 % period_us(protocol) == 0;
        if let Some(pulse) = last.filter(|_| is_moment) {
            let at = ramped_value(test.stimulation, pulse);
            let zero_n: f64 = zero.0 / f64::max(zero.1, 1.0);
            moments.push(Moment {
                at,
                measured_nm: lever_m * (n - zero_n),
                true_nm: sign * arm.extension_nm(),
            });
            let shares = shares(arm.spec(), test.stimulation, pulse);
            for ((answer, (_, nm, _)), share) in answers.iter_mut().zip(arm.parts()).zip(shares) {
                answer.update(at, nm, share, judged.recruited);
            }
        }
    }
    Course {
        test,
        moments,
        answers,
    }
}

/// Returns the sign of an extension torque, where the direction in which the cell holds is
/// positive.
const fn sign(stimulation: Stimulation) -> f64 {
    match stimulation {
        Stimulation::Biceps => -1.0,
        _ => 1.0,
    }
}

/// Returns the share of each muscle that a pulse excites.
fn shares(spec: &IsometricSpec, stimulation: Stimulation, pulse: &Pulse) -> Vec<f64> {
    let Drive::Milliamps(ma) = pulse.drive else {
        return Vec::new(); // Voltage stages are not used here.
    };
    let muscles = spec.muscles.iter();
    muscles
        .map(|recruitment| recruitment.share(stimulation.pair(), ma, pulse.width_us.into()))
        .collect()
}

/// Returns the value of the quantity that is ramped, mA or µs.
fn ramped_value(stimulation: Stimulation, pulse: &Pulse) -> f64 {
    let Drive::Milliamps(ma) = pulse.drive else {
        return 0.0; // Voltage stages are not used here.
    };
    stimulation.ramped_value(ma, pulse.width_us.into())
}

impl Answer {
    const fn none(muscle: Muscle) -> Self {
        Self {
            muscle,
            from: None,
            share: 0.0,
            torque_nm: 0.0,
        }
    }

    fn update(&mut self, at: f64, nm: f64, share: f64, recruited: f64) {
        if share >= recruited {
            self.from.get_or_insert(at);
        }
        self.share = self.share.max(share);
        self.torque_nm = self.torque_nm.max(nm.abs());
    }

    /// Returns whether this muscle counts as stimulated, provided that it is not the intended one.
    #[must_use]
    pub fn is_stimulated(&self, judged: &TraceCriteria) -> bool {
        let has_torque = self.muscle != Muscle::Deltoid;
        match has_torque {
            true => self.torque_nm >= judged.others_nm,
            false => self.share >= judged.others_part,
        }
    }
}

impl Course {
    /// Returns the largest measured torque, N·m.
    #[must_use]
    pub fn peak_nm(&self) -> f64 {
        let torques_nm = self.moments.iter().map(|moment| moment.measured_nm);
        torques_nm.fold(0.0, f64::max)
    }

    /// Returns whether the torque is largest at the end, within the tolerance `falls_by`.
    #[must_use]
    pub fn rises(&self, judged: &TraceCriteria) -> bool {
        let end = self.moments.last().map_or(0.0, |moment| moment.measured_nm);
        end >= (1.0 - judged.falls_by) * self.peak_nm()
    }

    /// Returns the index of the sample from which on the torque stays above the detection limit.
    fn detection_index(&self, judged: &TraceCriteria) -> Option<usize> {
        let below = |moment: &Moment| moment.measured_nm < judged.detected_nm;
        let begin = self
            .moments
            .iter()
            .rposition(below)
            .map_or(0, |index| index + 1);
        (begin < self.moments.len()).then_some(begin)
    }

    /// Returns the value of the ramp from which on the torque stays above the detection limit, mA
    /// or µs; `None` if there is none.
    #[must_use]
    pub fn detected_at(&self, judged: &TraceCriteria) -> Option<f64> {
        Some(self.moments.get(self.detection_index(judged)?)?.at)
    }

    /// Returns R² of a straight line through the samples from [`Self::detected_at`] on; `None` if
    /// there are fewer than ten.
    #[must_use]
    pub fn linearity(&self, judged: &TraceCriteria) -> Option<f64> {
        let above = self.moments.get(self.detection_index(judged)?..)?;
        let points = above.iter().map(|moment| (moment.at, moment.measured_nm));
        (above.len() >= 10).then(|| r_squared(points))?
    }

    /// Returns the muscle that responds at the smallest value of the ramp.
    #[must_use]
    pub fn first(&self) -> Option<Muscle> {
        let answered = self
            .answers
            .iter()
            .filter_map(|answer| Some((answer.from?, answer.muscle)));
        let first = answered.min_by(|a, b| a.0.total_cmp(&b.0));
        first.map(|(_, muscle)| muscle)
    }

    /// Returns the muscles other than the triceps that count as stimulated.
    pub fn unintended_muscles(&self, judged: &TraceCriteria) -> impl Iterator<Item = Muscle> {
        let others = self
            .answers
            .iter()
            .filter(|answer| !is_triceps(answer.muscle));
        let counted = others
            .filter(|answer| answer.is_stimulated(judged))
            .map(|answer| answer.muscle);
        counted.collect::<Vec<_>>().into_iter()
    }
}

/// Returns R² of a line by least squares, or `None` if all points have the same x or the same y.
fn r_squared(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<f64> {
    let n = points.clone().count() as f64;
    let (sx, sy) =
        (points.clone()).fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
    let (mx, my) = (sx / n, sy / n);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in points {
        let (x, y) = (x - mx, y - my);
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    (xx > 0.0 && yy > 0.0).then(|| xy * xy / (xx * yy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_all_of_its_variance_and_a_parabola_has_not() {
        let linearity = |f: fn(f64) -> f64| {
            let points: Vec<_> = (0..=100)
                .map(|index| 0.1 * f64::from(index))
                .map(|x| (x, f(x)))
                .collect();
            r_squared(points.into_iter()).unwrap()
        };
        assert!((linearity(|x| 3.0 - 2.0 * x) - 1.0).abs() < 1e-12);
        // R² of x² on an even grid from 0 approaches 15/16 for many points.
        assert!((linearity(|x| x * x) - 0.9375).abs() < 2e-3);
        assert_eq!(r_squared([(1.0, 2.0), (2.0, 2.0)].into_iter()), None);
    }

    #[test]
    fn an_average_forgets() {
        let mut average = Average::new(3.0);
        let means = [3.0, 6.0, 9.0, 0.0].map(|value| average.push(value));
        assert_eq!(means, [3.0, 4.5, 6.0, 5.0]);
    }
}
