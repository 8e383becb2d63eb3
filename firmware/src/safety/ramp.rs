//! Amplitude envelopes: a rise from zero, the slope limit that holds at all times, and one common
//! fall.

use super::measures::Measures;
use super::slope::{Slope, scale};
use super::{Channel, Stimulus, Wearer};
use crate::pulse::BurstTime;
use crate::units::{Amplitude, Micros, us};
use core::hash::{Hash, Hasher};

/// State of a channel's rise. A rise begins with the first burst after zero, when the train begins
/// (at its start, or by the trigger input), and after a pause of more than twice the larger of the
/// periods in force at the previous burst and now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rise {
    /// Time of the first burst of the rise, at most a rise time before the latest burst.
    start: Micros,
    /// Time of the latest burst.
    last: Micros,
    /// Period of the train at the latest burst, µs.
    period_us: u32,
    /// Number of bursts of the rise so far: 0 before the first, [`RISEN`] after the last.
    bursts: u16,
}

/// Value of [`Rise::bursts`] when the rise is over. A rise has at most 1,001 bursts.
const RISEN: u16 = u16::MAX;

/// Hashes three words, because the checksum over them is computed at every burst.
impl Hash for Rise {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u32(self.start.get());
        state.write_u32(self.last.get());
        // The two values do not overlap so that a change of one could hide a change of the other.
        state.write_u32(self.period_us ^ u32::from(self.bursts).rotate_left(16));
    }
}

/// The limits on the amplitude of one burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reach {
    /// Parts of the wanted amplitude that time and bursts allow: numerator, denominator.
    parts: Option<[(u32, u32); 2]>,
    /// Time since the channel's previous burst, µs; `None` at the first burst of a rise.
    since_us: Option<u32>,
}

impl Rise {
    /// Returns whether the rise is over, after which only the slope limit applies.
    #[must_use]
    pub const fn is_risen(&self) -> bool {
        self.bursts == RISEN
    }

    /// Returns when the latest burst began; an arbitrary time before the first.
    #[must_use]
    pub const fn last_burst_time(&self) -> Micros {
        self.last
    }

    /// Notes a burst at `time` and returns the limits on its amplitude, for a wearer with this
    /// [`Wearer::rise`].
    ///
    /// Burst k of a rise, at time t after its first, may have min(k / (`rise_bursts` + 1), (t + T)
    /// / (`rise_us` + T)) of the wanted amplitude, where T is the period. If time alone counted, a
    /// train with long pauses would reach its full amplitude with its second burst.
    #[inline]
    pub fn note_burst(&mut self, time: BurstTime, (rise_us, rise_bursts): (u32, u16)) -> Reach {
        let BurstTime {
            at,
            period_us,
            opens,
        } = time;
        // A train that has begun pauses for at most the length of a list.
        let since_us = (at - self.last).us().cast_unsigned();
        // At most 4e6.
        let pause_us = 2 * period_us.max(self.period_us);
        if self.bursts == 0 || opens || since_us > pause_us {
            (self.start, self.bursts) = (at, 0);
        }
        let since_us = (self.bursts != 0).then_some(since_us);
        (self.last, self.period_us) = (at, period_us);
        if self.bursts == RISEN {
            return Reach {
                parts: None,
                since_us,
            };
        }
        let elapsed_us = (at - self.start).us().cast_unsigned().min(rise_us);
        let played = self.bursts.min(rise_bursts);
        if (elapsed_us, played) == (rise_us, rise_bursts) {
            self.bursts = RISEN;
            return Reach {
                parts: None,
                since_us,
            };
        }
        if elapsed_us == rise_us {
            // The clock may advance by more than half its range before the bursts are played.
            self.start = at - us(rise_us);
        }
        self.bursts = played + 1; // at most 1 001
        let (played, rise_bursts) = (u32::from(played), u32::from(rise_bursts));
        Reach {
            // Each value is at most 5e6 + 2e6.
            parts: Some([
                (elapsed_us + period_us, rise_us + period_us),
                (played + 1, rise_bursts + 1),
            ]),
            since_us,
        }
    }
}

