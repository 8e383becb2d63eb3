//! One channel's pulse train: a host's request and its validated form.

use super::{DEAD_TIME_US, WINDOW_US};
use crate::range::{OutOfRange, Range};
use core::hash::{Hash, Hasher};
use core::ops::RangeInclusive;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Waveform of a single pulse.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum Shape {
    /// Symmetric biphasic, cathodic phase first.
    BiphasicCathodicFirst,
    /// Symmetric biphasic, anodic phase first.
    BiphasicAnodicFirst,
    /// One cathodic phase, then grounding (Hamana 2022, figure 4).
    MonophasicCathodic,
    /// One anodic phase, then grounding.
    MonophasicAnodic,
}

impl Shape {
    /// Returns whether a second, opposite phase balances the first.
    #[must_use]
    pub const fn is_biphasic(self) -> bool {
        matches!(
            self,
            Self::BiphasicCathodicFirst | Self::BiphasicAnodicFirst
        )
    }

    /// Returns whether the first phase is cathodic.
    #[must_use]
    pub const fn cathodic_first(self) -> bool {
        matches!(self, Self::BiphasicCathodicFirst | Self::MonophasicCathodic)
    }
}

/// The effect of the trigger input on a train that waits for it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum Trigger {
    /// An edge starts the train.
    Start,
    /// An edge starts the train, and the next edge ends it: no pulse begins after that.
    Toggle,
    /// The train plays while the input is active: an edge starts it, the release ends it. No train
    /// begins before the input was sampled as released.
    Gated,
}

/// A pulse train as a host configures it, with all values unchecked.
///
/// ```
/// use firmware::pulse::{TrainError, TrainSpec};
///
/// // 200 µs a phase, 100 µs between them, 50 times a second, until stopped.
/// let spec = TrainSpec::biphasic(200, 100, 20_000);
/// assert_eq!(spec.validate().unwrap().burst_us(), 500);
/// // Two pulses 400 µs apart would overlap.
/// let doublet = TrainSpec { burst_count: 2, burst_interval_us: 400, ..spec };
/// let overlaps = TrainError::BurstOverlaps { min_interval_us: 505 };
/// assert_eq!(doublet.validate(), Err(overlaps));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct TrainSpec {
    /// Waveform of each pulse.
    pub shape: Shape,
    /// Width of one phase, 10–500 µs.
    pub width_us: u16,
    /// Largest width that a setpoint may ask for, `width_us`–500 µs; 0 for a width that never
    /// changes. Every check of a train holds at this width too.
    pub max_width_us: u16,
    /// Interphase gap, 0–200 µs. Between the phases of a biphasic pulse the output is disconnected
    /// for this time, but at least for [`DEAD_TIME_US`]. 0 for monophasic pulses.
    pub gap_us: u16,
    /// Grounding after each pulse, 1000–20 000 µs. 0 means none, which only biphasic pulses may
    /// have: a difference between their phases is then direct current (docs/reference/hardware.md, series
    /// capacitor).
    pub ground_us: u16,
    /// Time from burst start to burst start, 5000–2 000 000 µs (0.5–200 Hz).
    pub period_us: u32,
    /// Phase offset of the first burst relative to the common epoch, 0–period, µs.
    pub offset_us: u32,
    /// Number of pulses per burst: 1 (single) to 8 (octuplet).
    pub burst_count: u8,
    /// Time from pulse start to pulse start inside a burst, 200–50 000 µs; 0 for single pulses.
    pub burst_interval_us: u16,
    /// Number of bursts to play; 0 means until stopped.
    pub repeats: u16,
    /// Effect of the trigger input; a train without one starts at the common epoch.
    pub trigger: Option<Trigger>,
    /// Whether the train takes lists of pulses, which play when a host sends them. Only endless
    /// single pulses from the common epoch may.
    pub lists: bool,
}

