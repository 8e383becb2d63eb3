//! Metrics computed from a recorded trial, such as how well the joint followed.
//!
//! The input is a [`Trial`]. The outputs are the [`Metrics`] of a joint, [`ForceMetrics`], or the
//! [`WallContact`]s of a virtual wall. Every sample counts equally, as in the papers, so samples are
//! expected at a steady rate. [`Sparc`], [`matching_error`] and [`SavitzkyGolay`] analyse the path
//! of a hand, and [`GasExchange`] analyses gas exchange. The data themselves are in `record`,
//! pictures in `report`, and fits in `identify`.

mod contact;
mod dose;
mod force;
mod lag;
mod limit_cycle;
mod metabolic;
mod motion_error;
mod savitzky_golay;
mod smoothness;

pub use contact::{WallContact, wall_contacts};
pub use dose::{ChannelDose, doses};
pub use force::{
    ForceMetrics, GapMetrics, channels_without_prediction, force_limiting_share, force_metrics,
};
pub use lag::lag_s;
pub use limit_cycle::{LIMIT_CYCLE, limit_cycles};
pub use metabolic::GasExchange;
pub use motion_error::MotionError;
pub use savitzky_golay::SavitzkyGolay;
pub use smoothness::{Sparc, matching_error};

use crate::record::{Sample, Trial};
use serde::{Deserialize, Serialize};

/// Tracking errors of a trial: how far the measured angle was from the target within the judged
/// window.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Metrics {
    /// Start of the judged window, s: its time in the session, or the time of the first sample.
    pub from_s: f64,
    /// End of the judged window, s: its time in the session, or the time of the last sample.
    pub to_s: f64,
    /// Number of samples judged: those with a target and a measured angle.
    pub samples: usize,
    /// Root mean square of measured − target, degrees.
    pub rmse_deg: f64,
    /// Root mean square of the true angle of the simulated limb minus the target, degrees; `None`
    /// if any sample lacks the true angle.
    pub rmse_true_deg: Option<f64>,
    /// Largest |measured − target|, degrees.
    pub max_abs_deg: f64,
    /// Mean of |measured − target|, degrees.
    pub mean_abs_deg: f64,
    /// Share of samples in which an amplitude was clamped, 0–1.
    pub limiting_share: f64,
    /// Delay by which the measured angle trails the target, s ([`lag_s`]), over at most the first
    /// 2^19 samples judged.
    pub lag_s: Option<f64>,
}

/// Angles of a sample that has both a target and a measured angle.
struct JudgedSample {
    t_s: f64,
    target: f64,
    measured: f64,
    truth: Option<f64>,
    limiting: bool,
}

/// Returns the tracking errors of a trial over its `measure` window, both ends included, or over
/// the whole trial without one. Returns `None` if no sample lies in the window, or if the session
/// controls no joint.
pub fn metrics(trial: &Trial) -> Option<Metrics> {
    compute_metrics(trial, true)
}

/// Returns the same metrics as [`metrics`] without the lag, whose search costs more than everything
/// else.
pub fn metrics_without_lag(trial: &Trial) -> Option<Metrics> {
    compute_metrics(trial, false)
}

fn compute_metrics(trial: &Trial, searches_lag: bool) -> Option<Metrics> {
    if !trial.joint {
        return None;
    }
    let (from_s, to_s) = window(trial)?;
    // Only a sample with both angles can be judged.
    let judged_sample = |s: &Sample| {
        if !(from_s..=to_s).contains(&s.t_s) {
            return None;
        }
        Some(JudgedSample {
            t_s: s.t_s,
            target: s.target_deg?,
            measured: s.measured_deg?,
            truth: s.true_deg,
            limiting: s.limiting,
        })
    };
    let judged = trial.samples.map_each(judged_sample).flatten();
    let (mut measured, mut truth) = (Errors::default(), Errors::default());
    let mut limiting = 0.0;
    // Times, targets and measured angles for the search of the lag. One pass collects everything,
    // because each pass decodes all samples.
    let mut columns: [Vec<f64>; 3] = Default::default();
    for sample in judged {
        if searches_lag && columns[0].len() < LAG_SAMPLES {
            let values = [sample.t_s, sample.target, sample.measured];
            (columns.iter_mut().zip(values)).for_each(|(column, value)| column.push(value));
        }
        measured.add(sample.measured - sample.target);
        if let Some(angle) = sample.truth {
            truth.add(angle - sample.target);
        }
        limiting += f64::from(sample.limiting);
    }
    if measured.count == 0 {
        return None;
    }
    let [times, target, angles] = columns;
    let search = || lag_s(&times, &target, &angles);
    Some(Metrics {
        from_s,
        to_s,
        samples: measured.count,
        rmse_deg: measured.root_mean_square(),
        rmse_true_deg: (truth.count == measured.count).then(|| truth.root_mean_square()),
        max_abs_deg: measured.most,
        mean_abs_deg: measured.absolute / measured.count as f64,
        limiting_share: limiting / measured.count as f64,
        lag_s: searches_lag.then(search).flatten(),
    })
}

