//! A channel's configuration, checked against every limit of the wearer.

use super::SetupError;
use crate::pulse::{Train, TrainSpec};
use crate::range::Range;
use crate::safety::measures::Measures;
use crate::safety::slope::Slope;
use crate::safety::{Stage, StageSpec, Stimulus, Wearer, limits};
use crate::units::{Amplitude, MicroAmps};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Longest driven part of any pulse, µs, by which another member of a group can delay the start of
/// a grounding.
const LONGEST_PULSE_US: u32 = 1_200;

/// A channel as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct ChannelSpec {
    /// Pulses of the channel: width, shape, period, and number of bursts.
    pub train: TrainSpec,
    /// Output stage that the host expects; it must match the board's.
    pub stage: StageSpec,
    /// The wearer's largest amplitude on this channel, in the stage's thousandths.
    pub limit: Amplitude,
    /// The largest amplitude that a rise reaches at once, in the stage's thousandths.
    pub start: Amplitude,
    /// Area of the channel's active electrode, 10–20 000 mm².
    pub area_mm2: u32,
}

/// A channel whose largest amplitude satisfies every limit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Channel {
    /// The channel's pulse train, checked to be playable.
    pub train: Train,
    /// The channel's output stage, whose fields are within their ranges.
    pub stage: Stage,
    /// The largest amplitude that is ever output, in the stage's thousandths.
    pub limit: Amplitude,
    /// The largest amplitude that a rise does not delay, in the stage's thousandths.
    pub start: Amplitude,
    /// The largest current that may flow: for a current stage its limit; for a voltage stage the
    /// largest that the limits of current, charge and rms allow.
    pub max_current: MicroAmps,
    /// Area of the active electrode, mm²; it bounds the rms current by the density.
    pub area_mm2: u32,
    /// Shortest period for which the limits were checked, µs.
    pub min_period_us: u32,
    /// Longest period that a controller may ask for, µs. The limits hold for it because they hold
    /// for the train's own period.
    pub max_period_us: u32,
    /// Charge of a burst at amplitude 1 and the train's own width, counting one phase of each
    /// pulse, in 256ths of a pC; rounded up.
    pub charge: u32,
    /// The width at which the limits of rms and density were checked with the largest amplitude,
    /// µs: no pulse with less charge than the wearer allows heats more. Equals the train's own
    /// width if that never changes.
    pub judged_width_us: u16,
}

impl ChannelSpec {
    /// Range of [`Self::limit`], at the largest full scale.
    pub const LIMIT: Range = Range::new("limit", 1, StageSpec::FULL_SCALE_MV.max);
    /// Range of [`Self::start`]; its maximum is the channel's limit.
    pub const START: Range = Range::new("start", 0, StageSpec::FULL_SCALE_MV.max);
    /// Range of [`Self::area_mm2`].
    pub const AREA_MM2: Range = Range::new("area_mm2", 10, 20_000);
    /// Area assumed if none is given: a disc of 32 mm diameter, 8 cm², the smallest self-adhesive
    /// electrode that the source of [`limits::MAX_DENSITY_UA_MM2`] names. The largest would make
    /// the density limit ineffective.
    pub const ASSUMED_AREA_MM2: u32 = 800;

    /// Checks the train and the stage, and that an amplitude at the limit satisfies the wearer's
    /// limits of current, charge per phase, rms current and current density.
    ///
    /// # Errors
    /// Returns the first limit exceeded, with its value.
    pub fn validate(&self, wearer: &Wearer) -> Result<Channel, SetupError> {
        let train = self.train.validate().map_err(SetupError::Train)?;
        let stage = self.stage.validate()?;
        let up_to_full_scale = Self::LIMIT.with_max_at_most(stage.full_scale().get());
        up_to_full_scale.check(self.limit.get())?;
        let up_to_limit = Self::START.with_max_at_most(self.limit.get());
        up_to_limit.check(self.start.get())?;
        let spec = train.spec();
        let current = stage.current(self.limit);
        let most = wearer.max_current().min(stage.max_current());
        if current > most {
            return Err(SetupError::Current { max: most });
        }
        let ua = current.get();
        // The grounding after a pulse that began before the fall must end within the fall.
        if spec.ground_us != 0 {
            let max = wearer.fall_us() - LONGEST_PULSE_US; // the fall takes 5 ms or more
            TrainSpec::GROUND_US
                .with_max_at_most(max)
                .check(spec.ground_us)?;
        }
        // ua <= 100 000 from here on. pC = µA·µs, at most 5e7.
        if u64::from(ua) * u64::from(spec.width_us) > u64::from(wearer.spec().max_charge_nc) * 1000
        {
            return Err(SetupError::Charge {
                max_nc: wearer.spec().max_charge_nc,
            });
        }
        Self::AREA_MM2.check(self.area_mm2)?;
        let judged_width_us = hottest_width_us(&train, current, wearer);
        let is_above = |max: MicroAmps| {
            let (ua, max_ua) = (u64::from(ua), u64::from(max.get()));
            // At most 1e10 · 8000 and 1.6e11 · 2e6: both fit u64.
            let squares = ua * ua * u64::from(train.burst_driven_us(judged_width_us));
            squares > max_ua * max_ua * u64::from(spec.period_us)
        };
        let max = wearer.max_rms();
        if is_above(max) {
            return Err(SetupError::Rms { max });
        }
        let max_density = MicroAmps::new(self.area_mm2 * limits::MAX_DENSITY_UA_MM2); // at most 4e5
        if is_above(max_density) {
            return Err(SetupError::Density { max: max_density });
        }
        let most_rms = max.min(max_density);
        let max_current = if stage.is_current() {
            current
        } else {
            max_train_current(&train, judged_width_us, most_rms, wearer).min(most)
        };
        Ok(Channel {
            train,
            stage,
            limit: self.limit,
            start: self.start,
            area_mm2: self.area_mm2,
            max_current,
            min_period_us: spec.period_us,
            max_period_us: spec.period_us,
            charge: charge_of(spec, spec.width_us, stage),
            judged_width_us,
        })
    }

