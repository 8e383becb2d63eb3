//! How well predicted forces followed the wanted ones.

use super::{root_mean_square, window};
use crate::record::Trial;
use serde::{Deserialize, Serialize};

/// How well the predicted force of one channel under force control followed
/// the wanted one. Both are the device's: nothing measures force.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ForceMetrics {
    /// 1-based.
    pub channel: u8,
    /// First moment judged, s.
    pub from_s: f64,
    /// Last moment judged, s.
    pub to_s: f64,
    /// Samples judged.
    pub samples: usize,
    /// Root mean square of predicted − wanted, N.
    pub rmse_n: f64,
    /// Largest |predicted − wanted|, N.
    pub max_abs_n: f64,
    /// Largest wanted force, N.
    pub peak_n: f64,
    /// Where forces were wanted that its limits cannot give; none if nowhere.
    pub gap: Option<GapMetrics>,
}

/// Between two forces there are none that a channel's limits can give: it gave
/// the nearer of the two.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct GapMetrics {
    /// The lower one, N.
    pub below_n: f64,
    /// The upper one, N.
    pub above_n: f64,
    /// Share of the samples judged in which the wanted force lay between them.
    pub share: f64,
}

/// Metrics of every channel under force control, in channel order, over the
/// trial's `measure` window, or over all of it. Without samples there, none.
#[must_use]
pub fn force_metrics(trial: &Trial) -> Vec<ForceMetrics> {
    let Some((from_s, to_s)) = window(trial) else {
        return Vec::new();
    };
    let inside = || {
        let samples = trial.samples.iter();
        samples.filter(move |s| (from_s..=to_s).contains(&s.t_s))
    };
    let controlled = trial.channels.iter().filter(|c| c.force);
    controlled
        .filter_map(|channel| {
            let pairs = inside().filter_map(|s| {
                let predicted = trial.force_n(s, channel.number)?;
                Some((predicted, trial.wanted_n(s, channel.number)?))
            });
            let (errors, wanted): (Vec<f64>, Vec<f64>) = pairs
                .map(|(force, wanted)| (force - wanted, wanted))
                .unzip();
            let gaps = inside().filter_map(|s| trial.gap_n(s, channel.number));
            let gaps: Vec<(f64, f64)> = gaps.collect();
            (!errors.is_empty()).then(|| ForceMetrics {
                channel: channel.number,
                from_s,
                to_s,
                samples: errors.len(),
                rmse_n: root_mean_square(&errors),
                max_abs_n: errors.iter().fold(0.0, |most, e| e.abs().max(most)),
                peak_n: wanted.iter().copied().fold(0.0, f64::max),
                gap: gaps.first().map(|&(below_n, above_n)| GapMetrics {
                    below_n,
                    above_n,
                    share: gaps.len() as f64 / errors.len() as f64,
                }),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{ChannelInfo, Sample};

    /// Channel 2 has no muscle, channel 5 only a muscle: forces are those of
    /// channels 1, 5 and 7, the wanted ones of 1 and 7.
    #[test]
    fn forces_find_their_channels() {
        let channel = |number, muscle, force| ChannelInfo {
            number,
            name: String::new(),
            unit: "mA".to_owned(),
            limit: 10.0,
            muscle,
            model: None,
            force,
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
            samples: vec![sample(0.0, 50.0), sample(1.0, 9.0), sample(2.0, 1.0)],
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
        // Errors 1 and -7: (1 + 49) / 2 = 25.
        assert_eq!(
            (seven.rmse_n, seven.max_abs_n, seven.peak_n),
            (5.0, 7.0, 8.0)
        );
    }
}