/// Running sums and extremes of the tracking errors. The errors themselves are not kept, because a
/// trial may be a day long.
#[derive(Clone, Copy, Default)]
struct Errors {
    count: usize,
    squares: f64,
    absolute: f64,
    /// Largest absolute error so far, degrees.
    most: f64,
}

impl Errors {
    fn add(&mut self, error: f64) {
        self.count += 1;
        self.squares += error * error;
        self.absolute += error.abs();
        self.most = self.most.max(error.abs());
    }

    /// Returns the root mean square of the errors; NaN if there are none.
    fn root_mean_square(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }
}

/// Maximum number of samples from which the lag is computed: the first 87 minutes of the judged
/// window at 10 ms per sample. More samples would not change the lag, and the search needs several
/// times their memory.
const LAG_SAMPLES: usize = 1 << 19;

/// Returns the `measure` window, or the time from the first to the last sample without one.
fn window(trial: &Trial) -> Option<(f64, f64)> {
    let last_s = trial.samples.last()?.t_s;
    match trial.measure {
        Some((from_s, to_s)) if to_s > last_s + LATE_S => Some((from_s, last_s)),
        Some(window) => Some(window),
        None => Some((trial.samples.first()?.t_s, last_s)),
    }
}

/// Tolerance for the end of the `measure` window, s. A window that ends later than this after the
/// last sample counts as not reached.
const LATE_S: f64 = 0.25;

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_s: f64, target_deg: f64, measured_deg: f64, limiting: bool) -> Sample {
        Sample {
            t_s,
            target_deg: Some(target_deg),
            measured_deg: Some(measured_deg),
            true_deg: Some(measured_deg + 1.0),
            limiting,
            ..Sample::default()
        }
    }

    /// Creates a trial with the errors 1, −2, 2, 0 inside the window: Σe² = 9, Σ|e| = 5. With the
    /// true angle one degree higher they are 2, −1, 3, 1: Σe² = 15.
    fn trial() -> Trial {
        Trial {
            joint: true,
            samples: vec![
                sample(0.0, 0.0, 50.0, true),
                sample(1.0, 10.0, 11.0, true),
                sample(2.0, 20.0, 18.0, false),
                sample(3.0, 30.0, 32.0, false),
                sample(4.0, 40.0, 40.0, false),
                sample(5.0, 0.0, 70.0, true),
            ]
            .into(),
            measure: Some((1.0, 4.0)),
            ..Trial::default()
        }
    }

    #[test]
    fn metrics_match_values_computed_by_hand() {
        let m = metrics(&trial()).unwrap();
        assert_eq!(m.samples, 4);
        assert_eq!(m.rmse_deg, 1.5);
        assert_eq!(m.rmse_true_deg, Some((15.0_f64 / 4.0).sqrt()));
        assert_eq!(m.max_abs_deg, 2.0);
        assert_eq!(m.mean_abs_deg, 1.25);
        assert_eq!(m.limiting_share, 0.25);
        assert_eq!((m.from_s, m.to_s), (1.0, 4.0));
    }

    #[test]
    fn no_window_judges_all_and_an_unknown_true_angle_has_no_rmse() {
        let mut trial = trial();
        trial.measure = None;
        let mut samples = trial.samples.to_vec();
        samples[3].true_deg = None;
        trial.samples = samples.into();
        let m = metrics(&trial).unwrap();
        assert_eq!((m.samples, m.max_abs_deg), (6, 70.0));
        assert_eq!(m.rmse_true_deg, None);
    }

    #[test]
    fn an_empty_window_has_no_metrics() {
        let mut trial = trial();
        trial.measure = Some((6.0, 9.0));
        assert_eq!(metrics(&trial), None);
        assert_eq!(metrics(&Trial::default()), None);
    }
}
