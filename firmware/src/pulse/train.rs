//! One channel's pulse train: what a host asks for and its validated form.

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
    /// Whether a second, opposite phase balances the first.
    #[must_use]
    pub const fn is_biphasic(self) -> bool {
        matches!(
            self,
            Self::BiphasicCathodicFirst | Self::BiphasicAnodicFirst
        )
    }

    /// Whether the first phase is cathodic.
    #[must_use]
    pub const fn cathodic_first(self) -> bool {
        matches!(self, Self::BiphasicCathodicFirst | Self::MonophasicCathodic)
    }
}

/// What the trigger input does to a train that waits for it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum Trigger {
    /// An edge starts it.
    Start,
    /// An edge starts it, and the next one ends it: no pulse begins after that.
    Toggle,
    /// It plays while the input is held: an edge starts it, its release ends it. Nothing
    /// begins before the input was seen released.
    Gated,
}

/// A train as a host asks for it; nothing in it is trusted.
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
    /// Largest width that a setpoint may ask for, `width_us`–500 µs; 0 for a width that
    /// never changes. Everything a train is checked for holds at this width.
    pub max_width_us: u16,
    /// Interphase gap, 0–200 µs. The phases of a biphasic pulse are isolated
    /// for this long, and never shorter than [`DEAD_TIME_US`]. 0 for monophasic.
    pub gap_us: u16,
    /// Grounding after each pulse, 1000–20 000 µs. 0 after biphasic ones for none: what
    /// their phases differ by is then direct current (docs/hardware.md, series capacitor).
    pub ground_us: u16,
    /// Burst start to burst start, 5000–2 000 000 µs (0.5–200 Hz).
    pub period_us: u32,
    /// Phase offset of the first burst against the common epoch, 0–period, µs.
    pub offset_us: u32,
    /// Pulses per burst: 1 (single) to 8 (octuplet).
    pub burst_count: u8,
    /// Pulse start to pulse start inside a burst, 200–50 000 µs; 0 for singles.
    pub burst_interval_us: u16,
    /// Bursts to play, 0 for until stopped.
    pub repeats: u16,
    /// What the trigger input does to it; none starts at the common epoch.
    pub trigger: Option<Trigger>,
    /// Takes lists of pulses, which come when they are asked for: endless single pulses
    /// from the common epoch only.
    pub lists: bool,
}

/// Why a train cannot be played.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TrainError {
    /// A field outside its range.
    Range(OutOfRange),
    /// Pulses of a burst would overlap: the interval must be at least
    /// `min_interval_us`.
    BurstOverlaps {
        /// Shortest allowed interval for this waveform, µs.
        min_interval_us: u32,
    },
    /// The last edge of a burst plus two windows passes the next burst:
    /// the period must be at least `min_period_us`.
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

/// A train that can be played as it is. Only [`TrainSpec::validate`] makes one.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Train {
    spec: TrainSpec,
    gap_us: u16,
}

