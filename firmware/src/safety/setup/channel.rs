//! A channel: what a host declares, held against every limit of the wearer.

use super::SetupError;
use crate::pulse::{Train, TrainSpec};
use crate::range::Range;
use crate::safety::measures::Measures;
use crate::safety::slope::Slope;
use crate::safety::{Stage, StageSpec, Stimulus, Wearer, limits};
use crate::units::{Amplitude, MicroAmps};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Longest driven part of any pulse, µs: what a group's partner can put off the
/// start of a grounding by.
const LONGEST_PULSE_US: u32 = 1_200;

/// A channel as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct ChannelSpec {
    /// Its pulses.
    pub train: TrainSpec,
    /// Its output stage.
    pub stage: StageSpec,
    /// The wearer's largest amplitude here, in the stage's thousandths.
    pub limit: Amplitude,
    /// The largest amplitude that a rise reaches at once, in the stage's thousandths.
    pub start: Amplitude,
    /// Area of its active electrode, 10–20 000 mm².
    pub area_mm2: u32,
}

/// A channel whose largest amplitude keeps every limit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Channel {
    /// Its pulses.
    pub train: Train,
    /// Its output stage.
    pub stage: Stage,
    /// No amplitude above this is ever put out.
    pub limit: Amplitude,
    /// No amplitude up to this is delayed by a rise.
    pub start: Amplitude,
    /// No current above this may flow: a current stage's limit; of a voltage stage, what
    /// the limits of current, charge and rms allow.
    pub max_current: MicroAmps,
    /// Of its electrode, mm².
    pub area_mm2: u32,
    /// Shortest period that the limits were checked for, µs.
    pub min_period_us: u32,
    /// Longest period that may be ordered, µs; the limits hold for it because they
    /// do for the train's own.
    pub max_period_us: u32,
    /// Charge of a burst at amplitude 1 and the train's own width, one phase a pulse, in
    /// 256ths of a pC; rounded up.
    pub charge: u32,
    /// The width at which the limits of rms and density were checked with the largest
    /// amplitude, µs: no pulse with less charge than the wearer allows heats more. The
    /// train's own if it never changes.
    pub judged_width_us: u16,
}

impl ChannelSpec {
    /// Of [`Self::limit`], at the largest full scale.
    pub const LIMIT: Range = Range::new("limit", 1, StageSpec::FULL_SCALE_MV.max);
    /// Of [`Self::start`]; at most the limit.
    pub const START: Range = Range::new("start", 0, StageSpec::FULL_SCALE_MV.max);
    /// Of [`Self::area_mm2`].
    pub const AREA_MM2: Range = Range::new("area_mm2", 10, 20_000);
    /// What stands for an area that nobody said: a disc of 32 mm, 8 cm², the smallest
    /// self-adhesive electrode that the source of [`limits::MAX_DENSITY_UA_MM2`] names.
    /// It is not the largest, with which the density would limit nothing.
    pub const ASSUMED_AREA_MM2: u32 = 800;

