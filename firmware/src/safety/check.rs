//! The electrode check before arming: pulses that rise from DAC code 1, and the judgement of one
//! reading of the current.

use super::{Setup, Stage};
use crate::board::wiring::BOARD;
use crate::pulse::{CHANNELS, Train, TrainSpec, WINDOW_US};
use crate::units::{Amplitude, DacCode, MicroAmps};

/// Current at the largest reading of the current sense, 4095 counts, in µA.
const SENSE_FULL_SCALE_UA: u32 = BOARD.stages.sense_full_scale_ua;
// A reading of twelve bits times this fits in a word.
const _: () = assert!(SENSE_FULL_SCALE_UA < 1 << 20);
/// Largest 12-bit reading.
const SENSE_FULL_SCALE: u16 = 4095;

/// Tolerance of two counts: the offset and the rounding of the current sense.
const SLACK_COUNTS: u32 = 2;
/// Tolerance of a reading, µA: [`SLACK_COUNTS`] counts.
pub(super) const SLACK_UA: u32 = SLACK_COUNTS * SENSE_FULL_SCALE_UA / SENSE_FULL_SCALE as u32;

/// Time from the start of a window to the refill that receives the current sampled in it, µs.
pub(super) const SENSED_US: u32 = 2 * WINDOW_US;

/// Distance between the check pulses of two channels, µs: one window for each phase.
const SPACING_US: u32 = 2 * WINDOW_US;

/// Number of rising amplitudes in an electrode check, from DAC code 1 to the final amplitude.
const STEPS: u32 = 4;

/// Shortest time from the start of one check to the start of the next, µs, however the check
/// ended. A host that stops and arms again and again thus causes at most 24 check pulses on a
/// channel in any second, eight in each of three checks, and the answer to `Arm` comes within the
/// half second that hosts wait for it. Check pulses are below the motor threshold and have at most
/// 0.2 µC each, so they count towards neither time nor charge. An `Arm` that comes sooner waits
/// and is not refused, because it is no error of the host.
pub const CHECK_PAUSE_US: u32 = 400_000;

/// Check train: two pulses of 100 µs per phase, one window apart and below the motor threshold,
/// repeated [`STEPS`] times. The current sense samples the first phase of one pulse and the second
/// phase of the other.
const PROBE: TrainSpec = TrainSpec {
    repeats: STEPS as u16,
    burst_count: 2,
    burst_interval_us: WINDOW_US as u16,
    ..TrainSpec::biphasic(100, 25, CHANNELS as u32 * SPACING_US)
};

// A check pulse begins with a window and ends inside it, so that a check can be stopped between
// any two windows without truncating a pulse.
const _: () = assert!(2 * PROBE.width_us as u32 + PROBE.gap_us as u32 <= WINDOW_US);

/// Current sampled in the middle of a phase.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Reading {
    /// Channel whose pulse was sampled, from 0.
    pub channel: u8,
    /// Whether the second phase was sampled, not the first.
    pub second: bool,
    /// Reading of the converter, 12 bits.
    pub raw: u16,
}

impl Reading {
    /// Returns the measured current, rounded down; 4095 counts are the full scale of the board's
    /// current sense.
    #[must_use]
    pub const fn current(&self) -> MicroAmps {
        current(self.raw)
    }

    /// Returns the reading that `current` gives on the reference board, saturating at 4095 counts.
    #[must_use]
    pub fn from_current(channel: u8, second: bool, current: MicroAmps) -> Self {
        let raw =
            u64::from(current.get()) * u64::from(SENSE_FULL_SCALE) / u64::from(SENSE_FULL_SCALE_UA);
        Self {
            channel,
            second,
            raw: raw.min(SENSE_FULL_SCALE.into()) as u16,
        }
    }
}

const fn current(raw: u16) -> MicroAmps {
    let raw = raw as u32 & 0xFFF; // twelve bits, so that the product stays below 2^29
    MicroAmps::new(raw * SENSE_FULL_SCALE_UA / SENSE_FULL_SCALE as u32)
}

/// A reading and the amplitude that caused it, which together give a conductance.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub(super) struct Load {
    pub(super) raw: u16,
    pub(super) applied: Amplitude,
}

