//! The controller's setup as separate parts, so that a whole setup is never on a stack.

use crate::control::{EndpointSpec, ForceControl, Joint};
use crate::haptics::{Modulation, Wall};
use crate::muscle::{MuscleModel, Recruitment};
use crate::pulse::CHANNELS;

/// A channel's muscle model: its recruitment and its force.
#[derive(Clone, Debug)]
pub struct Muscle {
    /// Channel under which the muscle lies, from 0.
    pub channel: u8,
    /// Conversion from amplitude to gain.
    pub recruitment: Recruitment,
    /// Conversion from gain and pulses to force.
    pub force: MuscleModel,
}

/// A part of the setup of one arm order. The controller takes all parts or drops all of them.
#[derive(Clone, Debug)]
pub enum ControlPart {
    /// The channels of the setup; always the first part.
    Channels {
        /// Channels in the setup, bit i for channel i.
        channels: u16,
        /// Channels whose pulse width may change, bit i for channel i.
        live_widths: u16,
        /// Time from burst start to burst start of each channel's train, µs.
        periods_us: [u32; CHANNELS],
    },
    /// A muscle whose force is predicted, and its force control, if any.
    Muscle(Muscle, Option<ForceControl>),
    /// The controlled joint.
    Joint(Joint),
    /// The virtual wall.
    Wall(Wall),
    /// The arm whose hand exerts a wanted force. Its lines of action come through a separate
    /// mailbox, and the arm is built from both where it is used, because it is longer than any
    /// other part.
    Limb(EndpointSpec),
    /// A joint whose stimulation follows its angle.
    Modulation(Modulation),
}