/// In words as they lie in memory, for it is summed with every burst, three times: a bit
/// that changes in any field changes its word.
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
    /// Of [`Self::width_us`].
    pub const WIDTH_US: Range = Range::new("width_us", 10, 500);
    /// Of [`Self::max_width_us`], of a width that may change.
    pub const MAX_WIDTH_US: Range = Range {
        field: "max_width_us",
        ..Self::WIDTH_US
    };
    /// Of [`Self::gap_us`], of a biphasic pulse.
    pub const GAP_US: Range = Range::new("gap_us", 0, 200);
    /// Of [`Self::ground_us`], of pulses that are grounded; monophasic ones must be.
    pub const GROUND_US: Range = Range::new("ground_us", 1_000, 20_000);
    /// Of [`Self::period_us`].
    pub const PERIOD_US: Range = Range::new("period_us", 5_000, 2_000_000);
    /// Of [`Self::offset_us`], at the longest period.
    pub const OFFSET_US: Range = Range::new("offset_us", 0, Self::PERIOD_US.max);
    /// Of [`Self::burst_count`].
    pub const BURST_COUNT: Range = Range::new("burst_count", 1, 8);
    /// Of [`Self::burst_interval_us`], of a burst of several pulses.
    pub const BURST_INTERVAL_US: Range = Range::new("burst_interval_us", 200, 50_000);

    /// Endless single pulses, cathodic phase first, every `period_us` from the epoch
    /// on.
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

    /// The same of one cathodic phase and grounding.
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
    /// The first violated rule, with the values that would be allowed.
    pub fn validate(&self) -> Result<Train, TrainError> {
        let biphasic = self.shape.is_biphasic();
        let burst = self.burst_count > 1;
        // What does not apply must be 0.
        let only_if = |applies, range: Range| {
            if applies {
                range
            } else {
                Range::new(range.field, 0, 0)
            }
        };
        Self::WIDTH_US.check(self.width_us)?;
        if self.max_width_us != 0 {
            let from_own = Self::MAX_WIDTH_US.from(self.width_us.into());
            from_own.check(self.max_width_us)?;
        }
        only_if(biphasic, Self::GAP_US).check(self.gap_us)?;
        if !biphasic || self.ground_us != 0 {
            Self::GROUND_US.check(self.ground_us)?;
        }
        Self::PERIOD_US.check(self.period_us)?;
        Self::OFFSET_US
            .up_to(self.period_us)
            .check(self.offset_us)?;
        Self::BURST_COUNT.check(self.burst_count)?;
        only_if(burst, Self::BURST_INTERVAL_US).check(self.burst_interval_us)?;
        if self.lists {
            // What does not go with lists.
            Self::BURST_COUNT.up_to(1).check(self.burst_count)?;
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
        // Largest: 1200 + 20 000 µs; all sums below stay under 2^20.
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
    /// What was asked for.
    #[must_use]
    pub const fn spec(&self) -> &TrainSpec {
        &self.spec
    }

    /// Isolated time between the two phases, dead time included, in µs; 0 for
    /// monophasic pulses.
    #[must_use]
    pub const fn gap_us(&self) -> u16 {
        self.gap_us
    }

    /// The largest width of a phase, in µs: the train's own if it never changes.
    #[must_use]
    pub const fn widest_us(&self) -> u16 {
        if self.has_live_width() {
            self.spec.max_width_us
        } else {
            self.spec.width_us
        }
    }

    /// Whether a setpoint may ask for another width than the train's own.
    #[must_use]
    #[inline]
    pub const fn has_live_width(&self) -> bool {
        self.spec.max_width_us > self.spec.width_us
    }

    /// The widths that a setpoint may ask for, µs.
    #[must_use]
    #[inline]
    pub const fn widths(&self) -> RangeInclusive<u16> {
        if self.has_live_width() {
            TrainSpec::WIDTH_US.min as u16..=self.spec.max_width_us // from 10
        } else {
            self.spec.width_us..=self.spec.width_us
        }
    }

    /// Time driven in one burst with phases of `width_us`, in µs: every phase of every
    /// pulse.
    #[must_use]
    pub const fn on_us(&self, width_us: u16) -> u32 {
        let phases = if self.spec.shape.is_biphasic() { 2 } else { 1 };
        phases * width_us as u32 * self.spec.burst_count as u32 // at most 8000
    }

    /// First edge to the end of the last driven phase of one pulse at its widest, in µs.
    #[must_use]
    pub const fn driven_us(&self) -> u32 {
        self.driven_at(self.widest_us())
    }

    /// The same with phases of `width_us`.
    const fn driven_at(&self, width_us: u16) -> u32 {
        if self.spec.shape.is_biphasic() {
            2 * width_us as u32 + self.gap_us as u32
        } else {
            width_us as u32
        }
    }

    /// First to last edge of one pulse with phases of `width_us`, grounding included, in
    /// µs.
    #[must_use]
    pub const fn occupied_us(&self, width_us: u16) -> u32 {
        self.driven_at(width_us) + self.spec.ground_us as u32
    }

    /// First to last edge of one burst at its widest, in µs.
    #[must_use]
    pub const fn burst_us(&self) -> u32 {
        self.pulse_offset_us(self.spec.burst_count.saturating_sub(1))
            + self.occupied_us(self.widest_us())
    }

    /// Burst start to the start of its pulse `index`, in µs.
    #[must_use]
    pub const fn pulse_offset_us(&self, index: u8) -> u32 {
        // At most 255 × 65 535 < 2^24.
        index as u32 * self.spec.burst_interval_us as u32
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// 200 µs biphasic at 50 Hz.
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
        assert_eq!((train.occupied_us(200), train.on_us(10)), (500, 40));
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
