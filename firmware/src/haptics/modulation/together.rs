//! The joints of a person who handles one object: held or released, measured together.

use super::{JOINTS, Modulation, MotionPhase, PhaseState};
use crate::control::sensor::SensorState;
use crate::control::{MeasurementError, SensorFault};
use crate::units::{Amplitude, Angle, Micros};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Up to four joints, by rising number.
#[derive(Clone, Debug, Default)]
pub struct Modulations(Vec<Modulation, JOINTS>);

/// What they remember. Begin every stimulation with a fresh one.
#[derive(Clone, Debug, Default)]
pub struct ModulationsState {
    /// By the number of the joint.
    sensors: [SensorState; JOINTS],
    phases: [PhaseState; JOINTS],
    /// In the latest tick, as far as they may be relied on.
    angles: [Option<Angle>; JOINTS],
    hold: Hold,
    /// When it was grabbed, if it is held.
    since: Micros,
}

/// Whether an object is held.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub enum Hold {
    /// It is not: nothing is stimulated.
    #[default]
    Released,
    /// It is.
    Held,
    /// The host says so for longer than it may be: nothing is stimulated until the host
    /// says that it is released, and held anew.
    Over,
}

/// What joints ask for in one tick.
#[derive(Clone, PartialEq, Debug)]
pub struct ModulationOrders {
    /// Of every joint the flexor and the extensor.
    pub amplitudes: Vec<(u8, Amplitude), { 2 * JOINTS }>,
    /// The object has just been held for as long as it may be.
    pub is_just_over: bool,
}

/// Why an object is not taken for held.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum HoldError {
    /// A joint has no fresh angle, or none that can be believed.
    NoAngle {
        /// Its number.
        joint: u8,
    },
    /// It was held for too long: say first that it is released.
    Over,
}

impl Modulations {
    /// One more joint, with a higher number than those before it; of a fifth nothing.
    pub fn push(&mut self, joint: Modulation) {
        let _ = self.0.push(joint); // as many places as joints
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Takes an angle of a joint from the host, measured at `at`; `None` if there is no
    /// such joint.
    ///
    /// # Errors
    /// [`MeasurementError`]; the state is unchanged then. A measurement that is too old or
    /// out of range is taken, and nothing can be held with it.
    pub fn accept_measurement(
        &self,
        state: &mut ModulationsState,
        now: Micros,
        at: Micros,
        joint: u8,
        angle: Angle,
    ) -> Option<Result<(), MeasurementError>> {
        let modulation = self.0.iter().find(|modulation| modulation.joint == joint)?;
        let measured = state.sensors.get_mut(usize::from(joint))?;
        let sensor = &modulation.sensor;
        Some(sensor.take_from_host(measured, now, at, angle))
    }

    /// The host says that the object is held from now on, or released. That it is still
    /// held does not make it held longer.
    ///
    /// # Errors
    /// [`HoldError`]; a release has none.
    pub fn set_held(
        &self,
        state: &mut ModulationsState,
        now: Micros,
        is_held: bool,
    ) -> Result<(), HoldError> {
        match (is_held, state.hold) {
            (false, _) => state.hold = Hold::Released,
            (true, Hold::Held) => {}
            (true, Hold::Over) => return Err(HoldError::Over),
            (true, Hold::Released) => {
                for modulation in &self.0 {
                    let joint = modulation.joint;
                    let angle = modulation.angle(state, now);
                    angle.map_err(|_| HoldError::NoAngle { joint })?;
                }
                (state.hold, state.since) = (Hold::Held, now);
            }
        }
        Ok(())
    }

    /// One control tick, to be called every millisecond. Phases are told whether an object
    /// is held or not; stimulated is only with one.
    ///
    /// # Errors
    /// [`SensorFault`] while an object is held and a joint has no fresh, believable angle.
    /// Nothing is latched here; `safety` does that.
    #[inline(never)]
    pub fn tick(
        &self,
        state: &mut ModulationsState,
        now: Micros,
    ) -> Result<ModulationOrders, SensorFault> {
        let is_just_over = self.end_overlong_hold(state, now);
        for modulation in &self.0 {
            let found = modulation.angle(state, now);
            if let Some(slot) = state.angles.get_mut(usize::from(modulation.joint)) {
                *slot = found.ok();
            }
            if let (Err(fault), Hold::Held) = (found, state.hold) {
                return Err(fault);
            }
        }
        let mut amplitudes = Vec::new();
        for modulation in &self.0 {
            let phase_angle = state.angle_of(modulation.phase_joint);
            let phase = modulation.phase(state, phase_angle);
            let is_held = state.hold == Hold::Held;
            // Held, all have an angle.
            let (angle, phase) = match state.angle_of(modulation.joint) {
                Some(angle) if is_held => (angle, phase),
                _ => (Angle::default(), None),
            };
            for order in modulation.amplitudes(angle, phase) {
                let _ = amplitudes.push(order); // two of each joint
            }
        }
        Ok(ModulationOrders {
            amplitudes,
            is_just_over,
        })
    }

    /// Ends what has been held for too long, and whether it just did.
    fn end_overlong_hold(&self, state: &mut ModulationsState, now: Micros) -> bool {
        let shortest = self
            .0
            .iter()
            .map(|modulation| modulation.longest_hold_us)
            .min();
        let is_over = state.hold == Hold::Held
            && now.elapsed_since(state.since) >= shortest.unwrap_or_default();
        if is_over {
            state.hold = Hold::Over;
        }
        is_over
    }

    /// Of every joint its angle in the latest tick, as far as it may be relied on, and its
    /// phase.
    pub fn joint_readings(
        &self,
        state: &ModulationsState,
    ) -> impl Iterator<Item = (Option<Angle>, Option<MotionPhase>)> {
        self.0.iter().map(|modulation| {
            let told = state.phases.get(usize::from(modulation.joint));
            (
                state.angle_of(modulation.joint),
                told.and_then(PhaseState::phase),
            )
        })
    }
}

impl ModulationsState {
    /// Whether an object is held.
    #[must_use]
    pub const fn hold_state(&self) -> Hold {
        self.hold
    }

    fn angle_of(&self, joint: u8) -> Option<Angle> {
        self.angles.get(usize::from(joint)).copied().flatten()
    }
}

impl Modulation {
    /// The angle that may be relied on now.
    fn angle(&self, state: &mut ModulationsState, now: Micros) -> Result<Angle, SensorFault> {
        let measured = state.sensors.get_mut(usize::from(self.joint));
        let measured = measured.ok_or(SensorFault::Absent)?;
        self.sensor.angle(measured, now, None)
    }

    /// The phase now, by the angle of its phase joint. Without an angle there is none, and
    /// it begins anew.
    fn phase(&self, state: &mut ModulationsState, angle: Option<Angle>) -> Option<MotionPhase> {
        let told = state.phases.get_mut(usize::from(self.joint))?;
        if angle.is_none() {
            *told = PhaseState::default();
        }
        self.detector.step(told, angle?)
    }
}
