//! Measures how well predicted forces followed the wanted forces.

use super::{Errors, LATE_S, window};
use crate::record::{Sample, Trial};
use serde::{Deserialize, Serialize};

/// Errors of the predicted force of one channel under force control against the wanted force. Both
/// are values of the device: no sensor measures force.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ForceMetrics {
    /// Channel, counted from 1.
    pub channel: u8,
    /// Start of the judged time, s: the start of the window, or the first predicted force in it if
    /// that comes later.
    pub from_s: f64,
    /// End of the judged time, s: the end of the window, or the last predicted force in it if that
    /// comes earlier.
    pub to_s: f64,
    /// Number of samples in which the predicted force is compared with the wanted force.
    pub samples: usize,
    /// Root mean square of predicted minus wanted force, N.
    pub rmse_n: f64,
    /// Largest absolute difference between predicted and wanted force, N.
    pub max_abs_n: f64,
    /// Largest wanted force, N.
    pub peak_n: f64,
    /// Gap in the range of possible forces, if a wanted force lay inside one; `None` otherwise.
    pub gap: Option<GapMetrics>,
}

/// A range of forces that the channel's limits do not allow, although smaller and larger forces are
/// possible. For a wanted force inside the gap, the device produced the nearer end of the gap.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct GapMetrics {
    /// Force at the lower end of the gap, which is still possible, N.
    pub below_n: f64,
    /// Force at the upper end of the gap, which is possible again, N.
    pub above_n: f64,
    /// Share of the judged samples in which the wanted force lay inside the gap, 0 to 1.
    pub share: f64,
}

/// Returns the share of samples, 0 to 1, in which the device reported that it was *limiting*: that
/// it could not produce the whole wanted force. Only samples with a wanted force on any channel
/// count. The device reports limiting for all its channels together. The share covers the trial's
/// `measure` window, or the whole trial without one; it is `None` if no force was wanted.
#[must_use]
pub fn force_limiting_share(trial: &Trial) -> Option<f64> {
    let is_wanted = |s: &Sample| s.wanted_n.iter().any(Option::is_some);
    let limiting = map_in_window(trial, |s| is_wanted(s).then_some(s.limiting));
    let (total, limiting) = limiting
        .flatten()
        .fold((0, 0), |(total, limiting), is_limiting| {
            (total + 1_usize, limiting + usize::from(is_limiting))
        });
    (total > 0).then(|| limiting as f64 / total as f64)
}

/// Returns the result of `read` for each sample to judge: those in the trial's `measure` window, or
/// all.
fn map_in_window<T>(trial: &Trial, mut read: impl FnMut(&Sample) -> T) -> impl Iterator<Item = T> {
    let (from_s, to_s) = window(trial).unwrap_or((f64::NAN, f64::NAN)); // none
    let inside = move |s: &Sample| (from_s..=to_s).contains(&s.t_s);
    let results = trial.samples.map_each(move |s| inside(s).then(|| read(s)));
    results.flatten()
}

/// Returns the numbers of the channels for which forces were wanted but never predicted, because no
/// muscle model ran. Searches the trial's `measure` window, or the whole trial without one.
#[must_use]
pub fn channels_without_prediction(trial: &Trial) -> Vec<u8> {
    let controlled = trial.channels.iter().filter(|c| c.force);
    // Number, whether a force was wanted, and whether one was predicted.
    let mut channels: Vec<_> = controlled.map(|c| (c.number, false, false)).collect();
    if channels.is_empty() {
        return Vec::new();
    }
    map_in_window(trial, |s| {
        for (number, is_wanted, is_predicted) in &mut channels {
            *is_wanted |= trial.wanted_n(s, *number).is_some();
            *is_predicted |= trial.force_n(s, *number).is_some();
        }
    })
    .for_each(drop);
    let unpredicted = channels
        .into_iter()
        .filter(|(_, is_wanted, is_predicted)| *is_wanted && !is_predicted);
    unpredicted.map(|(number, ..)| number).collect()
}

/// Returns the metrics of every channel under force control, in channel order, over the trial's
/// `measure` window or the whole trial. The list is empty if there are no samples.
#[must_use]
pub fn force_metrics(trial: &Trial) -> Vec<ForceMetrics> {
    let Some((from_s, to_s)) = window(trial) else {
        return Vec::new();
    };
    let controlled = trial.channels.iter().filter(|c| c.force);
    let mut sums: Vec<_> = controlled.map(|c| ForceSums::new(c.number)).collect();
    if sums.is_empty() {
        return Vec::new();
    }
    map_in_window(trial, |sample| {
        sums.iter_mut().for_each(|sum| sum.add(trial, sample));
    })
    .for_each(drop);
    let judged = sums.into_iter();
    judged
        .filter_map(|sum| sum.metrics((from_s, to_s)))
        .collect()
}

/// Sums over the samples of one channel, from which its metrics are computed.
struct ForceSums {
    channel: u8,
    errors: Errors,
    peak_n: f64,
    /// Times of the first and the last sample that were compared, s.
    seen_s: Option<(f64, f64)>,
    gap: Option<(f64, f64)>,
    gaps: u32,
}

impl ForceSums {
    fn new(channel: u8) -> Self {
        Self {
            channel,
            errors: Errors::default(),
            peak_n: 0.0,
            seen_s: None,
            gap: None,
            gaps: 0,
        }
    }