impl Load {
    /// Returns the load for a `reading` that was sampled while `applied` was output.
    pub(super) const fn from_reading(reading: Reading, applied: Amplitude) -> Self {
        let raw = reading.raw & 0xFFF; // twelve bits
        Self { raw, applied }
    }

    /// Combines both values into one word, because the checksum over it is computed at every burst.
    /// A bit flip in either value changes the word.
    #[inline]
    pub(super) fn word(self) -> u32 {
        self.applied.get().rotate_left(12) ^ u32::from(self.raw)
    }

    /// Returns whether the resistance of this load is more than `times` that of `reference`, even if each
    /// reading is wrong by two counts. Both must come from a voltage stage.
    pub(super) fn is_above(self, times: u32, reference: Self) -> bool {
        // At most 4097 · 4 · 150 000, below 2^32: nothing wraps.
        let (this, of_raw) = (u32::from(self.raw) + SLACK_COUNTS, u32::from(reference.raw));
        let least = this
            .wrapping_mul(times)
            .wrapping_mul(reference.applied.get());
        least
            < of_raw
                .saturating_sub(SLACK_COUNTS)
                .wrapping_mul(self.applied.get())
    }

    /// Returns whether both loads were measured at similar amplitudes, at most 25 % apart, so that
    /// a difference between the readings is due to the load.
    pub(super) fn is_near(self, other: Self) -> bool {
        let (a, b) = (self.applied.get(), other.applied.get()); // at most 150 000
        4 * a <= 5 * b && 4 * b <= 5 * a
    }
}

/// Judgement of a channel's electrode from one reading.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Electrode {
    /// Plausible current.
    Fine,
    /// Too little current: the electrode is off.
    Off,
    /// Too much current: the electrode is shorted.
    Short,
}

/// An electrode check in progress: which phases of which channels still lack a plausible reading.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct ElectrodeCheck {
    /// Channels that lack a plausible reading of the first phase, and of the second phase; bit i is
    /// channel i.
    pending: [u16; 2],
}

impl ElectrodeCheck {
    /// Returns a check of every channel in `setup`.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let mut pending = 0;
        for (channel, config) in setup.channels.iter().enumerate() {
            if config.is_some() {
                pending |= 1 << channel;
            }
        }
        Self {
            pending: [pending; 2],
        }
    }

    /// Returns the trains of the check pulses, one channel after the other.
    #[must_use]
    pub fn trains(&self) -> [Option<Train>; CHANNELS] {
        let [pending, _] = self.pending;
        let mut trains = [None; CHANNELS];
        for (channel, train) in (0u32..).zip(&mut trains) {
            if pending & 1 << channel != 0 {
                let spec = TrainSpec {
                    offset_us: channel * SPACING_US,
                    ..PROBE
                };
                *train = spec.validate().ok();
            }
        }
        trains
    }

    /// Returns the time from the check's start to its result, µs: every pulse, and time for the
    /// last reading.
    #[must_use]
    pub const fn length_us() -> u32 {
        STEPS * PROBE.period_us + 4 * SPACING_US
    }

    /// Returns whether the last amplitude of the check is output `elapsed_us` after its start.
    pub(super) const fn is_last_step(elapsed_us: u32) -> bool {
        elapsed_us / PROBE.period_us + 1 >= STEPS
    }

    /// Returns the DAC code `elapsed_us` after the check's start: first 1, then with equal ratios
    /// (as far as bit shifts allow) up to `last`.
    pub(super) const fn code(last: DacCode, elapsed_us: u32) -> DacCode {
        let bits = u16::BITS - last.get().leading_zeros();
        let step = elapsed_us / PROBE.period_us;
        // Each below 32: the shift is at most 15.
        let left = (STEPS - 1).saturating_sub(step);
        DacCode::new(last.get() >> (bits.saturating_sub(1) * left / (STEPS - 1)))
    }

    /// Marks a phase as passed, because its reading was plausible.
    pub const fn mark_passed(&mut self, channel: u8, second: bool) {
        let [of_first, of_second] = &mut self.pending;
        let pending = if second { of_second } else { of_first };
        *pending &= !(1u16 << (channel % 16));
    }

    /// Returns the first channel that still lacks a plausible reading, and whether only one of its
    /// two phases lacks it.
    #[must_use]
    pub fn first_missing(&self) -> Option<(u8, bool)> {
        let [first, second] = self.pending;
        let owing = first | second;
        let channel = owing.trailing_zeros();
        (owing != 0).then(|| (channel as u8, (first ^ second) >> channel & 1 != 0))
    }
}

