//! Joints whose stimulation follows their angles: whether an object is held, their angles, and
//! their muscles' amplitudes.

use super::{Controller, Phase};
use crate::control::SensorFault;
use crate::device::mail::{ControlOrder, ControllerMail};
use crate::haptics::ModulationsState;
use crate::link::{Code, Event, JointSample, LiftSample, Refusal, Request};
use crate::safety::Fault;
use crate::units::{Angle, Micros};

impl Controller {
    /// Resets the modulated joints: no measured angles, and no object held.
    #[inline(never)]
    pub(super) fn reset_modulations(&mut self) {
        self.modulations = ModulationsState::default();
    }

    /// Takes the host's report that an object is held or released.
    #[inline(never)]
    pub(super) fn set_object_held(
        &mut self,
        now: Micros,
        is_held: bool,
    ) -> Result<(), Refusal<'static>> {
        if self.phase == Phase::Off {
            return Err(Refusal::new(Code::NotArmed, "state"));
        }
        let joints = &self.setup.modulations;
        if joints.is_empty() {
            return Err(Refusal::new(Code::NoModulation, "modulation"));
        }
        joints.set_held(&mut self.modulations, now, is_held)?;
        Ok(())
    }

    /// Takes the measured angle of one of the joints.
    #[inline(never)]
    pub(super) fn accept_joint_angle(
        &mut self,
        now: Micros,
        at: Micros,
        joint: u8,
        angle: Angle,
    ) -> Result<(), Refusal<'static>> {
        let joints = &self.setup.modulations;
        let taken = joints.accept_measurement(&mut self.modulations, now, at, joint, angle);
        let none = Refusal::new(Code::NoModulation, Request::JOINT.field);
        taken.ok_or(none)?.map_err(Refusal::from)
    }

    /// Computes and posts the amplitudes of the modulated joints while stimulating.
    #[inline]
    pub(super) fn control_modulations(&mut self, now: Micros, mail: &mut ControllerMail<'_>) {
        if self.phase == Phase::Running && !self.setup.modulations.is_empty() {
            self.run_modulations(now, mail);
        }
    }

    #[inline(never)]
    fn run_modulations(&mut self, now: Micros, mail: &mut ControllerMail<'_>) {
        let orders = match self.setup.modulations.tick(&mut self.modulations, now) {
            Ok(orders) => orders,
            Err(fault) => {
                let fault = match fault {
                    SensorFault::OutOfRange { .. } => Fault::SensorRange,
                    _ => Fault::SensorStale,
                };
                let _ = mail.post_order(ControlOrder::Fault(fault)); // counted
                return;
            }
        };
        if orders.is_just_over {
            let _ = mail.report_event(now, Event::HoldExpired); // counted
        }
        for (channel, amplitude) in orders.amplitudes {
            self.record_order(channel, amplitude);
            let order = ControlOrder::Amplitude { channel, amplitude };
            let _ = mail.post_order(order); // counted
        }
    }

    /// Returns the joints' part of the next telemetry sample; `None` if no joint runs.
    pub(super) fn lift_sample(&self) -> Option<LiftSample> {
        let joints = &self.setup.modulations;
        let runs = self.phase == Phase::Running && !joints.is_empty();
        let joint = |(angle, phase): (Option<Angle>, _)| JointSample {
            measured_centideg: angle.map(Angle::to_centideg),
            phase,
        };
        runs.then(|| LiftSample {
            hold: self.modulations.hold_state(),
            joints: joints
                .joint_readings(&self.modulations)
                .map(joint)
                .collect(),
        })
    }
}
