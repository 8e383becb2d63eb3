//! What the host measures of a simulated wearer, or takes for measured, at each setpoint.

use super::Run;
use crate::link::{Port, stamp};
use crate::session::SessionLimb;
use firmware::control::SensorSource;
use firmware::link::Request;

impl<P: Port> Run<'_, '_, P> {
    pub(super) fn measures_posture(&self) -> bool {
        let limb = self.session.limb.as_ref();
        limb.is_some_and(SessionLimb::is_measured)
    }

    /// A measurement of each of the arm's angles now.
    pub(super) fn posture(&mut self) -> Vec<Request> {
        let at = stamp(self.now());
        let angles = self.client.port().posture_deg().into_iter().flatten();
        let measured = (0u8..).zip(angles).map(|(joint, deg)| {
            let centideg = (deg * 100.0).round() as i16; // saturates
            Request::Measurement {
                joint,
                centideg,
                at,
            }
        });
        measured.collect()
    }

    /// The modulated joints' angles of `due` µs after the start, measured now.
    pub(super) fn joint_angles(&mut self, due: u64) -> Vec<Request> {
        let at = stamp(self.now());
        let joints = self.session.modulations.iter();
        let measured = joints.map(|joint| Request::Measurement {
            joint: joint.spec.joint,
            centideg: joint.angle_at(due),
            at,
        });
        measured.collect()
    }

    pub(super) fn measures(&self) -> bool {
        self.session.sensor() == Some(SensorSource::Host)
    }

    /// Asks a simulated trigger input for its edges of `from..to`, µs after the
    /// start. A board has a real one.
    pub(super) fn trigger(&mut self, from: u64, to: u64) {
        let begin = self.epoch_us;
        if let (Some(trigger), Some(world)) = (&self.session.trigger, self.client.port().world()) {
            for at in trigger.edges.between(from, to) {
                world.hold_trigger(begin + at, trigger.held_us);
            }
        }
    }
}
