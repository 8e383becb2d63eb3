//! Fixed-point models of a muscle's response to pulses.
//!
//! This module contains `recruitment` (amplitude ↔ active share of the muscle), the model levels in
//! `ladder` (pulses → force over time) with `calcium_force`, its solution by a table (`tabulated`)
//! and `fatigue`, and the `inverse` (force → pulses) with the steady state of trains (`settled`). Limits of a pulse (`safety`), joints
//! (`control`) and the simulator's own floating-point muscles are elsewhere.
//! Inputs are the effort or gain, and the pulses actually emitted, each with its microsecond.
//! Outputs are amplitudes within the wearer's range and the predicted force.

pub mod calcium_force;
pub mod fatigue;
pub mod inverse;
pub mod ladder;
pub mod recruitment;
mod segment;
mod settled;
mod spec;
pub mod tabulated;

pub use calcium_force::{CalciumForce, CalciumForceState};
pub use fatigue::FatigueSpec;
use fixed::types::U1F31;
pub use inverse::{Drive, ForceLimit, Inverse};
pub use ladder::{
    Model, MuscleLevel, MuscleModel, MuscleModelError, MuscleModelState, MuscleSpec, NoFatigue,
};
pub use recruitment::{Recruitment, RecruitmentSpec};
pub use spec::CalciumForceSpec;
pub use tabulated::{MOST_ROWS, TablePlan, TabulatedForce, TabulatedForceState};

/// Share of the reference strength with which a muscle is driven, 0…1: the factor on A in Lee 2020,
/// eq. 6.
///
/// The format is U1F31 (resolution 4.7e-10), because 1 must be exact and gains down to 2^-16 must
/// keep four digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Gain(U1F31);

impl Gain {
    /// Gain of a pulse below motor threshold, which activates no muscle fibre.
    pub const ZERO: Self = Self(U1F31::ZERO);
    /// Gain at the amplitude at which A was measured.
    pub const FULL: Self = Self(U1F31::ONE);

    /// Creates a gain; values above 1 saturate at [`Gain::FULL`].
    #[must_use]
    pub fn new(gain: U1F31) -> Self {
        Self(gain.min(U1F31::ONE))
    }

    /// Returns the gain as a number, 0…1.
    #[must_use]
    pub const fn get(self) -> U1F31 {
        self.0
    }
}
