//! What the session asks of the controller.

use crate::muscle::Rung;
use crate::units::{Angle, AngularRate, ForceRate, Micros};

/// Session → controller.
#[derive(Clone, Copy, Debug)]
pub struct Asked {
    /// Stops raised when it was posted.
    pub stops: u32,
    /// What is asked.
    pub request: ControlRequest,
}

/// What a session asks of the controller.
#[derive(Clone, Copy, Debug)]
pub enum ControlRequest {
    /// A wanted angle.
    Angle {
        /// The request's number.
        seq: u16,
        /// When its last byte arrived.
        arrived: Micros,
        /// From when it is valid.
        at: Micros,
        /// The angle.
        angle: Angle,
        /// Its rate, if the host gave one.
        rate: Option<AngularRate>,
    },
    /// A wanted force.
    Force {
        /// The request's number.
        seq: u16,
        /// When its last byte arrived.
        arrived: Micros,
        /// From when it is valid.
        at: Micros,
        /// From 0.
        channel: u8,
        /// mN.
        millinewton: u32,
        /// Its rate, if the host gave one.
        rate: Option<ForceRate>,
    },
    /// A wanted force at the hand.
    Wrench {
        /// The request's number.
        seq: u16,
        /// When its last byte arrived.
        arrived: Micros,
        /// From when it is valid.
        at: Micros,
        /// mN, along x, y, z.
        force_mn: [i32; 3],
    },
    /// An object is held from now on, or released.
    Held {
        /// The request's number.
        seq: u16,
        /// When its last byte arrived.
        arrived: Micros,
        /// Which of the two.
        is_held: bool,
    },
    /// A joint angle measured by the host.
    Measurement {
        /// The request's number.
        seq: u16,
        /// When it was measured.
        at: Micros,
        /// Which of an arm's nine or of four modulated joints; 0 of a joint or a wall.
        joint: u8,
        /// The angle.
        angle: Angle,
    },
    /// Another rung for a muscle.
    Rung {
        /// The request's number.
        seq: u16,
        /// From 0.
        channel: u8,
        /// The rung from then on.
        rung: Rung,
    },
    /// Telemetry period in ticks, 0 for none.
    Subscribe(u16),
}
