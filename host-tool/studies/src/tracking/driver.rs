//! Drivers of the finger: the device's own joint, or any law in floats.

use super::TrackingError;
use super::wearer::{KnownWearer, Volts};
use firmware::arithmetic::fixed_point::Q;
use firmware::control::setpoint::SetpointTrack;
use firmware::control::{
    Effort, FeedForward, HoldPolicy, Joint, JointSpec, JointState, LimitCycle, Mapping, SensorFault,
};
use firmware::units::{Amplitude, Angle, Micros};
use methods::control::{Controller, Input, Law};
use methods::real::Real;

/// A controller that receives setpoints and measured angles in frames, and computes the amplitudes
/// of the pulses. Angles are in degrees.
pub trait Driver {
    /// Passes a setpoint that is valid from `at` on and arrives at `now`.
    fn setpoint(&mut self, now: Micros, at: Micros, degrees: f64);
    /// Passes an angle that was measured at `at` and arrives at `now`.
    fn measurement(&mut self, now: Micros, at: Micros, degrees: f64);
    /// Runs the tick of one millisecond and returns the amplitudes for the next pulses.
    fn tick(&mut self, now: Micros) -> Volts;
    /// Returns the reason why the device has refused or stopped; `None` while it works.
    fn refused(&self) -> Option<&str> {
        None
    }
}

fn angle(degrees: f64) -> Angle {
    Angle::from_centideg((degrees * 100.0).round() as i16)
}

pub(super) fn volts(amplitudes: &[(u8, Amplitude)]) -> Volts {
    let mut voltages = [0.0; 3];
    for (channel, amplitude) in amplitudes {
        if let Some(slot) = voltages.get_mut(usize::from(*channel)) {
            *slot = f64::from(amplitude.get()) / 1000.0;
        }
    }
    voltages
}

/// A driver that records the amplitudes of another driver.
pub struct RecordedDriver {
    /// Driver whose amplitudes are recorded.
    pub driver: Box<dyn Driver>,
    /// Amplitudes of every tick so far.
    pub volts: Vec<Volts>,
}

impl Driver for RecordedDriver {
    fn setpoint(&mut self, now: Micros, at: Micros, degrees: f64) {
        self.driver.setpoint(now, at, degrees);
    }

    fn measurement(&mut self, now: Micros, at: Micros, degrees: f64) {
        self.driver.measurement(now, at, degrees);
    }

    fn tick(&mut self, now: Micros) -> Volts {
        let volts = self.driver.tick(now);
        self.volts.push(volts);
        volts
    }

    fn refused(&self) -> Option<&str> {
        self.driver.refused()
    }
}

/// The device's own joint code in fixed point.
#[derive(Debug)]
pub struct Device {
    joint: Joint,
    state: JointState,
    limit_cycles: Vec<LimitCycle>,
    refused: Option<String>,
}

impl Device {
    /// Builds the device's joint for this specification.
    ///
    /// # Errors
    /// Returns [`TrackingError::Joint`] with the first invalid field.
    pub fn new(spec: &JointSpec) -> Result<Self, TrackingError> {
        Ok(Self {
            joint: Joint::new(spec)?,
            state: JointState::default(),
            limit_cycles: Vec::new(),
            refused: None,
        })
    }

    /// Returns the limit cycles that the joint has detected, in order of time.
    pub fn limit_cycles(&self) -> &[LimitCycle] {
        &self.limit_cycles
    }

    /// Records a limit cycle. If the joint cannot lower its gain further, it counts as refused,
    /// because the board would report a fault.
    fn note(&mut self, found: LimitCycle) {
        self.limit_cycles.push(found);
        if found.gain_milli.is_none() {
            self.refused = Some("LimitCycle".to_owned());
        }
    }
}

impl Driver for Device {
    fn setpoint(&mut self, now: Micros, at: Micros, degrees: f64) {
        // A frame that overtook another is refused, as on the board.
        let _ = self
            .joint
            .accept_setpoint(&mut self.state, now, at, angle(degrees), None);
    }

    fn measurement(&mut self, now: Micros, at: Micros, degrees: f64) {
        let _ = self
            .joint
            .accept_measurement(&mut self.state, now, at, angle(degrees));
    }

    /// Returns no amplitudes before the first measurement, nor ever after a fault of the joint,
    /// which the board would latch.
    fn tick(&mut self, now: Micros) -> Volts {
        if self.refused.is_some() {
            return [0.0; 3];
        }
        match self.joint.tick(&mut self.state, now, None) {
            Ok(orders) => {
                if let Some(found) = self.state.take_limit_cycle() {
                    self.note(found);
                }
                volts(&orders.amplitudes)
            }
            Err(SensorFault::Absent) => [0.0; 3],
            Err(fault) => {
                self.refused = Some(format!("{fault:?}"));
                [0.0; 3]
            }
        }
    }

    fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }
}

/// A control law in floating point, with the setpoint track, feed-forward and mapping of the
/// device.
#[derive(Debug)]
pub struct Floating<R> {
    law: Controller<R>,
    period_ms: u32,
    hold: HoldPolicy,
    forward: FeedForward,
    mapping: Mapping,
    track: SetpointTrack,
    measured: Option<f64>,
    wait_ms: u32,
    held: Volts,
}

impl<R: Real> Floating<R> {
    /// Builds a driver that runs this law every `period_ms`.
    ///
    /// # Errors
    /// Returns [`TrackingError::Joint`] if the law needs a lead above half a second.
    pub fn new(
        law: Controller<R>,
        period_ms: u32,
        hold: HoldPolicy,
        known: &KnownWearer,
    ) -> Result<Self, TrackingError> {
        let lead_ms = (law.lead_s().to_f64() * 1000.0).round() as u16;
        Ok(Self {
            law,
            period_ms,
            hold,
            forward: known.feed_forward(lead_ms)?,
            mapping: known.mapping()?,
            track: SetpointTrack::default(),
            measured: None,
            wait_ms: 0,
            held: [0.0; 3],
        })
    }

    /// Returns the driver with or without anti-windup, whatever its law has by default.
    #[must_use]
    pub fn with_anti_windup(self, has: bool) -> Self {
        Self {
            law: self.law.with_anti_windup(has),
            ..self
        }
    }
}

impl<R: Real> Driver for Floating<R> {
    fn setpoint(&mut self, now: Micros, at: Micros, degrees: f64) {
        let _ = self.track.accept(now, at, angle(degrees), None);
    }

    fn measurement(&mut self, _: Micros, _: Micros, degrees: f64) {
        self.measured = Some(degrees);
    }

    fn tick(&mut self, now: Micros) -> Volts {
        let motion = self.track.motion_at(now, self.hold);
        let (Some((target, rate)), Some(measured)) = (motion, self.measured) else {
            return [0.0; 3];
        };
        if self.wait_ms > 0 {
            self.wait_ms -= 1;
            return self.held;
        }
        self.wait_ms = self.period_ms - 1;
        let forward: f64 = self.forward.effort(target, rate).to_num();
        let radians = |degrees: f64| R::from_f64(degrees.to_radians());
        let effort = self.law.step(&Input {
            target: radians(target.get().to_num()),
            target_rate: radians(rate.get().to_num()),
            measured: radians(measured),
            feed_forward: R::from_f64(forward),
        });
        // The mapping clamps long before ±2.
        let effort = Q::from_num(effort.to_f64().clamp(-2.0, 2.0));
        let (amplitudes, _) = self.mapping.amplitudes(Effort::Fraction(effort));
        self.held = volts(&amplitudes);
        self.held
    }
}
