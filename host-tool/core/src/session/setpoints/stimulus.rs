//! Amplitude and width of one channel over time.

use firmware::pulse::TrainSpec;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

/// Shortest phase that the device outputs, µs. A course with a shorter width asks for no pulse.
const SHORTEST_US: u16 = TrainSpec::WIDTH_US.min as u16; // 10

/// Course of a channel's amplitude and pulse width over time.
#[derive(Clone, PartialEq, Debug)]
pub struct StimulusCourse {
    /// Amplitudes with widths at times in µs after the start. The first time is 0, and the last
    /// stimulus stays.
    pub points: Vec<(u64, Stimulus)>,
    /// Whether each stimulus is constant until the next one. Otherwise amplitude and width change
    /// linearly from each to the next.
    pub is_held: bool,
    /// Whether the widths of the points are used. Otherwise all pulses have the train's own width.
    pub is_live: bool,
}

impl StimulusCourse {
    /// Returns the stimulus `t_us` after the start. Between two points, amplitude and width are
    /// rounded down, so the charge is never above that of the exact values. A width below 10 µs,
    /// which outputs no pulse, is returned as an amplitude of 0.
    #[must_use]
    pub fn at(&self, t_us: u64) -> Stimulus {
        let next = self.points.partition_point(|&(at_us, _)| at_us <= t_us);
        let Some(&(from_us, from)) = self.points.get(next.saturating_sub(1)) else {
            return Stimulus::default(); // there is a first point: checked
        };
        match self.points.get(next) {
            Some(&(to_us, to)) if !self.is_held => {
                let part = (t_us - from_us) as f64 / (to_us - from_us) as f64;
                self.playable(interpolate(from, to, part))
            }
            _ => self.playable(from),
        }
    }

    /// Returns the smallest and the largest amplitude of the points, in thousandths of the
    /// channel's unit.
    pub(super) fn extremes(&self) -> Option<(u32, u32)> {
        let values = || {
            self.points
                .iter()
                .map(|(_, stimulus)| stimulus.amplitude.get())
        };
        values().min().zip(values().max())
    }

    /// Returns the stimuli that may have the largest charge: those of all points and, between two
    /// points, the one with the largest product of amplitude and width. Each comes with the index
    /// of the point at or before it.
    pub(in crate::session) fn peaks(&self) -> Vec<(usize, Stimulus)> {
        let points = self.points.iter().enumerate();
        let mut peaks: Vec<_> = points
            .map(|(n, (_, stimulus))| (n, self.playable(*stimulus)))
            .collect();
        for (n, pair) in self.points.windows(2).enumerate() {
            let [(_, from), (_, to)] = pair else { continue };
            let number = |stimulus: &Stimulus| {
                (
                    f64::from(stimulus.amplitude.get()),
                    f64::from(stimulus.width_us),
                )
            };
            let ((a, w), (b, v)) = (number(from), number(to));
            // The solution of d/du (a + (b − a)u)(w + (v − w)u) = 0; there is none if neither
            // changes.
            let part = -((b - a) * w + (v - w) * a) / (2.0 * (b - a) * (v - w));
            if !self.is_held && (0.0..1.0).contains(&part) {
                peaks.push((n, self.playable(interpolate(*from, *to, part))));
            }
        }
        peaks
    }

    /// Returns `stimulus` in a form that the device accepts: without a width if widths are not
    /// used, and with amplitude 0 if its width is too short.
    fn playable(&self, stimulus: Stimulus) -> Stimulus {
        match stimulus.width_us {
            _ if !self.is_live => Stimulus::with_own_width(stimulus.amplitude),
            0..SHORTEST_US => Stimulus {
                amplitude: Amplitude::ZERO,
                width_us: SHORTEST_US,
            },
            _ => stimulus,
        }
    }
}

/// Returns the stimulus between two stimuli; `part` is 0 at `from` and 1 at `to`. Amplitude and
/// width are rounded down.
fn interpolate(from: Stimulus, to: Stimulus, part: f64) -> Stimulus {
    let mix = |from: u32, to: u32| {
        let (from, to) = (f64::from(from), f64::from(to));
        (from + (to - from) * part + 1e-6).floor() as u32 // not negative
    };
    Stimulus {
        amplitude: Amplitude::new(mix(from.amplitude.get(), to.amplitude.get())),
        width_us: mix(from.width_us.into(), to.width_us.into()) as u16, // at most 500
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn stimulus(ua: u32, width_us: u16) -> Stimulus {
        Stimulus {
            amplitude: Amplitude::new(ua),
            width_us,
        }
    }

    /// The width ramp of Harris 2017, figure 7: its first 10 µs output nothing.
    #[test]
    fn a_ramp_is_straight_and_begins_with_the_shortest_phase() {
        let ramp = StimulusCourse {
            points: vec![
                (0, stimulus(35_000, 0)),
                (30_000_000, stimulus(35_000, 300)),
            ],
            is_held: false,
            is_live: true,
        };
        assert_eq!(ramp.at(0), stimulus(0, 10));
        assert_eq!(ramp.at(999_999), stimulus(0, 10));
        assert_eq!(ramp.at(1_000_000), stimulus(35_000, 10));
        assert_eq!(ramp.at(1_099_999), stimulus(35_000, 10));
        assert_eq!(ramp.at(15_000_000), stimulus(35_000, 150));
        assert_eq!(ramp.at(u64::MAX), stimulus(35_000, 300));
        assert_eq!(ramp.extremes(), Some((35_000, 35_000)));
    }

    #[test]
    fn steps_are_held_and_a_fixed_width_is_never_named() {
        let points = vec![(0, stimulus(1_000, 100)), (500, stimulus(2_000, 400))];
        let steps = StimulusCourse {
            points: points.clone(),
            is_held: true,
            is_live: true,
        };
        assert_eq!(steps.at(499), points[0].1);
        assert_eq!(steps.at(500), points[1].1);
        let fixed = StimulusCourse {
            is_held: false,
            is_live: false,
            ..steps
        };
        assert_eq!(fixed.at(250), stimulus(1_500, 0));
    }

    /// Between 20 mA, 100 µs and 10 mA, 200 µs a pair has 2.25 µC, more than the 2 µC at the ends.
    #[test]
    fn the_most_charge_may_lie_between_two_points() {
        let ramp = StimulusCourse {
            points: vec![(0, stimulus(20_000, 100)), (100, stimulus(10_000, 200))],
            is_held: false,
            is_live: true,
        };
        let peaks = ramp.peaks();
        assert_eq!(peaks[2], (0, stimulus(15_000, 150)));
        assert_eq!(peaks.len(), 3);
    }
}
