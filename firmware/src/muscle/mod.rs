//! What a muscle does with the pulses it gets, in fixed point.
//!
//! Lives here: `recruitment` (amplitude ↔ share of the muscle at work) and the
//! `ladder` of models (pulses → force over time): `calcium_force` and `fatigue`; the
//! `inverse` (force → pulses) with what trains settle to (`settled`). Not here: limits
//! a pulse must keep (`safety`), joints (`control`), the simulator's own floating-point
//! muscles.
//! In: wanted effort or gain; the pulses actually emitted, each with its
//! microsecond. Out: amplitudes within the wearer's range; predicted force.

pub mod calcium_force;
pub mod fatigue;
pub mod inverse;
pub mod ladder;
pub mod recruitment;
mod segment;
mod settled;
mod spec;

pub use calcium_force::{CalciumForce, CalciumForceState};
pub use fatigue::FatigueSpec;
use fixed::types::U1F31;
pub use inverse::{Drive, ForceLimit, Inverse};
pub use ladder::{
    Model, MuscleModel, MuscleModelError, MuscleModelState, MuscleSpec, NoFatigue, Rung,
};
pub use recruitment::{Recruitment, RecruitmentSpec};
pub use spec::CalciumForceSpec;

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
