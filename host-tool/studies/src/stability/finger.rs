//! Runs the device's joint code on the simulated finger, tick by tick, for the maps of delay and of
//! lost setpoints.

use crate::tracking::wearer::{self, Points};
use firmware::control::{HoldPolicy, Joint, JointSpec, JointState, LawSpec, SensorFault};
use firmware::units::{Angle, Micros};
use hal_sim::body::wearer::Participant;
use hal_sim::body::{Body, Drive, Finger, FingerSpec, Pulse};
use host_core::session::LawName;
use std::f64::consts::TAU;

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

/// Returns the device's controllers for one point of participant P, with their names, each with its
/// own period and cutoff.
pub(super) fn controllers(hold: HoldPolicy) -> [(&'static str, JointSpec); 4] {
    controllers_at(Points::One, hold)
}

/// Returns the device's controllers for one or two points of participant P, as [`controllers`].
pub(super) fn controllers_at(points: Points, hold: HoldPolicy) -> [(&'static str, JointSpec); 4] {
    let joint = |law| wearer::joint(law, points, hold);
    let default = JointSpec {
        hold,
        ..wearer::shipped(points)
    };
    [
        (LawName::Recommended.title(), default),
        ("super-twisting alone", joint(LawSpec::ALONE)),
        (LawName::Paper.title(), joint(LawSpec::PAPER)),
        (LawName::Pid.title(), joint(LawSpec::PID)),
    ]
}

/// Sinusoidal reference angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sine {
    /// Mean angle, °.
    pub middle_deg: f64,
    /// Amplitude, °.
    pub swing_deg: f64,
    pub frequency_hz: f64,
}

impl Sine {
    /// Returns the angle at `t`, s, in degrees.
    pub(super) fn at(&self, t: f64) -> f64 {
        self.middle_deg + self.swing_deg * libm::sin(TAU * self.frequency_hz * t)
    }

    /// Returns the largest rate of the reference, °/s.
    pub(super) fn rate_deg_per_s(&self) -> f64 {
        self.swing_deg * TAU * self.frequency_hz
    }
}

/// Rate at which the maps of tracking send setpoints, Hz: that of the glove in Hamana 2022.
const SETPOINTS_HZ: f64 = 90.0;

/// Returns the RMSE of the finger's true angle against a reference, °, over the milliseconds
/// `scored_ms` of a trial from rest; infinite if the device stops because of its sensor. The sensor
/// is read at `frames_hz`, at most 1000.
pub(super) fn tracking_rmse_deg(
    mut device: Loop,
    reference: &Sine,
    scored_ms: std::ops::Range<u32>,
    frames_hz: f64,
) -> f64 {
    let mut square = 0.0;
    let is_new = |ms: u32, rate_hz: f64| {
        let frame = |ms: f64| (ms * 1e-3 * rate_hz).floor();
        ms == 0 || frame(f64::from(ms)) > frame(f64::from(ms) - 1.0)
    };
    for ms in 0..scored_ms.end {
        let t = f64::from(ms) * 1e-3;
        if is_new(ms, SETPOINTS_HZ) {
            device.setpoint(reference.at(t));
        }
        if is_new(ms, frames_hz) {
            device.measure();
        }
        let Ok(reached) = device.act() else {
            return f64::INFINITY;
        };
        if scored_ms.contains(&ms) {
            square += (reached - reference.at(t + 1e-3)).powi(2);
        }
    }
    (square / scored_ms.len() as f64).sqrt()
}

/// Returns how far the true angle swings over the last `judged_ms` of a trial that holds
/// `target_deg`, peak to peak, °.
pub(super) fn swing_deg(mut device: Loop, target_deg: f64, trial_ms: u32, judged_ms: u32) -> f64 {
    device.setpoint(target_deg);
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    for ms in 0..trial_ms {
        let angle = device.step();
        if ms >= trial_ms - judged_ms {
            (low, high) = (low.min(angle), high.max(angle));
        }
    }
    high - low
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
    /// Whether the flexor points are pulsed as a conducted pair.
    conducted: bool,
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
            conducted: joint.flexors.len() > 1,
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
        self.measure();
        self.act().expect("a fresh and believable angle")
    }

    /// Gives the joint the sensor's present reading.
    pub(super) fn measure(&mut self) {
        let now = self.now();
        let seen = angle(self.finger.sensed_deg());
        let taken = self
            .joint
            .accept_measurement(&mut self.state, now, now, seen);
        taken.expect("measurements come in order");
    }

    /// Simulates one millisecond without a measurement: control, pulse and movement. Returns the
    /// true angle at its end, °.
    pub(super) fn act(&mut self) -> Result<f64, SensorFault> {
        let now = self.now();
        let orders = self.joint.tick(&mut self.state, now, None)?;
        let t_us = self.tick * TICK_US;
        if t_us.is_multiple_of(PULSE_PERIOD_US) {
            for &(channel, amplitude) in &orders.amplitudes {
                self.finger.pulse(&Pulse {
                    t_us,
                    channel: channel.into(),
                    drive: Drive::Volts(f64::from(amplitude.get()) / 1000.0),
                    width_us: WIDTH_US,
                    conducted: self.conducted,
                });
            }
        }
        self.tick += 1;
        self.finger.advance(self.tick * TICK_US);
        Ok(self.finger.angle_deg())
    }
}
