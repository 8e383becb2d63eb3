//! What a host says about a joint whose stimulation follows its angle, and the checks it
//! must pass once.

use super::curve::{Extreme, QuarticSpec};
use super::{Modulated, MotionPhase};
use crate::control::SensorSource;
use crate::control::differentiator::Differentiator;
use crate::control::refusal::{AMPLITUDE_MAX, CHANNEL, check_angles};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A joint of a person who handles an object, as it travels on the wire, unvalidated.
///
/// Buatier de Mongeot et al.: each muscle of the joint gets its calibrated intensity times
/// a quartic of the joint's angle (equations 3 and 4), one while the elbow flexes, one
/// while it extends. Which of them are there makes the stimulation assistive (those of the
/// muscle that moves the joint) or resistive (its antagonist, with the same quartic).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ModulationSpec {
    /// Which joint, 0…3: the number of its measurements.
    pub joint: u8,
    /// The joint whose motion tells the phase, 0…3: of an elbow itself, of a shoulder the
    /// elbow of its arm. It must be of the setup as well.
    pub phase_joint: u8,
    /// Angular velocity up to which the last phase stays, 0.01 °/s; 10…20 000. None is
    /// refused: the phase of an arm at rest would be its sensor's noise.
    pub dead_band_centideg_per_s: u16,
    /// Cutoff of the differentiator of the phase joint's angle, mHz; 500…20 000.
    pub cutoff_mhz: u32,
    /// Lowest angle of the joint, m°; −180 000…179 999.
    pub angle_min_mdeg: i32,
    /// Highest angle of the joint, m°; above the lowest, to 180 000.
    pub angle_max_mdeg: i32,
    /// Age at which the last measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
    /// How long an object may be held at most, ms; 100…600 000. Of several joints the
    /// shortest counts, for all.
    pub longest_hold_ms: u32,
    /// The muscle that flexes it.
    pub flexor: ModulatedSpec,
    /// The muscle that extends it.
    pub extensor: ModulatedSpec,
}

/// A muscle of such a joint.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ModulatedSpec {
    /// Its channel, 0…9; no other muscle's.
    pub channel: u8,
    /// I₀, what calibration found, µA or mV; 1…200 000.
    pub base: Amplitude,
    /// How the share makes an intensity of it.
    pub form: Form,
    /// Its share while the elbow flexes; none is no stimulation.
    pub lift: Option<QuarticSpec>,
    /// Its share while the elbow extends; none is no stimulation.
    pub drop: Option<QuarticSpec>,
}

/// How a share C makes an intensity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Form {
    /// I = C·I₀, the paper's equation 4. Below the motor threshold nothing moves, so
    /// little of C does.
    Scaled,
    /// I = I_th + C·(I₀ − I_th): a share of what moves.
    AboveThreshold {
        /// I_th, µA or mV; 0…I₀ − 1.
        threshold: Amplitude,
    },
}

/// Why a [`ModulationSpec`] was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ModulationError {
    /// A field is outside what is allowed, given the fields before it.
    Range(OutOfRange),
    /// Both muscles name the same channel.
    ChannelTwice {
        /// That channel.
        channel: u8,
    },
    /// A share is negative, or above 1: more than what calibration found was never felt.
    Share {
        /// Whose.
        channel: u8,
        /// Of which phase.
        phase: MotionPhase,
        /// How far it goes, and where.
        extreme: Extreme,
    },
}

impl From<OutOfRange> for ModulationError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

impl MotionPhase {
    /// The field of its quartic.
    #[must_use]
    pub const fn field(self) -> &'static str {
        match self {
            Self::Lift => "lift",
            Self::Drop => "drop",
        }
    }
}

impl ModulationSpec {
    /// Of [`Self::joint`].
    pub const JOINT: Range = Range::new("joint", 0, super::JOINTS as i32 - 1);
    /// Of [`Self::phase_joint`].
    pub const PHASE_JOINT: Range = Range::new("phase_joint", 0, super::JOINTS as i32 - 1);
    /// Of [`Self::dead_band_centideg_per_s`].
    pub const DEAD_BAND: Range = Range::new("dead_band_centideg_per_s", 10, 20_000);
    /// Of [`Self::cutoff_mhz`].
    pub const CUTOFF_MHZ: Range = Differentiator::CUTOFF_MHZ;
    /// Of [`Self::longest_hold_ms`]: ten minutes at most, within which times compare.
    pub const LONGEST_HOLD_MS: Range = Range::new("longest_hold_ms", 100, 600_000);