/// The reason why a train cannot be played.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TrainError {
    /// A field is outside its range.
    Range(OutOfRange),
    /// Pulses of a burst would overlap: the interval must be at least `min_interval_us`.
    BurstOverlaps {
        /// Shortest allowed interval for this waveform, µs.
        min_interval_us: u32,
    },
    /// The last edge of a burst plus two windows comes after the start of the next burst: the
    /// period must be at least `min_period_us`.
    BurstTooLong {
        /// Shortest allowed period for this burst, µs.
        min_period_us: u32,
    },
}

impl From<OutOfRange> for TrainError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

/// A train that passed [`TrainSpec::validate`] and can be played without further checks.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Train {
    spec: TrainSpec,
    gap_us: u16,
}

/// Hashes words as they are stored in memory, because the checksum over them is computed three
/// times at every burst. A bit flip in any field changes its word.
impl Hash for TrainSpec {
    #[inline]
    fn hash<H: Hasher>(&self, state: &mut H) {
        let halves = |low: u16, high: u16| u32::from(low) | u32::from(high) << 16;
        let trigger = match self.trigger {
            Some(trigger) => trigger as u8,
            None => 2,
        };
        let bytes = [
            self.burst_count,
            self.shape as u8,
            trigger,
            u8::from(self.lists),
        ];
        state.write_u32(halves(self.width_us, self.max_width_us));
        state.write_u32(halves(self.gap_us, self.ground_us));
        state.write_u32(halves(self.burst_interval_us, self.repeats));
        state.write_u32(u32::from_le_bytes(bytes));
        state.write_u32(self.period_us);
        state.write_u32(self.offset_us);
    }
}

impl TrainSpec {
    /// Range of [`Self::width_us`].
    pub const WIDTH_US: Range = Range::new("width_us", 10, 500);
    /// Range of [`Self::max_width_us`], if the width may change.
    pub const MAX_WIDTH_US: Range = Range {
        field: "max_width_us",
        ..Self::WIDTH_US
    };
    /// Range of [`Self::gap_us`] of biphasic pulses.
    pub const GAP_US: Range = Range::new("gap_us", 0, 200);
    /// Range of [`Self::ground_us`] of pulses that are grounded; monophasic pulses must be.
    pub const GROUND_US: Range = Range::new("ground_us", 1_000, 20_000);
    /// Range of [`Self::period_us`].
    pub const PERIOD_US: Range = Range::new("period_us", 5_000, 2_000_000);
    /// Range of [`Self::offset_us`], at the longest period.
    pub const OFFSET_US: Range = Range::new("offset_us", 0, Self::PERIOD_US.max);
    /// Range of [`Self::burst_count`].
    pub const BURST_COUNT: Range = Range::new("burst_count", 1, 8);
    /// Range of [`Self::burst_interval_us`] of bursts with several pulses.
    pub const BURST_INTERVAL_US: Range = Range::new("burst_interval_us", 200, 50_000);

    /// Returns endless single biphasic pulses, cathodic phase first, every `period_us`.
    #[must_use]
    pub const fn biphasic(width_us: u16, gap_us: u16, period_us: u32) -> Self {
        Self {
            shape: Shape::BiphasicCathodicFirst,
            width_us,
            max_width_us: 0,
            gap_us,
            ground_us: 0,
            period_us,
            offset_us: 0,
            burst_count: 1,
            burst_interval_us: 0,
            repeats: 0,
            trigger: None,
            lists: false,
        }
    }

    /// Returns endless single pulses of one cathodic phase and grounding, every `period_us`.
    #[must_use]
    pub const fn monophasic(width_us: u16, ground_us: u16, period_us: u32) -> Self {
        Self {
            shape: Shape::MonophasicCathodic,
            ground_us,
            ..Self::biphasic(width_us, 0, period_us)
        }
    }