    /// Checks the train, the stage and what the limit amounts to in current,
    /// charge per phase, rms current and its density.
    ///
    /// # Errors
    /// The first limit exceeded, by name.
    pub fn validate(&self, wearer: &Wearer) -> Result<Channel, SetupError> {
        let train = self.train.validate().map_err(SetupError::Train)?;
        let stage = self.stage.validate()?;
        let up_to_full_scale = Self::LIMIT.up_to(stage.full_scale().get());
        up_to_full_scale.check(self.limit.get())?;
        let up_to_limit = Self::START.up_to(self.limit.get());
        up_to_limit.check(self.start.get())?;
        let spec = train.spec();
        let current = stage.current(self.limit);
        let most = wearer.max_current().min(stage.max_current());
        if current > most {
            return Err(SetupError::Current { max: most });
        }
        let ua = current.get();
        // The grounding after a pulse that began before the fall ends in it.
        if spec.ground_us != 0 {
            let max = wearer.fall_us() - LONGEST_PULSE_US; // the fall takes 5 ms or more
            TrainSpec::GROUND_US.up_to(max).check(spec.ground_us)?;
        }
        // ua <= 100 000 from here on. pC = µA·µs, at most 5e7.
        if u64::from(ua) * u64::from(spec.width_us) > u64::from(wearer.spec().max_charge_nc) * 1000
        {
            return Err(SetupError::Charge {
                max_nc: wearer.spec().max_charge_nc,
            });
        }
        Self::AREA_MM2.check(self.area_mm2)?;
        let judged_width_us = judged_width(&train, current, wearer);
        let is_above = |max: MicroAmps| {
            let (ua, max_ua) = (u64::from(ua), u64::from(max.get()));
            // At most 1e10 · 8000 and 1.6e11 · 2e6: both fit u64.
            let squares = ua * ua * u64::from(train.on_us(judged_width_us));
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
            most_current(&train, judged_width_us, most_rms, wearer).min(most)
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

    /// [`Self::validate`] for a channel whose pulse rate may change while it
    /// stimulates, from a burst every `min_period_us` to one every `max_period_us`
    /// (the train's if none): every limit holds at the highest rate too. A burst
    /// must be a single pulse, and the train not triggered.
    ///
    /// # Errors
    /// As there; for the highest rate as well.
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
        TrainSpec::BURST_COUNT.up_to(1).check(burst_count)?;
        Range::new("trigger", 0, 0).check(trigger.is_some())?;
        Range::new("lists", 0, 0).check(lists)?;
        let shortest = Range {
            field: "min_period_us",
            ..TrainSpec::PERIOD_US
        };
        shortest.up_to(period_us).check(min_period_us)?;
        let max_period_us = max_period_us.unwrap_or(period_us);
        let longest = Range {
            field: "max_period_us",
            ..TrainSpec::PERIOD_US
        };
        longest.from(period_us).check(max_period_us)?;
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

/// The width at which a train whose largest current is `current` heats most, µs.
///
/// What heats is I²·w, which is I times the charge I·w. Where both are bounded, the
/// current by `current` and the charge by the wearer, it is largest with both at their
/// bounds, or with the train's widest phase if that comes first. Not below the train's
/// own width, whose charge has been checked.
fn judged_width(train: &Train, current: MicroAmps, wearer: &Wearer) -> u16 {
    let max_pc = wearer.spec().max_charge_nc * 1000; // at most 4e7
    // Rounded up: with a µs less, a slightly smaller current might heat more.
    let by_charge = max_pc.div_ceil(current.get().max(1));
    let widest = u32::from(train.widest_us());
    // At most 500.
    by_charge.min(widest).max(train.spec().width_us.into()) as u16
}

/// The largest current with which phases of `width_us` keep the limits of charge and of
/// rms.
fn most_current(train: &Train, width_us: u16, max_rms: MicroAmps, wearer: &Wearer) -> MicroAmps {
    let rms = u64::from(max_rms.get());
    // µA²·µs by µs, at most 2.5e9 · 2e6 / 10.
    let squares = rms * rms * u64::from(train.spec().period_us);
    let mean_square = squares.checked_div(train.on_us(width_us).into());
    let by_rms = mean_square.map_or(0, u64::isqrt);
    let by_rms = MicroAmps::new(u32::try_from(by_rms).unwrap_or(u32::MAX));
    wearer.max_current_at(width_us).min(by_rms)
}

impl Channel {
    /// Of a voltage stage: the same channel judged with a load of `ohm` if that is below
    /// the declared one.
    ///
    /// # Errors
    /// The first limit that it exceeds then; [`SetupError::Range`] for a load that no
    /// host may declare.
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

    /// How many pulses of a train of a fixed number would be below `stimulus`, for having to
    /// rise: none if it is not above `start`, or the train plays on.
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
        if !Measures::of(stimulus, spec.width_us).is_above(Measures::both(self.start)) {
            return 0;
        }
        let (rise_us, rise_bursts) = wearer.rise();
        let by_time = rise_us.div_ceil(spec.period_us.max(1)); // at most 1 000
        let bursts = by_time.max(rise_bursts.into()).min(repeats.into());
        bursts.saturating_mul(spec.burst_count.into())
    }

    /// By how much a burst of this channel may be above the one before it, one period
    /// earlier.
    #[must_use]
    pub fn slope(&self, wearer: &Wearer) -> Amplitude {
        Slope::of(self.limit, wearer).over(self.train.spec().period_us)
    }

    /// No current above this may flow in phases of `width_us`.
    #[must_use]
    #[inline]
    pub fn max_current_at(&self, width_us: u16, wearer: &Wearer) -> MicroAmps {
        if !self.train.has_live_width() {
            return self.max_current; // as mostly
        }
        self.max_current.min(wearer.max_current_at(width_us))
    }

    /// `stimulus`, with the train's own width in place of none.
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

    /// The largest amplitude of phases of `width_us`, by the limits and by charge.
    #[must_use]
    #[inline]
    pub fn highest_at(&self, width_us: u16, wearer: &Wearer) -> Amplitude {
        if !self.train.has_live_width() {
            return self.limit; // its charge was checked
        }
        self.highest_by_charge(width_us, wearer)
    }

    #[inline(never)]
    fn highest_by_charge(&self, width_us: u16, wearer: &Wearer) -> Amplitude {
        let by_charge = self.stage.amplitude_of(wearer.max_current_at(width_us));
        self.limit.min(by_charge)
    }

    /// [`Self::charge`] of a burst with phases of `width_us`.
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

/// Of [`Channel::charge`].
fn charge_of(train: &TrainSpec, width_us: u16, stage: Stage) -> u32 {
    // µA · µs = pC; at most 8 · 500 · 256.
    let pulses = u32::from(width_us) * u32::from(train.burst_count) * 256;
    match stage.spec() {
        StageSpec::Current { .. } => pulses,
        // 1 mV drives 1000/load µA; at least 200 Ω.
        StageSpec::Voltage { load_ohm, .. } => (pulses * 1000).div_ceil(load_ohm.max(1)),
    }
}