    /// Both muscles, the flexor first.
    pub fn muscles(&self) -> impl Iterator<Item = &ModulatedSpec> {
        [&self.flexor, &self.extensor].into_iter()
    }

    /// What it may ask for, by channel: the most at any angle of its range, for no angle
    /// too little.
    pub fn demands(&self) -> impl Iterator<Item = (u8, Amplitude, &'static str)> {
        self.muscles()
            .flat_map(|muscle| {
                let of = |phase| {
                    Some((
                        muscle.channel,
                        muscle.peak(phase)?,
                        MotionPhase::field(phase),
                    ))
                };
                [of(MotionPhase::Lift), of(MotionPhase::Drop)]
            })
            .flatten()
    }

    /// Tells `note` of every mistake in the spec by itself.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(ModulationError)) {
        for checked in [
            Self::JOINT.check(self.joint),
            Self::PHASE_JOINT.check(self.phase_joint),
            Self::DEAD_BAND.check(self.dead_band_centideg_per_s),
            Self::CUTOFF_MHZ.check(self.cutoff_mhz),
            check_angles(self.angle_min_mdeg, self.angle_max_mdeg),
            SensorSource::STALE_AFTER_MS.check(self.stale_after_ms),
            Self::LONGEST_HOLD_MS.check(self.longest_hold_ms),
        ] {
            if let Err(range) = checked {
                note(range.into());
            }
        }
        for muscle in self.muscles() {
            muscle.report_mistakes(note);
        }
        let channel = self.flexor.channel;
        if channel == self.extensor.channel {
            note(ModulationError::ChannelTwice { channel });
        }
    }

    /// The first of [`Self::report_mistakes`].
    ///
    /// # Errors
    /// That one.
    pub fn check(&self) -> Result<(), ModulationError> {
        let mut first = None;
        self.report_mistakes(&mut |mistake| {
            first.get_or_insert(mistake);
        });
        first.map_or(Ok(()), Err)
    }
}

impl ModulatedSpec {
    /// Of [`Self::channel`].
    pub const CHANNEL: Range = CHANNEL;
    /// Of [`Self::base`].
    pub const BASE: Range = Range::new("base", 1, AMPLITUDE_MAX);
    /// Of [`Form::AboveThreshold`]'s, below the highest base.
    pub const THRESHOLD: Range = Range::new("threshold", 0, AMPLITUDE_MAX - 1);

    /// Its quartic in a phase.
    #[must_use]
    pub const fn share(&self, phase: MotionPhase) -> Option<&QuarticSpec> {
        match phase {
            MotionPhase::Lift => self.lift.as_ref(),
            MotionPhase::Drop => self.drop.as_ref(),
        }
    }

    /// The most that it gets in a phase at any angle; `None` of no stimulation.
    #[must_use]
    pub fn peak(&self, phase: MotionPhase) -> Option<Amplitude> {
        let peak = self.share(phase)?.peak();
        Some(Modulated::scaled_amplitude(self.base, self.form, peak))
    }

    fn report_mistakes(&self, note: &mut dyn FnMut(ModulationError)) {
        let below_base = Self::THRESHOLD.with_max_at_most(self.base.get().saturating_sub(1));
        let threshold = match self.form {
            Form::Scaled => Ok(()),
            Form::AboveThreshold { threshold } => below_base.check(threshold.get()),
        };
        let of_muscle = [
            Self::CHANNEL.check(self.channel),
            Self::BASE.check(self.base.get()),
            threshold,
        ];
        for range in of_muscle.into_iter().filter_map(Result::err) {
            note(range.into());
        }
        for phase in [MotionPhase::Lift, MotionPhase::Drop] {
            if let Some(share) = self.share(phase) {
                self.report_share_mistakes(phase, share, note);
            }
        }
    }

    fn report_share_mistakes(
        &self,
        phase: MotionPhase,
        share: &QuarticSpec,
        note: &mut dyn FnMut(ModulationError),
    ) {
        let named = Range {
            field: phase.field(),
            ..QuarticSpec::COEFFICIENT
        };
        let mut is_enclosed = true; // only such have extremes
        for b in share.0 {
            if let Err(range) = named.check(b) {
                is_enclosed = false;
                note(range.into());
            }
        }
        if !is_enclosed {
            return;
        }
        for extreme in [share.lowest(), share.highest()] {
            if extreme.is_outside() {
                let channel = self.channel;
                note(ModulationError::Share {
                    channel,
                    phase,
                    extreme,
                });
            }
        }
    }
}