    /// Checks every field and the relations between them.
    ///
    /// # Errors
    /// Returns the first violated rule, with the values that would be allowed.
    pub fn validate(&self) -> Result<Train, TrainError> {
        let biphasic = self.shape.is_biphasic();
        let burst = self.burst_count > 1;
        // Fields that do not apply must be 0.
        let only_if = |applies, range: Range| {
            if applies {
                range
            } else {
                Range::new(range.field, 0, 0)
            }
        };
        Self::WIDTH_US.check(self.width_us)?;
        if self.max_width_us != 0 {
            let from_own = Self::MAX_WIDTH_US.with_min_at_least(self.width_us.into());
            from_own.check(self.max_width_us)?;
        }
        only_if(biphasic, Self::GAP_US).check(self.gap_us)?;
        if !biphasic || self.ground_us != 0 {
            Self::GROUND_US.check(self.ground_us)?;
        }
        Self::PERIOD_US.check(self.period_us)?;
        Self::OFFSET_US
            .with_max_at_most(self.period_us)
            .check(self.offset_us)?;
        Self::BURST_COUNT.check(self.burst_count)?;
        only_if(burst, Self::BURST_INTERVAL_US).check(self.burst_interval_us)?;
        if self.lists {
            // Fields that lists exclude.
            Self::BURST_COUNT
                .with_max_at_most(1)
                .check(self.burst_count)?;
            Range::new("repeats", 0, 0).check(self.repeats)?;
            Range::new("trigger", 0, 0).check(self.trigger.is_some())?;
        }
        let train = Train {
            spec: *self,
            gap_us: if biphasic {
                self.gap_us.max(DEAD_TIME_US)
            } else {
                0
            },
        };
        // The largest value is 1200 + 20 000 µs; all sums below stay under 2^20.
        let min_interval_us = train.occupied_us(train.widest_us()) + u32::from(DEAD_TIME_US);
        if burst && u32::from(self.burst_interval_us) < min_interval_us {
            return Err(TrainError::BurstOverlaps { min_interval_us });
        }
        let min_period_us = train.burst_us() + 2 * WINDOW_US;
        if self.period_us < min_period_us {
            return Err(TrainError::BurstTooLong { min_period_us });
        }
        Ok(train)
    }
}

impl Train {
    /// Returns the specification that was validated.
    #[must_use]
    pub const fn spec(&self) -> &TrainSpec {
        &self.spec
    }

    /// Returns the disconnected time between the phases, µs, dead time included; 0 if monophasic.
    #[must_use]
    pub const fn gap_us(&self) -> u16 {
        self.gap_us
    }

    /// Returns the largest width of a phase, in µs: the train's own if it never changes.
    #[must_use]
    pub const fn widest_us(&self) -> u16 {
        if self.has_live_width() {
            self.spec.max_width_us
        } else {
            self.spec.width_us
        }
    }

    /// Returns whether a setpoint may ask for a width other than the train's own.
    #[must_use]
    #[inline]
    pub const fn has_live_width(&self) -> bool {
        self.spec.max_width_us > self.spec.width_us
    }

    /// Returns the widths that a setpoint may ask for, µs.
    #[must_use]
    #[inline]
    pub const fn widths(&self) -> RangeInclusive<u16> {
        if self.has_live_width() {
            TrainSpec::WIDTH_US.min as u16..=self.spec.max_width_us // from 10
        } else {
            self.spec.width_us..=self.spec.width_us
        }
    }

    /// Returns the driven time in one burst with phases of `width_us`, in µs, summed over every
    /// phase of every pulse.
    #[must_use]
    pub const fn burst_driven_us(&self, width_us: u16) -> u32 {
        let phases = if self.spec.shape.is_biphasic() { 2 } else { 1 };
        phases * width_us as u32 * self.spec.burst_count as u32 // at most 8000
    }

    /// Returns the time from the first edge to the end of the last driven phase of one pulse at
    /// its largest width, in µs.
    #[must_use]
    pub const fn driven_us(&self) -> u32 {
        self.driven_us_at_width(self.widest_us())
    }

    /// Returns [`Self::driven_us`] for phases of `width_us`.
    const fn driven_us_at_width(&self, width_us: u16) -> u32 {
        if self.spec.shape.is_biphasic() {
            2 * width_us as u32 + self.gap_us as u32
        } else {
            width_us as u32
        }
    }