    /// Checks like [`Self::validate`] a channel whose pulse rate may change while it stimulates,
    /// from a burst every `min_period_us` to one every `max_period_us` (the train's period if
    /// `None`). Every limit must hold at the highest rate too. A burst must be a single pulse, and
    /// the train must have neither trigger nor lists.
    ///
    /// # Errors
    /// Returns the same errors as [`Self::validate`], at the train's own rate and at the highest.
    pub fn validate_rates(
        &self,
        min_period_us: u32,
        max_period_us: Option<u32>,
        wearer: &Wearer,
    ) -> Result<Channel, SetupError> {
        let channel = self.validate(wearer)?;
        let TrainSpec {
            period_us,
            burst_count,
            trigger,
            lists,
            ..
        } = self.train;
        TrainSpec::BURST_COUNT
            .with_max_at_most(1)
            .check(burst_count)?;
        Range::new("trigger", 0, 0).check(trigger.is_some())?;
        Range::new("lists", 0, 0).check(lists)?;
        let shortest = Range {
            field: "min_period_us",
            ..TrainSpec::PERIOD_US
        };
        shortest.with_max_at_most(period_us).check(min_period_us)?;
        let max_period_us = max_period_us.unwrap_or(period_us);
        let longest = Range {
            field: "max_period_us",
            ..TrainSpec::PERIOD_US
        };
        longest.with_min_at_least(period_us).check(max_period_us)?;
        let fastest = Self {
            train: TrainSpec {
                period_us: min_period_us,
                offset_us: 0, // within one period of any length
                ..self.train
            },
            ..*self
        };
        let fastest = fastest.validate(wearer)?;
        Ok(Channel {
            max_current: fastest.max_current,
            judged_width_us: fastest.judged_width_us,
            min_period_us: fastest.min_period_us,
            max_period_us,
            ..channel
        })
    }
}

/// Returns the width at which a train whose largest current is `current` heats most, µs.
///
/// The heat grows with I²·w, which is I times the charge I·w. The current is bounded by `current`,
/// the charge by the wearer, and the heat is largest with both at their bounds, or with the
/// train's widest phase if that comes first. The result is not below the train's own width, whose
/// charge has been checked.
fn hottest_width_us(train: &Train, current: MicroAmps, wearer: &Wearer) -> u16 {
    let max_pc = wearer.spec().max_charge_nc * 1000; // at most 4e7
    // Rounded up: with a µs less, a slightly smaller current might heat more.
    let by_charge = max_pc.div_ceil(current.get().max(1));
    let widest = u32::from(train.widest_us());
    // At most 500.
    by_charge.min(widest).max(train.spec().width_us.into()) as u16
}

/// Returns the largest current with which phases of `width_us` satisfy the limits of charge and of
/// rms.
fn max_train_current(
    train: &Train,
    width_us: u16,
    max_rms: MicroAmps,
    wearer: &Wearer,
) -> MicroAmps {
    let rms = u64::from(max_rms.get());
    // µA²·µs by µs, at most 2.5e9 · 2e6 / 10.
    let squares = rms * rms * u64::from(train.spec().period_us);
    let mean_square = squares.checked_div(train.burst_driven_us(width_us).into());
    let by_rms = mean_square.map_or(0, u64::isqrt);
    let by_rms = MicroAmps::new(u32::try_from(by_rms).unwrap_or(u32::MAX));
    wearer.max_current_at(width_us).min(by_rms)
}

