//! The controller's setup, assembled part by part.

use super::super::part::{ControlPart, Muscle};
use crate::control::{Endpoint, EndpointSpec, ForceControl, Joint};
use crate::haptics::{Modulations, Wall};
use crate::limb::Lines;
use crate::pulse::CHANNELS;
use heapless::Vec;

/// The controller's setup from arming on.
#[derive(Clone, Debug, Default)]
pub(super) struct ControlSetup {
    /// Channels in the setup, bit i for channel i.
    pub(super) channels: u16,
    /// Channels whose pulse width may change, bit i for channel i.
    pub(super) live_widths: u16,
    /// Time from burst start to burst start of each channel's train, µs.
    pub(super) periods_us: [u32; CHANNELS],
    /// Muscles whose force is predicted, by rising channel.
    pub(super) muscles: Vec<Muscle, CHANNELS>,
    /// Channels under force control, by rising channel.
    pub(super) forces: Vec<ForceControl, CHANNELS>,
    /// The controlled joint; `None` if there is a wall.
    pub(super) joint: Option<Joint>,
    /// The virtual wall; `None` if there is a joint.
    pub(super) wall: Option<Wall>,
    /// The arm; `None` if there is a joint or a wall.
    pub(super) endpoint: Option<Endpoint>,
    /// The joints whose stimulation follows their angles; empty with a joint, a wall or an arm.
    pub(super) modulations: Modulations,
    /// Parameters from which the arm is to be built.
    limb: Option<EndpointSpec>,
}

impl ControlSetup {
    /// Inserts a part; the first part removes the earlier setup.
    pub(super) fn insert(&mut self, part: ControlPart) {
        match part {
            ControlPart::Channels {
                channels,
                live_widths,
                periods_us,
            } => {
                (self.channels, self.live_widths) = (channels, live_widths);
                self.periods_us = periods_us;
                self.muscles.clear();
                self.forces.clear();
                (self.joint, self.wall) = (None, None);
                (self.endpoint, self.limb) = (None, None);
                self.modulations.clear();
            }
            ControlPart::Muscle(muscle, force) => {
                // As many slots as channels.
                let _ = self.muscles.push(muscle);
                if let Some(force) = force {
                    let _ = self.forces.push(force); // same
                }
            }
            ControlPart::Joint(joint) => self.joint = Some(joint),
            ControlPart::Wall(wall) => self.wall = Some(wall),
            ControlPart::Limb(spec) => self.limb = Some(spec),
            ControlPart::Modulation(joint) => self.modulations.push(joint),
        }
    }

    /// Builds the arm with its lines of action; both were checked together.
    #[inline(never)]
    pub(super) fn build_arm(&mut self, lines: &Lines) {
        let spec = self.limb.take();
        self.endpoint = spec.and_then(|spec| Endpoint::new(&spec, lines).ok());
    }
}
