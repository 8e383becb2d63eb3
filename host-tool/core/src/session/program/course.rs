//! One pass of a program on one channel: the stimulus that each burst should have, and the order
//! that produces it.

use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::rise::Rise;

/// Amplitude and width over one pass of a program.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Course {
    /// One stimulus for the time `on_us`, with optional ramps up and down.
    OnOff {
        stimulus: Stimulus,
        /// Time on, from the first burst of the ramp up until the channel is off again, µs.
        on_us: f64,
        /// Time from the first burst of the pass to the first burst with full amplitude, µs.
        up_us: u64,
        /// Length of the ramp down at the end of `on_us`, µs.
        down_us: u64,
    },
    /// Stimuli at times in µs after the beginning of the pass. The first time is 0, and the last
    /// stimulus stays.
    Points {
        points: Vec<(u64, Stimulus)>,
        /// Whether each stimulus is constant until the next one. Otherwise amplitude and width
        /// change linearly from each to the next.
        is_held: bool,
    },
}

/// Stimulus that a program wants for a burst, with what is needed to compute the setpoint that
/// produces it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct BurstOrder {
    /// Wanted amplitude of the burst, thousandths of the channel's unit.
    pub(super) amplitude: f64,
    width_us: u16,
    /// Largest amplitude that the host may ask for, to produce this burst.
    most: Amplitude,
    /// Time since the first burst of a rise from 0 whose shape the program determines, µs. `None`
    /// if only the device limits the rise, or if the amplitude is not rising from 0.
    since_us: Option<u64>,
}

impl BurstOrder {
    /// Returns the setpoint after which the device outputs the burst with the wanted amplitude and
    /// width.
    pub(super) fn to_stimulus(self, rise: &Rise) -> Stimulus {
        let since_us = self.since_us.unwrap_or(u64::MAX);
        let order = rise.order_amplitude(self.amplitude, self.width_us, since_us);
        Stimulus {
            amplitude: self.most.min(Amplitude::new(order)),
            width_us: self.width_us,
        }
    }
}

impl Course {
    /// Returns the stimulus that the program wants for the burst at `at_us`, in a pass that began
    /// at `begun_us`.
    pub(super) fn burst_order(&self, rise: &Rise, begun_us: u64, at_us: u64) -> BurstOrder {
        match self {
            Self::OnOff {
                stimulus,
                on_us,
                up_us,
                down_us,
            } => {
                let since_us = at_us - rise.next_burst_us(begun_us);
                // Passes begin and end on whole microseconds.
                let left_us = on_us.round() - (at_us - begun_us) as f64;
                let up = share(since_us, *up_us, rise);
                let down = match down_us {
                    0 => f64::from(u8::from(left_us > 0.0)),
                    _ => (left_us / *down_us as f64).max(0.0),
                };
                BurstOrder {
                    amplitude: f64::from(stimulus.amplitude.get()) * up.min(down).min(1.0),
                    width_us: stimulus.width_us,
                    most: stimulus.amplitude,
                    since_us: Some(since_us),
                }
            }
            Self::Points { points, is_held } => {
                let local_us = at_us - begun_us; // the pass had begun
                let next = points.partition_point(|&(point_us, _)| point_us <= local_us);
                // The checks guarantee a first point.
                let from = points.get(next.saturating_sub(1)).copied();
                let from = from.unwrap_or_default();
                match points.get(next) {
                    Some(&to) if !is_held => interpolate(rise, begun_us, at_us, from, to),
                    _ => BurstOrder {
                        amplitude: from.1.amplitude.get().into(),
                        width_us: from.1.width_us,
                        most: from.1.amplitude,
                        since_us: None,
                    },
                }
            }
        }
    }

    /// Returns the stimuli that the file gives for the course: the one of `OnOff`, or those of all
    /// points.
    pub(super) fn stimuli(&self) -> impl Iterator<Item = Stimulus> + '_ {
        let (own, points) = match self {
            Self::OnOff { stimulus, .. } => (Some(*stimulus), None),
            Self::Points { points, .. } => (None, Some(points)),
        };
        let points = points.into_iter().flatten().map(|&(_, stimulus)| stimulus);
        own.into_iter().chain(points)
    }

    /// Returns the duration of one pass, µs: the time on, or the time of the last point.
    pub(super) fn pass_duration_us(&self) -> f64 {
        match self {
            Self::OnOff { on_us, .. } => *on_us,
            Self::Points { points, .. } => points.last().map_or(0.0, |&(at_us, _)| at_us as f64),
        }
    }
}

/// Returns the stimulus that the program wants for the burst at `at_us`, between two points of a
/// pass that began at `begun_us`.
fn interpolate(
    rise: &Rise,
    begun_us: u64,
    at_us: u64,
    (from_us, from): (u64, Stimulus),
    (to_us, to): (u64, Stimulus),
) -> BurstOrder {
    let (from_us, to_us) = (begun_us + from_us, begun_us + to_us);
    let part = (at_us - from_us) as f64 / (to_us - from_us) as f64;
    let between = |from: f64, to: f64| from + (to - from) * part;
    let width = between(from.width_us.into(), to.width_us.into());
    let [a, b] = [from, to].map(|stimulus| f64::from(stimulus.amplitude.get()));
    let (amplitude, since_us) = match from.amplitude {
        // A rise begins with its first burst, which already has a share of the amplitude.
        Amplitude::ZERO => {
            let first_us = rise.next_burst_us(from_us);
            let since_us = at_us - first_us;
            let up = share(since_us, to_us.saturating_sub(first_us), rise);
            (b * up.min(1.0), Some(since_us))
        }
        _ => (between(a, b), None),
    };
    BurstOrder {
        amplitude,
        width_us: (width + 1e-6).floor() as u16, // at most 500
        most: from.amplitude.max(to.amplitude),
        since_us,
    }
}

/// Returns the share of the full amplitude in a ramp up of length `up_us`, for the burst `since_us`
/// after the first burst of the ramp. Above 1 the ramp has ended.
fn share(since_us: u64, up_us: u64, rise: &Rise) -> f64 {
    let period_us = rise.period_us;
    (since_us + period_us) as f64 / (up_us + period_us) as f64
}
