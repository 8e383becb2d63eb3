//! The electrode check before arming, and the watch on electrodes after it:
//! mid-phase current against what the amplitude lets expect.

use super::Setup;
use crate::pulse::{CHANNELS, Train, TrainSpec, WINDOW_US};
use crate::units::{Amplitude, MicroAmps};

/// Current sense at 4095 counts, µA (docs/hardware.md, current sense).
const SENSE_FULL_SCALE_UA: u32 = 120_000;

/// Distance between the check pulses of two channels, µs.
const SPACING_US: u32 = 2_000;

// A check pulse begins with a window and ends inside it, so that a check can be
// broken off between any two windows without truncating a pulse.
const _: () = assert!(
    SPACING_US.is_multiple_of(WINDOW_US)
        && 2 * PROBE.width_us as u32 + PROBE.gap_us as u32 <= WINDOW_US
);

/// A sub-threshold pulse: 100 µs per phase, once.
const PROBE: TrainSpec = TrainSpec {
    repeats: 1,
    ..TrainSpec::biphasic(100, 25, 100_000)
};

/// A mid-phase current sample.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Reading {
    /// Channel that was pulsing, from 0.
    pub channel: u8,
    /// 12-bit conversion.
    pub raw: u16,
}

impl Reading {
    /// The current.
    #[must_use]
    pub const fn current(&self) -> MicroAmps {
        // At most 65 535 · 120 000 / 4095 before the division fits u64.
        MicroAmps::new((self.raw as u64 * SENSE_FULL_SCALE_UA as u64 / 4095) as u32)
    }

    /// The conversion that `current` gives on the reference board, saturating.
    #[must_use]
    pub fn of(channel: u8, current: MicroAmps) -> Self {
        let raw = u64::from(current.get()) * 4095 / u64::from(SENSE_FULL_SCALE_UA);
        Self {
            channel,
            raw: raw.min(4095) as u16,
        }
    }
}

/// What one channel's electrode looks like.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Electrode {
    /// Plausible current.
    Fine,
    /// Too little.
    Off,
    /// Too much.
    Short,
}

/// A check under way: which channels still owe a reading.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct ElectrodeCheck {
    pending: u16,
}

impl ElectrodeCheck {
    /// A check of every channel in `setup`.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let mut pending = 0;
        for (channel, config) in setup.channels.iter().enumerate() {
            if config.is_some() {
                pending |= 1 << channel;
            }
        }
        Self { pending }
    }

    /// The check pulses, one channel after the other.
    #[must_use]
    pub fn trains(&self) -> [Option<Train>; CHANNELS] {
        let mut trains = [None; CHANNELS];
        for (channel, train) in (0u32..).zip(&mut trains) {
            if self.pending & 1 << channel != 0 {
                let spec = TrainSpec {
                    offset_us: channel * SPACING_US,
                    ..PROBE
                };
                *train = spec.validate().ok();
            }
        }
        trains
    }

    /// From the check's epoch to its verdict, µs: every pulse and one spacing.
    #[must_use]
    pub const fn length_us() -> u32 {
        (CHANNELS as u32 + 1) * SPACING_US
    }

    /// Ticks off a channel that read plausibly.
    pub const fn passed(&mut self, channel: u8) {
        self.pending &= !(1u16 << (channel % 16));
    }

    /// The first channel still owing a plausible reading.
    #[must_use]
    pub fn missing(&self) -> Option<u8> {
        (self.pending != 0).then(|| self.pending.trailing_zeros() as u8)
    }
}

/// Judges `reading` on a channel put to `amplitude` by `stage`.
#[must_use]
pub fn judge(reading: Reading, stage: &super::Stage, amplitude: Amplitude) -> Electrode {
    let (low, high) = stage.plausible(amplitude);
    // One count is 29 µA: below two counts of slack nothing is known.
    let slack = 2 * SENSE_FULL_SCALE_UA / 4095;
    let ua = reading.current().get();
    if ua + slack < low.get() {
        Electrode::Off
    } else if ua > high.get().saturating_add(slack) {
        Electrode::Short
    } else {
        Electrode::Fine
    }
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
        let reading = |ua| Reading::of(0, MicroAmps::new(ua));
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
}