impl Channel {
    /// Returns the channel checked with a load of `ohm`, if its stage is a voltage stage and `ohm`
    /// is below the configured load; otherwise the channel unchanged.
    ///
    /// # Errors
    /// Returns the first limit exceeded with that load; [`SetupError::Range`] for a load that no
    /// host may configure.
    pub fn with_load(&self, ohm: u32, wearer: &Wearer) -> Result<Self, SetupError> {
        let Some(stage) = self.stage.with_load(ohm) else {
            return Ok(*self);
        };
        let spec = ChannelSpec {
            train: TrainSpec {
                period_us: self.min_period_us,
                offset_us: 0, // within one period of any length
                ..*self.train.spec()
            },
            stage,
            limit: self.limit,
            start: self.start,
            area_mm2: self.area_mm2,
        };
        let judged = spec.validate(wearer)?;
        Ok(Self {
            stage: judged.stage,
            max_current: judged.max_current,
            charge: judged.charge,
            judged_width_us: judged.judged_width_us,
            ..*self
        })
    }

    /// Returns how many pulses of a train with a fixed number of bursts would be below `stimulus`
    /// during the rise; 0 if `stimulus` is not above `start`, or if the train is endless.
    #[must_use]
    #[inline]
    pub fn pulses_below(&self, stimulus: Stimulus, wearer: &Wearer) -> u32 {
        match self.train.spec().repeats {
            0 => 0, // as mostly
            repeats => self.counted_below(stimulus, wearer, repeats),
        }
    }

    #[inline(never)]
    fn counted_below(&self, stimulus: Stimulus, wearer: &Wearer, repeats: u16) -> u32 {
        let spec = self.train.spec();
        if !Measures::of(stimulus, spec.width_us).is_above(Measures::uniform(self.start)) {
            return 0;
        }
        let (rise_us, rise_bursts) = wearer.rise();
        let by_time = rise_us.div_ceil(spec.period_us.max(1)); // at most 1 000
        let bursts = by_time.max(rise_bursts.into()).min(repeats.into());
        bursts.saturating_mul(spec.burst_count.into())
    }

    /// Returns the largest increase of the channel's amplitude from one burst to the next, a period
    /// of the train later.
    #[must_use]
    pub fn slope(&self, wearer: &Wearer) -> Amplitude {
        Slope::of(self.limit, wearer).max_increase(self.train.spec().period_us)
    }

    /// Returns the largest current that may flow in phases of `width_us`.
    #[must_use]
    #[inline]
    pub fn max_current_at(&self, width_us: u16, wearer: &Wearer) -> MicroAmps {
        if !self.train.has_live_width() {
            return self.max_current; // as mostly
        }
        self.max_current.min(wearer.max_current_at(width_us))
    }

    /// Returns `stimulus` with the train's own width in place of width 0.
    #[must_use]
    #[inline]
    pub const fn with_width(&self, stimulus: Stimulus) -> Stimulus {
        match stimulus.width_us {
            0 => Stimulus {
                width_us: self.train.spec().width_us,
                ..stimulus
            },
            _ => stimulus,
        }
    }

    /// Returns the largest amplitude of phases of `width_us` that the limit and the charge limit
    /// allow.
    #[must_use]
    #[inline]
    pub fn max_amplitude_at(&self, width_us: u16, wearer: &Wearer) -> Amplitude {
        if !self.train.has_live_width() {
            return self.limit; // its charge was checked
        }
        self.max_amplitude_by_charge(width_us, wearer)
    }

    #[inline(never)]
    fn max_amplitude_by_charge(&self, width_us: u16, wearer: &Wearer) -> Amplitude {
        let by_charge = self
            .stage
            .amplitude_for_current(wearer.max_current_at(width_us));
        self.limit.min(by_charge)
    }

    /// Returns [`Self::charge`] for a burst with phases of `width_us`.
    #[must_use]
    #[inline]
    pub fn charge_at(&self, width_us: u16) -> u32 {
        let spec = self.train.spec();
        if width_us == spec.width_us {
            self.charge // as mostly
        } else {
            charge_of(spec, width_us, self.stage)
        }
    }
}

/// Computes [`Channel::charge`] for phases of `width_us`.
fn charge_of(train: &TrainSpec, width_us: u16, stage: Stage) -> u32 {
    // µA · µs = pC; at most 8 · 500 · 256.
    let pulses = u32::from(width_us) * u32::from(train.burst_count) * 256;
    match stage.spec() {
        StageSpec::Current { .. } => pulses,
        // 1 mV drives 1000/load µA; at least 200 Ω.
        StageSpec::Voltage { load_ohm, .. } => (pulses * 1000).div_ceil(load_ohm.max(1)),
    }
}
