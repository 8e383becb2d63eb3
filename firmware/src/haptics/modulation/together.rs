//! The modulated joints of a wearer who handles one object, which are held, released and measured
//! together.

use super::{JOINTS, Modulation, MotionPhase, PhaseState};
use crate::control::sensor::SensorState;
use crate::control::{MeasurementError, SensorFault};
use crate::units::{Amplitude, Angle, Micros};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Up to four joints, in ascending order of their numbers.
#[derive(Clone, Debug, Default)]
pub struct Modulations(Vec<Modulation, JOINTS>);

/// State of the modulated joints. Every stimulation must begin with a fresh state.
#[derive(Clone, Debug, Default)]
pub struct ModulationsState {
    /// Sensor states, by the number of the joint.
    sensors: [SensorState; JOINTS],
    phases: [PhaseState; JOINTS],
    /// Angles in the latest tick; `None` without a recent, plausible measurement.
    angles: [Option<Angle>; JOINTS],
    hold: Hold,
    /// Time at which the object was grabbed, if it is held.
    since: Micros,
}

/// State of the handled object.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub enum Hold {
    /// The object is not held, and no joint is stimulated.
    #[default]
    Released,
    /// The object is held, and the joints are stimulated.
    Held,
    /// The object has been held longer than allowed. No joint is stimulated until the host reports
    /// that the object is released, and then held again.
    Expired,
}

/// Output of the modulated joints in one tick.
#[derive(Clone, PartialEq, Debug)]
pub struct ModulationOrders {
    /// Channel and amplitude of every joint's flexor and extensor.
    pub amplitudes: Vec<(u8, Amplitude), { 2 * JOINTS }>,
    /// Whether the longest allowed hold of the object ended in this tick.
    pub is_just_over: bool,
}

/// Reason why the device does not accept that an object is held.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum HoldError {
    /// A joint has no recent, plausible angle.
    NoAngle {
        /// Number of the joint, 0…3.
        joint: u8,
    },
    /// The object was held for too long; the host must first report its release.
    Expired,
}

impl Modulations {
    /// Adds a joint, whose number must be higher than those before. A fifth joint is ignored.
    pub fn push(&mut self, joint: Modulation) {
        let _ = self.0.push(joint); // as many places as joints
    }

    /// Removes all joints.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns whether there are no joints.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Accepts an angle of a joint from the host, measured at `at`. Returns `None` if the setup has
    /// no such joint.
    ///
    /// # Errors
    /// Returns [`MeasurementError`] if the measurement is refused. The state is then unchanged. A
    /// measurement that is too old or out of range is accepted, but no object can be held with it.
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

    /// Records that the host reports the object as held or released from now on. Repeated reports
    /// of a held object do not prolong the hold.
    ///
    /// # Errors
    /// Returns [`HoldError`] if the object cannot be held. A release never fails.
    pub fn set_held(
        &self,
        state: &mut ModulationsState,
        now: Micros,
        is_held: bool,
    ) -> Result<(), HoldError> {
        match (is_held, state.hold) {
            (false, _) => state.hold = Hold::Released,
            (true, Hold::Held) => {}
            (true, Hold::Expired) => return Err(HoldError::Expired),
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

    /// Runs one control tick; call this function every millisecond. Phases are determined at all
    /// times; joints are stimulated only while the object is held.
    ///
    /// # Errors
    /// Returns [`SensorFault`] if an object is held and a joint has no recent, plausible angle. No
    /// fault is latched here; `safety` does that.
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
            // While the object is held, every joint has an angle.
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

    /// Ends a hold that has lasted too long, and returns whether it did so in this call.
    fn end_overlong_hold(&self, state: &mut ModulationsState, now: Micros) -> bool {
        let shortest = self
            .0
            .iter()
            .map(|modulation| modulation.longest_hold_us)
            .min();
        let is_over = state.hold == Hold::Held
            && now.elapsed_since(state.since) >= shortest.unwrap_or_default();
        if is_over {
            state.hold = Hold::Expired;
        }
        is_over
    }

    /// Returns the angle of every joint in the latest tick, if it is recent and plausible, and the
    /// joint's phase.
    pub fn joint_readings(
        &self,
        state: &ModulationsState,
    ) -> impl Iterator<Item = (Option<Angle>, Option<MotionPhase>)> {
        self.0.iter().map(|modulation| {
            let phase_state = state.phases.get(usize::from(modulation.joint));
            (
                state.angle_of(modulation.joint),
                phase_state.and_then(PhaseState::phase),
            )
        })
    }
}

impl ModulationsState {
    /// Returns the present state of the handled object.
    #[must_use]
    pub const fn hold_state(&self) -> Hold {
        self.hold
    }

    fn angle_of(&self, joint: u8) -> Option<Angle> {
        self.angles.get(usize::from(joint)).copied().flatten()
    }
}

impl Modulation {
    /// Returns the present angle, if it is recent and plausible.
    fn angle(&self, state: &mut ModulationsState, now: Micros) -> Result<Angle, SensorFault> {
        let measured = state.sensors.get_mut(usize::from(self.joint));
        let measured = measured.ok_or(SensorFault::Absent)?;
        self.sensor.angle(measured, now, None)
    }

    /// Returns the present phase for the angle of the phase joint. Without an angle, the detector
    /// is reset and there is no phase.
    fn phase(&self, state: &mut ModulationsState, angle: Option<Angle>) -> Option<MotionPhase> {
        let phase_state = state.phases.get_mut(usize::from(self.joint))?;
        if angle.is_none() {
            *phase_state = PhaseState::default();
        }
        self.detector.step(phase_state, angle?)
    }
}
