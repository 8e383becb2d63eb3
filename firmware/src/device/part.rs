//! What the controller works with, part by part, so that no whole setup is ever on
//! a stack.

use crate::control::{EndpointSpec, ForceControl, Joint};
use crate::haptics::{Modulation, Wall};
use crate::muscle::{Ladder, Recruitment};
use crate::pulse::CHANNELS;

/// A channel's muscle: how it is recruited and how its force develops.
#[derive(Clone, Debug)]
pub struct Muscle {
    /// From 0.
    pub channel: u8,
    /// Amplitude → gain.
    pub recruitment: Recruitment,
    /// Gain and pulses → force.
    pub force: Ladder,
}

/// A part of what an arm order is about. The controller takes all parts or drops
/// all.
#[derive(Clone, Debug)]
pub enum ControlPart {
    /// The first part.
    Channels {
        /// Bit i: channel i is part of the setup.
        channels: u16,
        /// Bit i: the width of its pulses may change.
        live_widths: u16,
        /// Burst start to burst start of its train, µs.
        periods_us: [u32; CHANNELS],
    },
    /// A muscle whose force is predicted, and controlled or not.
    Muscle(Muscle, Option<ForceControl>),
    /// The controlled joint.
    Joint(Joint),
    /// The virtual wall.
    Wall(Wall),
    /// The arm whose hand exerts a wanted force. Its lines come by a mailbox of their
    /// own, and it is built of both where it is used: whole it is longer than any part.
    Limb(EndpointSpec),
    /// A joint whose stimulation follows its angle.
    Modulation(Modulation),
}