impl Reach {
    /// Returns the largest amplitude, at most that of `wanted`, for a burst on `channel` after a
    /// burst that was `previous`.
    ///
    /// In addition to the limits of a rise, an amplitude rises from one burst to the next by at
    /// most limit · Δt / `rise_ms` and limit / `rise_bursts` (in whole thousandths, at least one).
    /// The same holds for the amplitude that has the burst's charge at the train's own width.
    /// Amplitudes up to `start` are reached at once.
    #[inline]
    #[must_use]
    pub fn amplitude(
        &self,
        channel: &Channel,
        wearer: &Wearer,
        wanted: Stimulus,
        previous: Stimulus,
    ) -> Amplitude {
        let is_lower =
            wanted.amplitude <= previous.amplitude && wanted.width_us <= previous.width_us;
        if self.parts.is_none() && self.since_us.is_some() && is_lower {
            return wanted.amplitude; // as mostly
        }
        self.bounded_amplitude(channel, wearer, wanted, previous)
    }

    #[inline(never)]
    fn bounded_amplitude(
        &self,
        channel: &Channel,
        wearer: &Wearer,
        wanted: Stimulus,
        previous: Stimulus,
    ) -> Amplitude {
        let full = wanted.amplitude;
        let at_once = immediate_amplitude(channel, wanted.width_us);
        if full <= at_once {
            return full;
        }
        let mut most = full;
        for (part, whole) in self.parts.into_iter().flatten() {
            most = most.min(scale(full, part, whole));
        }
        if self.since_us.is_some() {
            let width_us = wanted.width_us;
            most = most.min(max_amplitude(
                channel,
                wearer,
                previous,
                self.since_us,
                width_us,
            ));
        }
        most.max(at_once)
    }
}

/// Returns the largest amplitude of this width that `channel` reaches at once.
fn immediate_amplitude(channel: &Channel, width_us: u16) -> Amplitude {
    let own_us = channel.train.spec().width_us;
    Measures::uniform(channel.start).amplitude_at(width_us, own_us)
}

/// Returns the largest amplitude of this width for a burst on `channel` that follows the burst
/// `previous` by `since_us`. Without a previous burst, this is the amplitude reached at once.
fn max_amplitude(
    channel: &Channel,
    wearer: &Wearer,
    previous: Stimulus,
    since_us: Option<u32>,
    width_us: u16,
) -> Amplitude {
    let at_once = immediate_amplitude(channel, width_us);
    let Some(since_us) = since_us else {
        return at_once;
    };
    let own_us = channel.train.spec().width_us;
    let by = Slope::of(channel.limit, wearer).max_increase(since_us);
    let above = Measures::rounded_down(previous, own_us).plus(by);
    above.amplitude_at(width_us, own_us).max(at_once)
}

/// The common fall of all channels when stimulation stops.
#[derive(Clone, Copy, Debug, Hash)]
pub struct Fall {
    from: Micros,
    length_us: u32,
}

impl Fall {
    /// Returns a fall that starts at `from` and reaches zero `length_us` later.
    #[must_use]
    pub const fn new(from: Micros, length_us: u32) -> Self {
        Self { from, length_us }
    }

    /// Returns the time at which every output is disconnected at the latest.
    #[must_use]
    pub fn end(&self) -> Micros {
        self.from + us(self.length_us)
    }

