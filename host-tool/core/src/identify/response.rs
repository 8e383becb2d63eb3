//! The height and speed of a train's force response (Lee 2020, equation 9).

use super::model::{Constants, Sensitive};
use serde::{Deserialize, Serialize};

/// Force at which the response of a muscle counts as begun, N (Lee 2020, §3.3).
pub const BEGINS_N: f64 = 0.015;
/// Time step of the paper's integration, s (§2.4). The times that the paper reports are whole
/// multiples of it.
const GRID_S: f64 = 2e-4;

/// Time after the end of a train in which its peak force may still come, s.
const AFTER_S: f64 = 0.1;

/// Peak and rise times of the force that a train evokes. Times are in s from the moment at which
/// the force exceeds [`BEGINS_N`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Largest force of the response, N.
    pub peak_n: f64,
    /// Time until the force reaches 10 % of the peak, s.
    pub t10_s: f64,
    /// Time until the force reaches 50 % of the peak, s.
    pub t50_s: f64,
    /// Time until the force reaches 90 % of the peak, s.
    pub t90_s: f64,
}

impl Response {
    /// Returns T_RT, the rise time from 10 to 90 % of the peak, s.
    #[must_use]
    pub const fn t_rt_s(&self) -> f64 {
        self.t90_s - self.t10_s
    }

    /// Computes the response from force samples at intervals of `step_s` seconds; `None` if the
    /// force never exceeds [`BEGINS_N`].
    #[must_use]
    pub fn from_force(force_n: &[f64], step_s: f64) -> Option<Self> {
        let peak_n = force_n.iter().copied().fold(0.0, f64::max);
        let from = |level: f64| force_n.iter().position(|force_n| *force_n >= level);
        let begin = force_n.iter().position(|force_n| *force_n > BEGINS_N)?;
        let after = |part: f64| Some((from(part * peak_n)? as f64 - begin as f64) * step_s);
        Some(Self {
            peak_n,
            t10_s: after(0.1)?,
            t50_s: after(0.5)?,
            t90_s: after(0.9)?,
        })
    }
}

/// Returns the response of the model to a train of length `lasts_s` with a pulse every `period_s`
/// (both above 0), computed as in the paper (§3.3, §4.3). `None` if the force never exceeds
/// [`BEGINS_N`].
#[must_use]
pub fn response(constants: Constants, period_s: f64, lasts_s: f64) -> Option<Response> {
    Response::from_force(&force_course(constants, period_s, lasts_s), GRID_S)
}

/// Returns the response for each of `gains`, by which the force scale A is multiplied. The force is
/// computed only once.
#[must_use]
pub fn responses(
    constants: Constants,
    (period_s, lasts_s): (f64, f64),
    gains: &[f64],
) -> Vec<Option<Response>> {
    let course = force_course(constants, period_s, lasts_s);
    let scaled = |gain: &f64| {
        let own: Vec<f64> = course.iter().map(|course| gain * course).collect();
        Response::from_force(&own, GRID_S)
    };
    gains.iter().map(scaled).collect()
}

/// Returns the model's force at every step of the paper's time grid, N. The last step is 0.1 s
/// after the train, because the peak may come after the last pulse.
fn force_course(constants: Constants, period_s: f64, lasts_s: f64) -> Vec<f64> {
    let steps = ((lasts_s + AFTER_S) / GRID_S).round() as u64;
    let mut muscle = Sensitive::new(constants);
    let (mut force, mut next, mut now_s) = (Vec::with_capacity(steps as usize), 0u32, 0.0);
    // Pulses are at every multiple of the period before the end; a multiple at the end itself is
    // not part of the train.
    let pulses = (lasts_s / period_s - 1e-9).ceil() as u32;
    for step in 0..=steps {
        let to_s = step as f64 * GRID_S;
        while next < pulses && f64::from(next) * period_s <= to_s + 1e-12 {
            let at_s = f64::from(next) * period_s;
            muscle.advance(at_s - now_s);
            now_s = now_s.max(at_s);
            muscle.apply_pulse();
            next += 1;
        }
        muscle.advance(to_s - now_s);
        now_s = now_s.max(to_s);
        force.push(muscle.force_n);
    }
    force
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_count_from_when_force_comes() {
        let force: Vec<f64> = (0..200)
            .map(|i| (f64::from(i) - 50.0).max(0.0) * 0.1)
            .collect();
        let result = Response::from_force(&force, 1e-3).unwrap();
        assert!((result.peak_n - 14.9).abs() < 1e-9);
        assert!((result.t_rt_s() - 0.119).abs() < 0.0015, "{result:?}");
        assert!((result.t10_s - 0.014).abs() < 1e-9, "{result:?}");
        assert_eq!(Response::from_force(&[0.0; 10], 1e-3), None);
    }
}
