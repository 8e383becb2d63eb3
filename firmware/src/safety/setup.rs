//! Everything a session configures, checked as a whole before arming.

use super::{Stage, StageMismatch, StageSpec, SumError, Sums, Wearer, limits};
use crate::pulse::{
    CHANNELS, Group, GroupError, GroupSpec, MAX_GROUPS, Partner, Train, TrainError, TrainSpec,
};
use crate::range::{OutOfRange, Range};
use crate::units::{Amplitude, MicroAmps};
use heapless::Vec;
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

/// Why a setup cannot be armed. `channel` is counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SetupError {
    /// A field outside its range.
    Range(OutOfRange),
    /// The train cannot be played.
    Train(TrainError),
    /// The groups cannot be kept.
    Group(GroupError),
    /// The board has another stage than is declared.
    Stage(StageMismatch),
    /// At its limit the channel would exceed a current limit; the largest
    /// allowed current is `max`.
    Current {
        /// That current.
        max: MicroAmps,
    },
    /// At its limit one phase would exceed the charge limit.
    Charge {
        /// nC.
        max_nc: u32,
    },
    /// At its limit the channel would exceed the rms limit; every pulse of a
    /// burst counts.
    Rms {
        /// That limit.
        max: MicroAmps,
    },
    /// At its limit the channel would exceed the rms current density under its
    /// electrode.
    Density {
        /// Largest rms current at that area.
        max: MicroAmps,
    },
    /// With all channels at their limits, the common return would carry too much.
    Sum(SumError),
}

impl From<StageMismatch> for SetupError {
    fn from(e: StageMismatch) -> Self {
        Self::Stage(e)
    }
}

impl From<OutOfRange> for SetupError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

impl ChannelSpec {
    /// Of [`Self::limit`], at the largest full scale.
    pub const LIMIT: Range = Range::new("limit", 1, StageSpec::FULL_SCALE_MV.max);
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

    /// No current above this may flow in phases of `width_us`.
    #[must_use]
    pub fn max_current_at(&self, width_us: u16, wearer: &Wearer) -> MicroAmps {
        if !self.train.has_live_width() {
            return self.max_current; // as mostly
        }
        self.max_current.min(wearer.max_current_at(width_us))
    }

    /// The largest amplitude of phases of `width_us`, by the limits and by charge.
    #[must_use]
    pub fn highest_at(&self, width_us: u16, wearer: &Wearer) -> Amplitude {
        if !self.train.has_live_width() {
            return self.limit; // its charge was checked
        }
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

/// A complete setup that keeps every limit and rule.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The wearer's limits.
    pub wearer: Wearer,
    /// Configured channels.
    pub channels: [Option<Channel>; CHANNELS],
    /// What they come to at the common return, each at its limit.
    pub sums: Sums,
    /// Groups of channels.
    pub groups: Vec<Group, MAX_GROUPS>,
    /// The channel that drives sync out.
    pub sync: Option<u8>,
    /// Channels that a joint, a wall or force control drives; a host may not.
    pub controlled: u16,
}

impl Setup {
    /// A configured channel.
    #[must_use]
    pub fn channel(&self, channel: u8) -> Option<&Channel> {
        self.channels.get(usize::from(channel))?.as_ref()
    }

