//! The device's controller of a joint, one tick at a time.

use crate::session::Session;
use firmware::control::{
    Joint, JointState, MeasurementError, SensorFault, SetpointError, SpecError,
};
use firmware::units::{Angle, AngularRate, Micros};
use fixed::types::I16F16;

/// Time between two ticks of the device, µs.
const TICK_US: u32 = 1_000;

/// Controller of a joint with its state.
pub struct JointController {
    joint: Joint,
    state: JointState,
    now: Micros,
    /// Whether the angle comes from the board's converter, as an argument of each tick.
    has_reading: bool,
}

/// Output of the controller after a tick.
#[derive(Clone, PartialEq, Debug)]
pub struct ControllerOutput {
    /// Output of the control law before any clamp; flexion is positive.
    pub effort: f64,
    /// Amplitudes by channel (from 1), in the unit of the channel; flexors first.
    pub amplitudes: Vec<(u8, f64)>,
    /// Whether an amplitude was held at the wearer's maximum.
    pub is_limited: bool,
}

/// Reason why a controller cannot be created or advanced.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The session has no joint (E796).
    #[error(
        "E796 the session has no [joint], so it has no controller; name a session with a joint"
    )]
    NoJoint,
    /// The device refuses the joint's specification (E797).
    #[error("E797 the device refuses the joint: {0:?}; correct [joint]")]
    Joint(SpecError),
    /// The reference is refused (E798).
    #[error(
        "E798 the reference of {0}° is refused: {1:?}; stay within the joint's range of angles"
    )]
    Reference(f64, SetpointError),
    /// The measured angle is refused (E799).
    #[error("E799 the measured angle of {0}° is refused; stay within the range of the sensor")]
    Measured(f64),
}

impl JointController {
    /// Creates the controller of the session's joint at rest.
    ///
    /// # Errors
    /// The session has no joint, or the device refuses it.
    pub fn from_session(session: &Session) -> Result<Self, ControllerError> {
        let spec = session.joint.as_ref().ok_or(ControllerError::NoJoint)?;
        Ok(Self {
            joint: Joint::new(spec).map_err(ControllerError::Joint)?,
            state: JointState::default(),
            now: Micros::new(0),
            has_reading: spec.sensor != firmware::control::SensorSource::Host,
        })
    }

    /// Sets the reference, °, and its rate, °/s, from now on.
    ///
    /// # Errors
    /// The reference is outside of the joint's range, or two references come within one tick.
    pub fn set_reference(&mut self, deg: f64, deg_per_s: f64) -> Result<(), ControllerError> {
        let angle = Angle::from_millideg(millidegrees(deg));
        let rate = AngularRate::new(I16F16::saturating_from_num(deg_per_s));
        let (state, now) = (&mut self.state, self.now);
        self.joint
            .accept_setpoint(state, now, now, angle, Some(rate))
            .map_err(|error| ControllerError::Reference(deg, error))
    }

    /// Advances the controller by `ticks` of 1 ms, during which the measured angle is
    /// `measured_deg`. Returns the output of the last tick; `None` without a tick.
    ///
    /// # Errors
    /// The angle is outside of the sensor's range.
    pub fn advance(
        &mut self,
        measured_deg: f64,
        ticks: u32,
    ) -> Result<Option<ControllerOutput>, ControllerError> {
        let angle = Angle::from_millideg(millidegrees(measured_deg));
        let refused = |_: MeasurementError| ControllerError::Measured(measured_deg);
        let fault = |_: SensorFault| ControllerError::Measured(measured_deg);
        let mut output = None;
        for _ in 0..ticks {
            self.now += firmware::units::us(TICK_US);
            let (state, now) = (&mut self.state, self.now);
            if !self.has_reading {
                self.joint
                    .accept_measurement(state, now, now, angle)
                    .map_err(refused)?;
            }
            let reading = self.has_reading.then_some(angle);
            let orders = self.joint.tick(state, now, reading).map_err(fault)?;
            let amplitudes = orders.amplitudes.iter();
            output = Some(ControllerOutput {
                effort: f64::from(orders.effort.to_milli()) / 1e3,
                amplitudes: amplitudes
                    .map(|(channel, amplitude)| (channel + 1, f64::from(amplitude.get()) / 1e3))
                    .collect(),
                is_limited: orders.limiting,
            });
        }
        Ok(output)
    }
}

/// Returns thousandths of a degree; saturates.
fn millidegrees(deg: f64) -> i32 {
    (deg * 1e3).round() as i32
}