    /// Returns `amplitude` scaled to the part of the fall that remains at `now`.
    #[must_use]
    pub fn apply(&self, amplitude: Amplitude, now: Micros) -> Amplitude {
        let left = self.end().elapsed_since(now).min(self.length_us);
        scale(amplitude, left, self.length_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pulse::TrainSpec;
    use crate::safety::setup::tests::CHANNEL;
    use crate::safety::{ChannelSpec, WearerSpec};
    use std::vec::Vec;

    #[test]
    fn falls_to_zero_at_its_end() {
        let fall = Fall::new(Micros::new(1000), 50_000);
        let full = Amplitude::new(1000);
        assert_eq!(fall.apply(full, Micros::new(0)), full);
        assert_eq!(fall.apply(full, Micros::new(26_000)), Amplitude::new(500));
        assert_eq!(fall.apply(full, fall.end()), Amplitude::ZERO);
        assert_eq!(fall.apply(full, fall.end() + us(9)), Amplitude::ZERO);
    }

    /// Tests every fall time that a wearer may have, at each of its microseconds.
    #[test]
    fn no_fall_rises_or_outlasts_its_time() {
        for full in [1, 65_537, 150_000].map(Amplitude::new) {
            for fall_us in (5..=100).map(|ms| ms * 1_000) {
                let from = Micros::new(u32::MAX - fall_us / 2); // the clock wraps on the way
                let fall = Fall::new(from, fall_us);
                let mut last = full;
                for after in 0..=fall_us {
                    let left = fall.apply(full, from + us(after));
                    let is_due = after * 2 != fall_us || left.get() <= full.get().div_ceil(2);
                    assert!(left <= last && is_due, "{full:?}, {fall_us} µs: {after}");
                    last = left;
                }
                assert_eq!(last, Amplitude::ZERO);
            }
        }
    }

    const PERIOD_US: u32 = 20_000;

    fn wearer(rise_ms: u16, rise_bursts: u16) -> Wearer {
        let spec = WearerSpec {
            rise_ms,
            rise_bursts,
            ..WearerSpec::default()
        };
        spec.validate().unwrap()
    }

    /// Returns a channel of 200 µs with this limit and this `start`, whose width may grow.
    fn channel(limit: u32, start: u32) -> Channel {
        let spec = ChannelSpec {
            train: TrainSpec {
                max_width_us: 400,
                ..TrainSpec::biphasic(200, 100, PERIOD_US)
            },
            limit: Amplitude::new(limit),
            start: Amplitude::new(start),
            ..CHANNEL
        };
        spec.validate(&wearer(500, 1)).unwrap()
    }

    /// Returns the amplitudes of the channel's bursts in their order, µA. Each element of `wanted`
    /// is an amplitude (µA), a width (µs), and the delay after the previous burst (µs).
    fn play(
        channel: &Channel,
        wearer: &Wearer,
        wanted: impl IntoIterator<Item = (u32, u16, u32)>,
    ) -> Vec<u32> {
        let (mut rise, mut previous) = (Rise::default(), Stimulus::default());
        let mut at = Micros::new(u32::MAX - 50_000); // the clock wraps on the way
        let mut play = |(ua, width_us, after_us)| {
            at += us(after_us);
            let wanted = Stimulus {
                amplitude: Amplitude::new(ua),
                width_us,
            };
            let time = BurstTime {
                at,
                period_us: PERIOD_US,
                opens: false,
            };
            let reach = rise.note_burst(time, wearer.rise());
            let amplitude = reach.amplitude(channel, wearer, wanted, previous);
            previous = Stimulus {
                amplitude,
                width_us,
            };
            amplitude.get()
        };
        wanted.into_iter().map(&mut play).collect()
    }

    #[test]
    fn a_rise_is_linear_in_time_and_in_bursts() {
        let slow = play(
            &channel(20_000, 0),
            &wearer(100, 1),
            [(12_000, 200, PERIOD_US); 7],
        );
        assert_eq!(slow, [2_000, 4_000, 6_000, 8_000, 10_000, 12_000, 12_000]);
        let long = play(
            &channel(20_000, 0),
            &wearer(1, 5),
            [(12_000, 200, PERIOD_US); 7],
        );
        assert_eq!(long, slow);
    }

    #[test]
    fn a_pause_of_more_than_two_periods_begins_a_rise() {
        let risen = [(12_000, 200, PERIOD_US); 7];
        for (pause_us, next) in [(2 * PERIOD_US, 12_000), (2 * PERIOD_US + 1, 2_000)] {
            let wanted = risen.into_iter().chain([(12_000, 200, pause_us)]);
            let played = play(&channel(20_000, 0), &wearer(100, 1), wanted);
            assert_eq!(played.last(), Some(&next), "{pause_us}");
        }
    }

    /// A rise begins with the first burst, and with a burst that opens the train again.
    #[test]
    fn a_train_that_begins_begins_a_rise() {
        for first in [0, 1, 2 * PERIOD_US, u32::MAX] {
            let mut rise = Rise::default();
            for (after, opens, part) in [(0, false, 1), (1, false, 2), (2, true, 1)] {
                let at = Micros::new(first) + us(after * PERIOD_US);
                let period_us = PERIOD_US;
                let time = BurstTime {
                    at,
                    period_us,
                    opens,
                };
                let reach = rise.note_burst(time, (100_000, 5));
                let of_time = (part * PERIOD_US, 100_000 + PERIOD_US);
                assert_eq!(reach.parts, Some([of_time, (part, 6)]), "{first}: {after}");
                assert_eq!(reach.since_us, (part > 1).then_some(PERIOD_US));
            }
        }
    }

    /// Plays 2 µA for some time and then the limit, so that the step comes during the rise and
    /// after it.
    #[test]
    fn nothing_that_came_before_lets_a_burst_jump() {
        for faint in [4, 40] {
            let wanted = std::iter::repeat_n((2, 200, PERIOD_US), faint)
                .chain(std::iter::repeat_n((20_000, 200, PERIOD_US), 40));
            let played = play(&channel(20_000, 0), &wearer(500, 1), wanted);
            // 20 mA in 500 ms: 800 µA a period.
            for (before, after) in played.iter().zip(&played[1..]) {
                assert!(after - before <= 800, "{played:?}");
            }
            assert_eq!(played.last(), Some(&20_000));
        }
    }

    /// A growing width lowers the amplitude: the charge rises no faster than at a constant width.
    #[test]
    fn a_width_rises_no_faster_than_an_amplitude() {
        let wanted = [(10_000, 20, PERIOD_US); 40]
            .into_iter()
            .chain([(10_000, 400, PERIOD_US); 40]);
        let played = play(&channel(20_000, 0), &wearer(500, 1), wanted);
        // 10 mA for 20 µs has the charge of 1 mA for 200; 800 µA more are 0.9 mA for 400.
        assert_eq!((played[39], played[40]), (10_000, 900));
        let charges: Vec<u32> = played[40..].iter().map(|ua| ua * 2).collect();
        assert!(charges.windows(2).all(|two| two[1] - two[0] <= 800));
        assert_eq!(played.last(), Some(&10_000));
    }

    #[test]
    fn what_start_allows_is_reached_at_once() {
        let (channel, wearer) = (channel(20_000, 5_000), wearer(500, 1));
        let first = |ua, width_us| play(&channel, &wearer, [(ua, width_us, 0)]);
        assert_eq!(first(5_000, 200), [5_000]);
        assert_eq!(first(2_500, 400), [2_500]);
        // Above `start`, a rise continues from there.
        assert_eq!(first(12_000, 200), [5_000]);
        assert_eq!(first(5_000, 400), [2_500]);
        let later = play(&channel, &wearer, [(0, 200, 0), (5_000, 200, PERIOD_US)]);
        assert_eq!(later, [0, 5_000]);
    }

    /// An amplitude also rises if the limit is so small that a step is less than a thousandth.
    #[test]
    fn the_slope_never_stands_still() {
        let played = play(
            &channel(30, 0),
            &wearer(5_000, 1_000),
            [(30, 200, PERIOD_US); 1_100],
        );
        assert_eq!(played.last(), Some(&30));
    }

    /// Tests every rise that a wearer may have, with a burst in each window.
    #[test]
    fn no_rise_is_quicker_than_the_wearers() {
        let full = Amplitude::new(100_000);
        for rise_us in (1..=5_000).map(|ms| ms * 1_000) {
            let start = Micros::new(u32::MAX - rise_us / 2);
            let mut rise = Rise::default();
            let mut last = Amplitude::ZERO;
            for after in (0..=rise_us).step_by(250) {
                let time = BurstTime {
                    at: start + us(after),
                    period_us: 250,
                    opens: false,
                };
                let parts = rise
                    .note_burst(time, (rise_us, 1))
                    .parts
                    .into_iter()
                    .flatten();
                let now = parts.fold(full, |least, (a, b)| least.min(scale(full, a, b)));
                let (after, total) = (u64::from(after) + 250, u64::from(rise_us) + 250);
                let most = u64::from(full.get()) * after / total;
                assert!(
                    now >= last && u64::from(now.get()) <= most,
                    "{rise_us}: {after}"
                );
                last = now;
            }
            assert_eq!(last, full);
        }
    }
}
