//! Runs the device's joint code on the simulated finger, tick by tick, for the maps of delay and of
//! lost setpoints.

use crate::tracking::wearer::{self, Points};
use firmware::control::{HoldPolicy, Joint, JointSpec, JointState, LawSpec};
use firmware::units::{Angle, Micros};
use hal_sim::body::wearer::Participant;
use hal_sim::body::{Body, Drive, Finger, FingerSpec, Pulse};

/// Period of control ticks and of the simulated finger, 1 ms.
const TICK_US: u64 = 1000;
/// Pulse period, µs: 50 Hz (Hamana 2022 §II-D).
pub(super) const PULSE_PERIOD_US: u64 = 20_000;
const WIDTH_US: u32 = 200;

/// Returns participant P's finger with a sensor that has no noise and does not round, so that every
/// oscillation comes from the control loop.
pub(super) fn quiet_finger() -> FingerSpec {
    FingerSpec {
        sensor_noise_deg: 0.0,
        sensor_resolution_deg: 1e-6,
        ..FingerSpec::participant(Participant::P)
    }
}

/// Returns participant P's joint with the flexor point A and the extensor, under `law` with its own
/// period and cutoff, without a wearer model.
pub(super) fn one_point(law: LawSpec, hold: HoldPolicy) -> JointSpec {
    wearer::joint(law, Points::One, hold)
}

/// Returns participant P's joint under the default controller, with everything that the wearer file
/// configures: feed-forward, predictor and learning.
pub(super) fn default_one_point(hold: HoldPolicy) -> JointSpec {
    JointSpec {
        hold,
        ..wearer::shipped(Points::One)
    }
}

/// Converts an angle in degrees to the fixed point that the device uses, rounded to hundredths of a
/// degree.
pub(super) fn angle(deg: f64) -> Angle {
    Angle::from_centideg((deg * 100.0).round() as i16)
}

/// The device's joint code in closed loop with a simulated finger.
pub(super) struct Loop {
    joint: Joint,
    state: JointState,
    finger: Finger,
    tick: u64,
}

impl Loop {
    /// Starts the loop with the finger at rest. The law always has its full gain, because the map
    /// is about the law itself. Both specifications must be valid.
    pub(super) fn new(finger: FingerSpec, joint: &JointSpec, seed: u64) -> Self {
        Self {
            joint: Joint::with_full_gain(joint).expect("a valid joint"),
            state: JointState::default(),
            finger: Finger::new(finger, seed).expect("a valid finger"),
            tick: 0,
        }
    }

    /// Gives the joint a setpoint that is valid from the current time on, °.
    pub(super) fn setpoint(&mut self, deg: f64) {
        let now = self.now();
        let taken = self
            .joint
            .accept_setpoint(&mut self.state, now, now, angle(deg), None);
        taken.expect("setpoints come in order and within range");
    }

    fn now(&self) -> Micros {
        Micros::new((self.tick * TICK_US) as u32)
    }

    /// Simulates one millisecond: measurement, control, pulse and movement. Returns the true angle
    /// at its end, °.
    pub(super) fn step(&mut self) -> f64 {
        let now = self.now();
        let seen = angle(self.finger.sensed_deg());
        let taken = self
            .joint
            .accept_measurement(&mut self.state, now, now, seen);
        taken.expect("measurements come in order");
        let orders = self.joint.tick(&mut self.state, now, None);
        let orders = orders.expect("a fresh and believable angle");
        let t_us = self.tick * TICK_US;
        if t_us.is_multiple_of(PULSE_PERIOD_US) {
            for &(channel, amplitude) in &orders.amplitudes {
                self.finger.pulse(&Pulse {
                    t_us,
                    channel: channel.into(),
                    drive: Drive::Volts(f64::from(amplitude.get()) / 1000.0),
                    width_us: WIDTH_US,
                    conducted: false,
                });
            }
        }
        self.tick += 1;
        self.finger.advance(self.tick * TICK_US);
        self.finger.angle_deg()
    }
}
