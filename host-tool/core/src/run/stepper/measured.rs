//! Sends the angles that the host measures on a simulated wearer, or takes from the session, at
//! each setpoint.

use super::{RunError, Stepper};
use crate::link::{Port, stamp};
use crate::session::SessionLimb;
use firmware::control::SensorSource;
use firmware::link::Request;

impl<P: Port> Stepper<'_, P> {
    pub(super) fn measures_posture(&self) -> bool {
        let limb = self.session.limb.as_ref();
        limb.is_some_and(SessionLimb::is_measured)
    }

    /// Returns requests that tell the device the measured angles of a simulated arm, one for each
    /// angle.
    pub(super) fn posture_requests(&mut self) -> Vec<Request> {
        let at = stamp(self.device_time_us());
        let angles = self.connection.port().posture_deg().into_iter().flatten();
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

    /// Returns requests that tell the device the angles of the modulating joints. The session file
    /// gives these angles for the time `due`, µs after the start of the trains. They are stamped as
    /// if they were measured now.
    pub(super) fn joint_angle_requests(&mut self, due: u64) -> Vec<Request> {
        let at = stamp(self.device_time_us());
        let joints = self.session.modulations.iter();
        let measured = joints.map(|joint| Request::Measurement {
            joint: joint.spec.joint,
            centideg: joint.angle_at(due),
            at,
        });
        measured.collect()
    }

    pub(super) fn measures_angle(&self) -> bool {
        self.session.sensor() == Some(SensorSource::Host)
    }

    /// Sends the first angles, measured by the host or taken from the session file, so that the
    /// device has them before the first pulse. Fails if the device has no simulated arm whose
    /// angles could be measured. Fails also if the session file prescribes joint angles and the
    /// device could have a person connected.
    pub(super) fn send_measurements(&mut self) -> Result<(), RunError> {
        if self.measures_posture() {
            if self.connection.port().posture_deg().is_none() {
                return Err(RunError::NoPosture("this device".to_owned()));
            }
            for request in self.posture_requests() {
                self.connection.request(request)?;
            }
        }
        if !self.session.modulations.is_empty() {
            let port = self.connection.port();
            if port.world().is_none() && port.image().is_none() {
                return Err(RunError::ScriptedAngles("this device".to_owned()));
            }
            for request in self.joint_angle_requests(0) {
                self.connection.request(request)?;
            }
        }
        Ok(())
    }

    /// Schedules the edges of a simulated trigger input that lie before `to`, µs after the start of
    /// the trains, and are not scheduled yet. A board has a real trigger input.
    pub(super) fn schedule_triggers(&mut self, to: u64) {
        let (begin, from) = (self.started_us.unwrap_or(0), self.triggered_us);
        self.triggered_us = to;
        if let (Some(trigger), Some(world)) =
            (&self.session.trigger, self.connection.port().world())
        {
            for at in trigger.edges.between(from, to) {
                world.hold_trigger(begin + at, trigger.held_us);
            }
        }
    }
}
