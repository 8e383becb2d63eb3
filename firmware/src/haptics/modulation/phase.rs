//! Motion phase of an elbow, lift or drop: the sign of its angular velocity outside a dead band.

use crate::control::differentiator::{Differentiator, DifferentiatorState};
use crate::range::OutOfRange;
use crate::units::{Angle, AngularRate};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Phase of the movement of the object (Buatier de Mongeot, III.C).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum MotionPhase {
    /// The elbow flexes and lifts the object.
    Lift,
    /// The elbow extends and lowers the object.
    Drop,
}

/// Detector that determines the phase at every control tick.
#[derive(Clone, Copy, Debug)]
pub struct PhaseDetector {
    differentiator: Differentiator,
    dead_band: AngularRate,
}

/// State of a [`PhaseDetector`].
#[derive(Clone, Copy, Debug, Default)]
pub struct PhaseState {
    differentiator: DifferentiatorState,
    phase: Option<MotionPhase>,
}

impl PhaseDetector {
    /// Creates a detector with a dead band in 0.01 °/s, already checked, and the differentiator's
    /// cutoff.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] for a cutoff outside its range.
    pub(super) fn new(dead_band: u16, cutoff_mhz: u32) -> Result<Self, OutOfRange> {
        // Below 2^16 · 2^16 / 100.
        let dead_band = I16F16::from_bits((i64::from(dead_band) * 65_536 / 100) as i32);
        Ok(Self {
            differentiator: Differentiator::new(cutoff_mhz, super::STEP_MS)?,
            dead_band: AngularRate::new(dead_band),
        })
    }

    /// Advances by one millisecond, and returns the phase. Within the dead band the last phase
    /// stays; there is no phase before the first motion.
    #[inline]
    pub fn step(&self, state: &mut PhaseState, angle: Angle) -> Option<MotionPhase> {
        let rate = self.differentiator.step(&mut state.differentiator, angle);
        if rate > self.dead_band {
            state.phase = Some(MotionPhase::Lift);
        } else if rate < AngularRate::default() - self.dead_band {
            state.phase = Some(MotionPhase::Drop);
        }
        state.phase
    }
}

impl PhaseState {
    /// Returns the phase of the latest step.
    #[must_use]
    pub const fn phase(&self) -> Option<MotionPhase> {
        self.phase
    }
}