/// Judges `reading` on a channel that `stage` drives with `amplitude`.
#[must_use]
pub fn judge(reading: Reading, stage: &Stage, amplitude: Amplitude) -> Electrode {
    let (low, high) = stage.plausible_current(amplitude);
    let ua = reading.current().get();
    if ua + SLACK_UA < low.get() {
        Electrode::Off
    } else if ua > high.get().saturating_add(SLACK_UA) {
        Electrode::Short
    } else {
        Electrode::Fine
    }
}

/// Returns whether `reading` is above `max`, the current that the channel's limits allow, by more
/// than 5 % and two counts.
#[must_use]
pub(super) const fn is_above_limit(reading: Reading, max: MicroAmps) -> bool {
    let max = max.get(); // at most 100 000
    reading.current().get() > max + max / 20 + SLACK_UA
}

/// Returns an upper bound on the load of a voltage stage, Ω, from the amplitude and the reading in
/// `found`. Two counts are subtracted from the reading; `None` if nothing is left.
#[must_use]
pub(super) fn least_load_ohm(found: Load) -> Option<u32> {
    let ua = current(found.raw).get().checked_sub(SLACK_UA)?;
    // mV · 1000 / µA = Ω; at most 150 000 · 1000.
    let mv_by_1000 = found.applied.get().saturating_mul(1000);
    (ua != 0).then(|| mv_by_1000.div_ceil(ua))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::StageSpec;

    #[test]
    fn open_and_shorted_electrodes_are_told_apart() {
        let volts = StageSpec::Voltage {
            full_scale_mv: 60_000,
            load_ohm: 2_000,
        }
        .validate()
        .unwrap();
        let reading = |ua| Reading::from_current(0, false, MicroAmps::new(ua));
        let v2 = Amplitude::new(20_000);
        let at = |ohm: u32| judge(reading(20_000_000 / ohm), &volts, v2);
        assert_eq!(at(2_000), Electrode::Fine);
        assert_eq!(at(1_000_000), Electrode::Off);
        assert_eq!(at(180), Electrode::Fine);
        let amps = StageSpec::Current {
            full_scale_ua: 100_000,
        }
        .validate()
        .unwrap();
        let i = |ua| judge(reading(ua), &amps, Amplitude::new(10_000));
        assert_eq!(i(10_000), Electrode::Fine);
        assert_eq!(i(100), Electrode::Off);
        assert_eq!(i(30_000), Electrode::Short);
    }

    #[test]
    fn the_check_rises_from_code_1_to_its_last() {
        let period_us = PROBE.period_us;
        let codes = |last| {
            [0, 1, 2, 3].map(|n| ElectrodeCheck::code(DacCode::new(last), n * period_us).get())
        };
        assert_eq!(codes(655), [1, 10, 81, 655]);
        assert_eq!(codes(65_535), [1, 63, 2_047, 65_535]);
        assert_eq!(codes(1), [1; 4]);
        assert_eq!(codes(0), [0; 4], "less than a step of the DAC");
        for last in 1..=u16::MAX {
            let codes = codes(last);
            assert_eq!((codes[0], codes[3]), (1, last));
            assert!(codes.is_sorted(), "{codes:?}");
        }
    }

    /// 2 V through 1 kΩ give 68 counts; two counts less correspond to 1035 Ω.
    #[test]
    fn a_load_is_taken_with_two_counts_less() {
        let found = |raw| Load {
            raw,
            applied: Amplitude::new(2_000),
        };
        assert_eq!(least_load_ohm(found(68)), Some(1_035));
        assert_eq!([0, 1].map(found).map(least_load_ohm), [None; 2]);
    }
}