    fn add(&mut self, trial: &Trial, sample: &Sample) {
        if let Some(force_n) = trial.force_n(sample, self.channel)
            && let Some(wanted_n) = trial.wanted_n(sample, self.channel)
        {
            self.errors.add(force_n - wanted_n);
            self.peak_n = self.peak_n.max(wanted_n);
            let (first_s, _) = self.seen_s.unwrap_or((sample.t_s, sample.t_s));
            self.seen_s = Some((first_s, sample.t_s));
        }
        if let Some(own) = trial.nearest_forces_n(sample, self.channel) {
            self.gap = self.gap.or(Some(own));
            self.gaps += 1;
        }
    }

    /// Returns the metrics over a window; `None` where no force was both predicted and wanted.
    fn metrics(self, (from_s, to_s): (f64, f64)) -> Option<ForceMetrics> {
        let (first_s, end_s) = self.seen_s?;
        let is_late = first_s > from_s + LATE_S;
        Some(ForceMetrics {
            channel: self.channel,
            from_s: if is_late { first_s } else { from_s },
            to_s: if end_s < to_s - LATE_S { end_s } else { to_s },
            samples: self.errors.count,
            rmse_n: self.errors.root_mean_square(),
            max_abs_n: self.errors.most,
            peak_n: self.peak_n,
            gap: self.gap.map(|(below_n, above_n)| GapMetrics {
                below_n,
                above_n,
                share: f64::from(self.gaps) / self.errors.count as f64,
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::ChannelInfo;

    /// Checks that forces are assigned to their channels. Channel 2 has no muscle and channel 5
    /// only a muscle: forces are those of channels 1, 5 and 7, and wanted forces those of 1 and 7.
    #[test]
    fn forces_find_their_channels() {
        let channel = |number, muscle, force| ChannelInfo {
            number,
            name: String::new(),
            unit: "mA".to_owned(),
            limit: 10.0,
            live_width: false,
            muscle,
            model: None,
            force,
            line: false,
            joint: None,
        };
        let sample = |t_s: f64, seven: f64| Sample {
            t_s,
            forces_n: [4.0, 9.0, seven].map(Some).to_vec(),
            wanted_n: vec![Some(4.0), Some(8.0)],
            below_n: vec![None, Some(0.0)],
            above_n: vec![None, (seven < 5.0).then_some(8.5)],
            ..Sample::default()
        };
        let trial = Trial {
            channels: vec![
                channel(1, true, true),
                channel(2, false, false),
                channel(5, true, false),
                channel(7, true, true),
            ],
            samples: vec![sample(0.0, 50.0), sample(1.0, 9.0), sample(2.0, 1.0)].into(),
            measure: Some((1.0, 2.0)),
            ..Trial::default()
        };
        let [one, seven] = force_metrics(&trial).try_into().unwrap();
        assert_eq!((one.channel, one.rmse_n, one.peak_n), (1, 0.0, 4.0));
        assert_eq!(one.gap, None);
        let gap = GapMetrics {
            below_n: 0.0,
            above_n: 8.5,
            share: 0.5,
        };
        assert_eq!(seven.gap, Some(gap));
        assert_eq!((seven.channel, seven.samples), (7, 2));
        // The errors are 1 and -7: (1 + 49) / 2 = 25.
        assert_eq!(
            (seven.rmse_n, seven.max_abs_n, seven.peak_n),
            (5.0, 7.0, 8.0)
        );
        assert_eq!((seven.from_s, seven.to_s), (1.0, 2.0));
    }

    /// Creates a trial in which 4 N are wanted on channel 1 every 0.1 s from 0 to 10 s and judged
    /// from 2 s on. From 6 s the device is limiting; from 5 s no model runs, and none ever on
    /// channel 2.
    fn model_that_ends() -> Trial {
        let channel = |number| ChannelInfo {
            number,
            name: String::new(),
            unit: "mA".to_owned(),
            limit: 10.0,
            live_width: false,
            muscle: true,
            model: None,
            force: true,
            line: false,
            joint: None,
        };
        let sample = |i: u32| Sample {
            t_s: f64::from(i) / 10.0,
            limiting: i >= 60,
            forces_n: vec![(i < 50).then_some(3.0), None],
            wanted_n: vec![Some(4.0), Some(1.0)],
            ..Sample::default()
        };
        Trial {
            channels: vec![channel(1), channel(2)],
            samples: (0..=100).map(sample).collect(),
            measure: Some((2.0, 10.0)),
            ..Trial::default()
        }
    }

    #[test]
    fn what_is_judged_ends_with_the_prediction() {
        let [one] = force_metrics(&model_that_ends()).try_into().unwrap();
        assert_eq!((one.from_s, one.to_s, one.samples), (2.0, 4.9, 30));
        assert_eq!(one.rmse_n, 1.0);
    }

    #[test]
    fn limiting_counts_where_no_model_ran() {
        let mut trial = model_that_ends();
        // The device is limiting from 6 to 10 s of 2 to 10 s, both ends included.
        assert_eq!(force_limiting_share(&trial), Some(41.0 / 81.0));
        assert_eq!(channels_without_prediction(&trial), [2]);
        trial.samples.modify_each(|s| s.wanted_n.clear());
        assert_eq!(force_limiting_share(&trial), None);
        assert!(channels_without_prediction(&trial).is_empty());
    }
}
