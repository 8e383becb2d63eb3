//! Control of the arm: forces wanted at its hand, its angles, and its muscles' amplitudes.

use super::{Controller, Phase};
use crate::control::{EndpointOrders, EndpointState, SensorFault};
use crate::device::mail::{ControlOrder, ControllerMail};
use crate::limb::Lines;
use crate::link::{Code, Refusal, WrenchSample};
use crate::safety::Fault;
use crate::units::{Angle, Micros};

impl Controller {
    /// Builds the arm with its lines of action, if the setup has an arm.
    #[inline(never)]
    pub(super) fn take_lines(&mut self, mail: &mut ControllerMail<'_>) {
        let mut lines = Lines::new();
        while let Some(line) = mail.lines.dequeue() {
            let _ = lines.push(line); // as many places as channels
        }
        self.setup.build_arm(&lines);
    }

    /// Resets the control of the arm: forgets its setpoints, measurements and telemetry values.
    #[inline(never)]
    pub(super) fn reset_endpoint(&mut self) {
        self.wrench = None;
        self.endpoint = EndpointState::default();
    }

    /// Takes a setpoint of the force at the hand, mN, valid from `at`.
    #[inline(never)]
    pub(super) fn accept_force(
        &mut self,
        now: Micros,
        at: Micros,
        force_mn: [i32; 3],
    ) -> Result<(), Refusal<'static>> {
        if self.phase == Phase::Off {
            return Err(Refusal::new(Code::NotArmed, "state"));
        }
        let none = Refusal::new(Code::NoLimb, "limb");
        let endpoint = self.setup.endpoint.as_ref().ok_or(none)?;
        let taken = endpoint.accept_force(&mut self.endpoint, now, at, force_mn);
        taken.map_err(Refusal::from)
    }

    /// Takes the host's measurement of one of the arm's nine angles, made at `at`.
    #[inline(never)]
    pub(super) fn accept_posture_angle(
        &mut self,
        now: Micros,
        at: Micros,
        axis: u8,
        angle: Angle,
    ) -> Result<(), Refusal<'static>> {
        let none = Refusal::new(Code::NoLimb, "limb");
        let endpoint = self.setup.endpoint.as_ref().ok_or(none)?;
        let taken = endpoint.accept_measurement(&mut self.endpoint, now, at, axis, angle);
        taken.map_err(Refusal::from)
    }

    /// Runs the control of the arm while stimulating. While the arm cannot produce the wanted force
    /// in its posture, its amplitudes are zero.
    #[inline]
    pub(super) fn control_endpoint(&mut self, now: Micros, mail: &mut ControllerMail<'_>) {
        if self.phase == Phase::Running && self.setup.endpoint.is_some() {
            self.run_endpoint(now, mail);
        }
    }

    #[inline(never)]
    fn run_endpoint(&mut self, now: Micros, mail: &mut ControllerMail<'_>) {
        let Some(endpoint) = &self.setup.endpoint else {
            return;
        };
        let orders = match endpoint.tick(&mut self.endpoint, now) {
            Ok(Some(orders)) => orders,
            Ok(None) | Err(SensorFault::Absent) => return,
            Err(fault) => {
                let fault = match fault {
                    SensorFault::OutOfRange { .. } => Fault::SensorRange,
                    _ => Fault::SensorStale,
                };
                let _ = mail.post_order(ControlOrder::Fault(fault)); // counted
                return;
            }
        };
        self.record_endpoint(&orders);
        for (channel, amplitude) in orders.amplitudes {
            self.record_order(channel, amplitude);
            let order = ControlOrder::Amplitude { channel, amplitude };
            let _ = mail.post_order(order); // counted
        }
    }

    /// Stores reference force and achievable share for the next telemetry sample.
    fn record_endpoint(&mut self, orders: &EndpointOrders) {
        self.limiting |= orders.achievable_permille < 1000;
        let least = self
            .wrench
            .map_or(1000, |sample| sample.achievable_permille);
        self.wrench = Some(WrenchSample {
            reference_mn: orders.reference_mn,
            achievable_permille: orders.achievable_permille.min(least),
        });
    }

    /// Returns the arm's part of the next telemetry sample, and restarts the minimum of the
    /// achievable share.
    pub(super) const fn take_wrench(&mut self) -> Option<WrenchSample> {
        let wrench = self.wrench;
        if let Some(sample) = &mut self.wrench {
            sample.achievable_permille = 1000;
        }
        wrench
    }
}