    /// The trains, by channel.
    #[must_use]
    pub fn trains(&self) -> [Option<Train>; CHANNELS] {
        self.channels.map(|c| c.map(|c| c.train))
    }
}

/// Checks a group against the channels it joins and their trains.
///
/// # Errors
/// The first rule between them that it breaks: its trains', or that the rate of an
/// isolated group's member may change.
pub fn check_group(
    spec: &GroupSpec,
    channels: &[Option<Channel>; CHANNELS],
    trains: &[Option<Train>; CHANNELS],
) -> Result<Group, GroupError> {
    let group = spec.check(trains)?;
    let changes = |c: &Channel| c.min_period_us != c.max_period_us || c.train.spec().lists;
    let mut members = (0u8..)
        .zip(channels)
        .filter(|(c, _)| spec.members & 1 << c != 0); // c <= 9
    let changing = members.find(|(_, channel)| channel.as_ref().is_some_and(changes));
    match (spec.partner, changing) {
        (Partner::Isolated, Some((channel, _))) => Err(GroupError::RateChanges { channel }),
        _ => Ok(group),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::safety::WearerSpec;

    pub(crate) const CHANNEL: ChannelSpec = ChannelSpec {
        train: TrainSpec::biphasic(200, 100, 20_000),
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(20_000),
        area_mm2: 2_500,
    };

    fn try_channel(change: impl FnOnce(&mut ChannelSpec)) -> Result<Channel, SetupError> {
        let mut spec = CHANNEL;
        change(&mut spec);
        spec.validate(&WearerSpec::default().validate().unwrap())
    }

    #[test]
    fn each_limit_is_named() {
        assert!(try_channel(|_| ()).is_ok());
        assert_eq!(
            try_channel(|c| (c.limit, c.train.width_us) = (Amplitude::new(80_001), 500)),
            Err(SetupError::Charge { max_nc: 40_000 })
        );
        assert!(
            try_channel(|c| (c.limit, c.train.width_us) = (Amplitude::new(80_000), 500)).is_ok()
        );
        // 80 mA, 2 · 500 µs, 8 pulses in 20 ms: 80 · sqrt(8/20) = 50.6 mA rms.
        let octuplet = |c: &mut ChannelSpec| {
            (c.limit, c.train.width_us) = (Amplitude::new(80_000), 500);
            (c.train.burst_count, c.train.burst_interval_us) = (8, 1_200);
        };
        assert_eq!(
            try_channel(octuplet),
            Err(SetupError::Rms {
                max: MicroAmps::new(50_000)
            })
        );
        let volts = StageSpec::Voltage {
            full_scale_mv: 60_000,
            load_ohm: 2_000,
        };
        assert!(try_channel(|c| (c.stage, c.limit) = (volts, Amplitude::new(40_000))).is_ok());
        assert_eq!(
            try_channel(|c| (c.stage, c.limit) = (volts, Amplitude::new(40_001))),
            Err(SetupError::Current {
                max: MicroAmps::new(20_000)
            })
        );
    }

    /// 8 µC let 20 mA last 400 µs: there it heats most, and is judged; at 500 µs 16 mA
    /// remain.
    #[test]
    fn a_live_width_is_judged_where_it_heats_most() {
        let wearer = WearerSpec {
            max_charge_nc: 8_000,
            ..WearerSpec::default()
        };
        let mut spec = CHANNEL;
        spec.train.max_width_us = 500;
        let wearer = wearer.validate().unwrap();
        let channel = spec.validate(&wearer).unwrap();
        assert_eq!(channel.judged_width_us, 400);
        let highest = [10, 400, 401, 500].map(|w| channel.highest_at(w, &wearer).get());
        assert_eq!(highest, [20_000, 20_000, 19_950, 16_000]);
        // 20 mA for two phases of 400 µs in 20 ms: 4 mA rms, which 200 mm² take.
        spec.area_mm2 = 200;
        assert!(spec.validate(&wearer).is_ok());
        spec.area_mm2 = 199;
        let max = MicroAmps::new(199 * 20);
        assert_eq!(spec.validate(&wearer), Err(SetupError::Density { max }));
        // Alone, without the charge's limit, the widest phase counts.
        let free = WearerSpec::default().validate().unwrap();
        spec.area_mm2 = 2_500;
        assert_eq!(spec.validate(&free).unwrap().judged_width_us, 500);
        assert_eq!(CHANNEL.validate(&free).unwrap().judged_width_us, 200);
    }

    #[test]
    fn wearer_limits_can_only_be_tighter() {
        let loose = WearerSpec {
            max_current_ua: 100_001,
            ..WearerSpec::default()
        };
        assert_eq!(loose.validate().unwrap_err().field, "max_current_ua");
        let tight = WearerSpec {
            max_current_ua: 10_000,
            ..WearerSpec::default()
        };
        assert_eq!(
            CHANNEL.validate(&tight.validate().unwrap()),
            Err(SetupError::Current {
                max: MicroAmps::new(10_000)
            })
        );
    }

    #[test]
    fn codes_never_exceed_what_was_asked() {
        let stage = CHANNEL.stage.validate().unwrap();
        for ua in (0..=100_000).step_by(37) {
            let code = stage.code(Amplitude::new(ua));
            assert!(u64::from(code.get()) * 100_000 <= u64::from(ua) * 65_535);
            assert!(stage.amplitude(code) <= Amplitude::new(ua));
        }
        assert_eq!(stage.code(Amplitude::new(100_000)), DacCode::new(65_535));
    }

    use crate::units::DacCode;
}
