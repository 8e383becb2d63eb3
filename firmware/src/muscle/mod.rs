//! What a muscle does with the pulses it gets, in fixed point.
//!
//! Lives here: `recruitment` (amplitude ↔ share of the muscle at work) and the
//! `ladder` of models (pulses → force over time): `steady`, `lag`,
//! `calcium_force` and `fatigue`; `rhythm`, `exponential` and `reciprocal` are
//! what they compute with. Not here: limits a pulse must keep (`safety`), joints
//! (`control`), the simulator's own floating-point muscles.
//! In: wanted effort or gain; the pulses actually emitted, each with its
//! microsecond. Out: amplitudes within the wearer's range; predicted force.

pub mod calcium_force;
pub mod choice;
pub(crate) mod exponential;
pub mod fatigue;
pub mod inverse;
pub mod ladder;
mod lag;
mod reciprocal;
pub mod recruitment;
mod rhythm;
mod settled;
mod steady;

use core::fmt;

use fixed::types::U1F31;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

pub use calcium_force::{CalciumForce, CalciumForceSpec, CalciumForceState};
pub use fatigue::FatigueSpec;
pub use inverse::{Drive, Inverse, LONGEST_US, Limiting, PERIOD_US};
pub use ladder::{Ladder, LadderError, LadderState, Model, MuscleSpec, NoFatigue, Rung};
pub use recruitment::{Recruitment, RecruitmentSpec};

/// The share of its reference strength a muscle is driven with, 0…1: the
/// factor on A in Lee 2020, eq. 6.
///
/// U1F31 (resolution 4.7e-10), because 1 must be exact and gains down to
/// 2^-16 must keep four digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Gain(U1F31);

impl Gain {
    /// No muscle fibre answers: a pulse below motor threshold.
    pub const ZERO: Self = Self(U1F31::ZERO);
    /// The strength at the amplitude where A was measured.
    pub const FULL: Self = Self(U1F31::ONE);

    /// A gain; values above 1 saturate at [`Gain::FULL`].
    #[must_use]
    pub fn new(gain: U1F31) -> Self {
        Self(gain.min(U1F31::ONE))
    }

    /// The gain as a number, 0…1.
    #[must_use]
    pub const fn get(self) -> U1F31 {
        self.0
    }
}

/// A parameter of this room, as refusals name it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Parameter {
    /// [`CalciumForceSpec::a_mn_per_s`].
    A,
    /// [`CalciumForceSpec::k_micro`].
    K,
    /// [`CalciumForceSpec::tau_c_us`].
    TauC,
    /// [`CalciumForceSpec::tau1_us`].
    Tau1,
    /// [`CalciumForceSpec::tau2_us`].
    Tau2,
    /// [`FatigueSpec::alpha_a_milli_per_s2`].
    AlphaA,
    /// [`FatigueSpec::alpha_k_nano_per_n_s`].
    AlphaK,
    /// [`FatigueSpec::alpha_tau1_nano_per_n`].
    AlphaTau1,
    /// [`FatigueSpec::tau_fat_ms`].
    TauFat,
    /// [`RecruitmentSpec::motor_threshold`].
    MotorThreshold,
    /// [`RecruitmentSpec::limit`].
    Limit,
    /// [`RecruitmentSpec::reference`].
    Reference,
    /// [`RecruitmentSpec::slope_micro`].
    Slope,
    /// Period of the train whose amplitude gives a force, µs.
    Period,
    /// Period of the fastest rate that a force is had with, µs.
    ShortestPeriod,
    /// Period of the slowest, µs.
    LongestPeriod,
}

/// A parameter outside the range in which the model's arithmetic is proven.
///
/// Both bounds are inclusive and in the parameter's own integer unit.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct OutOfRange {
    /// Which parameter was refused.
    pub parameter: Parameter,
    /// The value that was asked for.
    pub given: u32,
    /// The smallest value allowed.
    pub min: u32,
    /// The largest value allowed.
    pub max: u32,
}

impl fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?} = {} is outside {}..={}",
            self.parameter, self.given, self.min, self.max
        )
    }
}

impl core::error::Error for OutOfRange {}

/// Nothing, if `given` is within `min..=max`; else the refusal.
fn within(parameter: Parameter, given: u32, min: u32, max: u32) -> Result<(), OutOfRange> {
    if (min..=max).contains(&given) {
        return Ok(());
    }
    Err(OutOfRange {
        parameter,
        given,
        min,
        max,
    })
}
