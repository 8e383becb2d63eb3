//! Specification of a joint whose stimulation follows its angle, and its checks.

use super::curve::{Extreme, QuarticSpec};
use super::{Modulated, MotionPhase};
use crate::control::SensorSource;
use crate::control::differentiator::Differentiator;
use crate::control::refusal::{AMPLITUDE_MAX, CHANNEL, check_angles};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A modulated joint of a wearer who handles an object, as it travels on the wire, unvalidated.
///
/// Buatier de Mongeot et al.: the amplitude of each muscle of the joint is its calibrated intensity
/// times a quartic of the joint's angle (equations 3 and 4). One quartic applies while the elbow
/// flexes, another while it extends. Stimulation is assistive if the quartics belong to the muscle
/// that moves the joint, and resistive if they belong to the antagonist, with the same quartic.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ModulationSpec {
    /// Number of the joint, 0…3, which its measurements use too.
    pub joint: u8,
    /// Number of the joint whose motion determines the phase, 0…3: an elbow itself, and for a
    /// shoulder the elbow of the same arm. It must be part of the setup too.
    pub phase_joint: u8,
    /// Angular velocity up to which the last phase stays, 0.01 °/s; 10…20 000. Zero is refused,
    /// because sensor noise would then determine the phase of an arm at rest.
    pub dead_band_centideg_per_s: u16,
    /// Cutoff of the differentiator of the phase joint's angle, mHz; 500…20 000.
    pub cutoff_mhz: u32,
    /// Lowest angle of the joint, m°; −180 000…179 999.
    pub angle_min_mdeg: i32,
    /// Highest angle of the joint, m°; above the lowest, up to 180 000.
    pub angle_max_mdeg: i32,
    /// Age at which the latest measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
    /// Longest time for which an object may be held, ms; 100…600 000. The shortest of several
    /// joints' times counts for all.
    pub max_hold_ms: u32,
    /// Muscle that flexes the joint.
    pub flexor: ModulatedSpec,
    /// Muscle that extends the joint.
    pub extensor: ModulatedSpec,
}

/// Modulation of one muscle of a joint.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ModulatedSpec {
    /// Number of the channel, 0…9; no other muscle may use it.
    pub channel: u8,
    /// Intensity I₀ from calibration, µA or mV; 1…200 000.
    pub base: Amplitude,
    /// Conversion of the share into an intensity.
    pub form: Form,
    /// Share while the elbow flexes; `None` for no stimulation.
    pub lift: Option<QuarticSpec>,
    /// Share while the elbow extends; `None` for no stimulation.
    pub drop: Option<QuarticSpec>,
}

/// Conversion of a share C into an intensity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Form {
    /// Intensity I = C·I₀, the paper's equation 4. Small values of C have no effect, because they
    /// lie below the motor threshold.
    Scaled,
    /// Intensity I = I_th + C·(I₀ − I_th): a share of the range above motor threshold.
    AboveThreshold {
        /// Motor threshold I_th, µA or mV; 0…I₀ − 1.
        threshold: Amplitude,
    },
}

/// Reason why a [`ModulationSpec`] was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ModulationError {
    /// A field is outside its range, which may depend on the fields before it.
    Range(OutOfRange),
    /// Both muscles use the same channel.
    ChannelTwice {
        /// Number of the channel, 0…9.
        channel: u8,
    },
    /// A share is negative or above 1. Calibration did not test intensities above I₀.
    Share {
        /// Channel of the muscle, 0…9.
        channel: u8,
        /// Phase in which the share is out of range.
        phase: MotionPhase,
        /// Value and position of the violation.
        extreme: Extreme,
    },
}

impl From<OutOfRange> for ModulationError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

impl MotionPhase {
    /// Returns the name of the field that holds the quartic of this phase.
    #[must_use]
    pub const fn field(self) -> &'static str {
        match self {
            Self::Lift => "lift",
            Self::Drop => "drop",
        }
    }
}

impl ModulationSpec {
    /// Range of [`Self::joint`].
    pub const JOINT: Range = Range::new("joint", 0, super::JOINTS as i32 - 1);
    /// Range of [`Self::phase_joint`].
    pub const PHASE_JOINT: Range = Range::new("phase_joint", 0, super::JOINTS as i32 - 1);
    /// Range of [`Self::dead_band_centideg_per_s`].
    pub const DEAD_BAND: Range = Range::new("dead_band_centideg_per_s", 10, 20_000);
    /// Range of [`Self::cutoff_mhz`].
    pub const CUTOFF_MHZ: Range = Differentiator::CUTOFF_MHZ;
    /// Range of [`Self::max_hold_ms`]: up to ten minutes, within which wrapped times can be
    /// compared.
    pub const MAX_HOLD_MS: Range = Range::new("max_hold_ms", 100, 600_000);

    /// Returns both muscles, the flexor first.
    pub fn muscles(&self) -> impl Iterator<Item = &ModulatedSpec> {
        [&self.flexor, &self.extensor].into_iter()
    }

    /// Returns the largest amplitude that each muscle may request at any angle of the range, as
    /// channel (0…9), amplitude and name of the field. The amplitudes are upper bounds.
    pub fn demands(&self) -> impl Iterator<Item = (u8, Amplitude, &'static str)> {
        self.muscles()
            .flat_map(|muscle| {
                let demand = |phase| {
                    Some((
                        muscle.channel,
                        muscle.peak(phase)?,
                        MotionPhase::field(phase),
                    ))
                };
                [demand(MotionPhase::Lift), demand(MotionPhase::Drop)]
            })
            .flatten()
    }

    /// Calls `note` for every mistake in the specification.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(ModulationError)) {
        for checked in [
            Self::JOINT.check(self.joint),
            Self::PHASE_JOINT.check(self.phase_joint),
            Self::DEAD_BAND.check(self.dead_band_centideg_per_s),
            Self::CUTOFF_MHZ.check(self.cutoff_mhz),
            check_angles(self.angle_min_mdeg, self.angle_max_mdeg),
            SensorSource::STALE_AFTER_MS.check(self.stale_after_ms),
            Self::MAX_HOLD_MS.check(self.max_hold_ms),
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

    /// Checks the specification.
    ///
    /// # Errors
    /// Returns the first mistake of [`Self::report_mistakes`].
    pub fn check(&self) -> Result<(), ModulationError> {
        let mut first = None;
        self.report_mistakes(&mut |mistake| {
            first.get_or_insert(mistake);
        });
        first.map_or(Ok(()), Err)
    }
}

impl ModulatedSpec {
    /// Range of [`Self::channel`].
    pub const CHANNEL: Range = CHANNEL;
    /// Range of [`Self::base`].
    pub const BASE: Range = Range::new("base", 1, AMPLITUDE_MAX);
    /// Range of the threshold in [`Form::AboveThreshold`], for the highest base.
    pub const THRESHOLD: Range = Range::new("threshold", 0, AMPLITUDE_MAX - 1);

    /// Returns the muscle's quartic in `phase`, or `None` for no stimulation.
    #[must_use]
    pub const fn share(&self, phase: MotionPhase) -> Option<&QuarticSpec> {
        match phase {
            MotionPhase::Lift => self.lift.as_ref(),
            MotionPhase::Drop => self.drop.as_ref(),
        }
    }

    /// Returns the largest amplitude in a phase at any angle, or `None` for no stimulation.
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
        let mut is_enclosed = true; // extremes need coefficients in range
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