    /// Returns the time from the first to the last edge of one pulse with phases of `width_us`,
    /// grounding included, in µs.
    #[must_use]
    pub const fn occupied_us(&self, width_us: u16) -> u32 {
        self.driven_us_at_width(width_us) + self.spec.ground_us as u32
    }

    /// Returns the time from the first to the last edge of one burst at its largest width, in µs.
    #[must_use]
    pub const fn burst_us(&self) -> u32 {
        self.pulse_offset_us(self.spec.burst_count.saturating_sub(1))
            + self.occupied_us(self.widest_us())
    }

    /// Returns the time from the burst's start to the start of its pulse `index`, in µs.
    #[must_use]
    pub const fn pulse_offset_us(&self, index: u8) -> u32 {
        // At most 255 × 65 535 < 2^24.
        index as u32 * self.spec.burst_interval_us as u32
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Endless biphasic pulses of 200 µs per phase at 50 Hz.
    pub(crate) const PLAIN: TrainSpec = TrainSpec::biphasic(200, 100, 20_000);

    #[test]
    fn ranges_are_named() {
        type Change = fn(&mut TrainSpec);
        let cases: [(&str, Change); 11] = [
            ("width_us", |t| t.width_us = 9),
            ("width_us", |t| t.width_us = 501),
            ("max_width_us", |t| t.max_width_us = 199),
            ("max_width_us", |t| t.max_width_us = 501),
            ("gap_us", |t| t.gap_us = 201),
            ("ground_us", |t| t.ground_us = 1),
            ("period_us", |t| t.period_us = 4_999),
            ("period_us", |t| t.period_us = 2_000_001),
            ("offset_us", |t| t.offset_us = 20_001),
            ("burst_count", |t| t.burst_count = 9),
            ("burst_interval_us", |t| t.burst_interval_us = 1),
        ];
        for (field, change) in cases {
            let mut spec = PLAIN;
            change(&mut spec);
            match spec.validate() {
                Err(TrainError::Range(e)) => assert_eq!(e.field, field),
                other => panic!("{field}: {other:?}"),
            }
        }
    }

    #[test]
    fn gap_is_never_shorter_than_the_dead_time() {
        let train = TrainSpec { gap_us: 0, ..PLAIN }.validate().unwrap();
        assert_eq!(train.gap_us(), DEAD_TIME_US);
        assert_eq!(train.driven_us(), 405);
    }

    #[test]
    fn a_train_is_checked_at_its_widest() {
        let live = TrainSpec {
            max_width_us: 300,
            burst_count: 2,
            burst_interval_us: 705,
            ..PLAIN
        };
        let train = live.validate().unwrap();
        assert_eq!((train.widest_us(), train.driven_us()), (300, 700));
        assert_eq!(
            (train.occupied_us(200), train.burst_driven_us(10)),
            (500, 40)
        );
        assert_eq!(train.widths(), 10..=300);
        let tight = TrainSpec {
            burst_interval_us: 704,
            ..live
        };
        let overlaps = TrainError::BurstOverlaps {
            min_interval_us: 705,
        };
        assert_eq!(tight.validate(), Err(overlaps));
        let fixed = TrainSpec {
            max_width_us: 0,
            ..tight
        };
        let widths = fixed.validate().unwrap().widths();
        assert_eq!(widths, 200..=200);
    }

    #[test]
    fn bursts_must_fit() {
        let octuplet = TrainSpec {
            burst_count: 8,
            burst_interval_us: 505,
            ..PLAIN
        };
        assert_eq!(octuplet.validate().unwrap().burst_us(), 7 * 505 + 500);
        let tight = TrainSpec {
            burst_interval_us: 504,
            ..octuplet
        };
        assert_eq!(
            tight.validate(),
            Err(TrainError::BurstOverlaps {
                min_interval_us: 505
            })
        );
        let long = TrainSpec {
            burst_interval_us: 3000,
            ..octuplet
        };
        assert_eq!(
            long.validate(),
            Err(TrainError::BurstTooLong {
                min_period_us: 22_000
            })
        );
    }
}
