//! Requests of the session to the controller.

use crate::muscle::MuscleLevel;
use crate::units::{Angle, AngularRate, ForceRate, Micros};

/// A message from the session to the controller.
#[derive(Clone, Copy, Debug)]
pub struct ControlMessage {
    /// Number of stops raised when the message was posted.
    pub stops: u32,
    /// The request itself.
    pub request: ControlRequest,
}

/// A request of the session to the controller.
#[derive(Clone, Copy, Debug)]
pub enum ControlRequest {
    /// Sets the reference angle of the joint, as [`Request::Angle`](crate::link::Request::Angle)
    /// does.
    Angle {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Time at which the last byte of the request arrived.
        arrived: Micros,
        /// Device time from which the angle is valid.
        at: Micros,
        /// Reference angle of the joint.
        angle: Angle,
        /// Rate of the angle, if the host gave one.
        rate: Option<AngularRate>,
    },
    /// Sets the reference of a channel under force control, as
    /// [`Request::Force`](crate::link::Request::Force) does.
    Force {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Time at which the last byte of the request arrived.
        arrived: Micros,
        /// Device time from which the force is valid.
        at: Micros,
        /// Channel under force control, from 0.
        channel: u8,
        /// Reference force, mN: the mean over a pulse period.
        millinewton: u32,
        /// Rate of the force, if the host gave one.
        rate: Option<ForceRate>,
    },
    /// A wanted force at the hand of the arm.
    Wrench {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Time at which the last byte of the request arrived.
        arrived: Micros,
        /// Device time from which the force is valid.
        at: Micros,
        /// The wanted force along x, y and z, mN.
        force_mn: [i32; 3],
    },
    /// An object is held or released from now on.
    Held {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Time at which the last byte of the request arrived.
        arrived: Micros,
        /// Whether the object is held, and not released.
        is_held: bool,
    },
    /// A joint angle that the host measured, for the control of a joint, an arm or a wall.
    Measurement {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Device time of the measurement.
        at: Micros,
        /// Number of the joint: one of an arm's nine, or of four whose stimulation follows their
        /// angles; 0 for a joint or a wall.
        joint: u8,
        /// Measured angle of the joint.
        angle: Angle,
    },
    /// A change of a muscle's model level.
    MuscleLevel {
        /// Sequence number of the host's request, which the answer repeats.
        seq: u16,
        /// Channel of the muscle, from 0.
        channel: u8,
        /// The model level from then on.
        level: MuscleLevel,
    },
    /// A telemetry period in ticks of 1 ms; 0 ends the subscription.
    Subscribe(u16),
}
