//! The 1 kHz owner: joint control, the wall, muscle models, telemetry samples.

mod setup;

use super::mail::{ControlEvent, ControlOrder, ControlReport, ControlRequest, ControllerMail};
use crate::control::{
    Amplitudes, Effort, ForceOrders, ForceState, JointState, Orders, SensorFault,
};
use crate::haptics::{WallOrders, WallState};
use crate::link::{Code, ForceSample, Refusal, Telemetry};
use crate::muscle::{LadderState, Model, Rung};
use crate::pulse::CHANNELS;
use crate::safety::Fault;
use crate::units::{Amplitude, Angle, Micros};
use heapless::Vec;
use setup::ControlSetup;

pub use setup::Muscle;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    Off,
    Armed,
    Running,
}

/// What joint or wall did in a tick, for pulser and telemetry.
struct Acted {
    amplitudes: Amplitudes,
    limiting: bool,
    target: Angle,
    measured: Angle,
    effort_milli: i32,
}

impl From<Orders> for Acted {
    fn from(orders: Orders) -> Self {
        Self {
            amplitudes: orders.amplitudes,
            limiting: orders.limiting,
            target: orders.target,
            measured: orders.measured,
            effort_milli: Effort::to_milli(orders.effort),
        }
    }
}

impl From<WallOrders> for Acted {
    fn from(orders: WallOrders) -> Self {
        Self {
            amplitudes: orders.amplitudes,
            limiting: orders.limiting,
            target: orders.wall,
            measured: orders.measured,
            effort_milli: orders.penetration.to_millideg(),
        }
    }
}

/// Owns the control law, the wall and the muscle models.
#[derive(Debug)]
pub struct Controller {
    phase: Phase,
    setup: ControlSetup,
    joint: JointState,
    wall: WallState,
    muscles: Vec<LadderState, CHANNELS>,
    forces: Vec<(ForceState, ForceSample), CHANNELS>,
    amplitudes: [Amplitude; CHANNELS],
    limiting: bool,
    period: u16,
    until_sample: u16,
}

impl Default for Controller {
    fn default() -> Self {
        Self::new()
    }
}

impl Controller {
    /// A controller without a setup.
    #[must_use]
    pub fn new() -> Self {
        Self {
            phase: Phase::Off,
            setup: ControlSetup::default(),
            joint: JointState::default(),
            wall: WallState::default(),
            muscles: Vec::new(),
            forces: Vec::new(),
            amplitudes: [Amplitude::ZERO; CHANNELS],
            limiting: false,
            period: 0,
            until_sample: 0,
        }
    }

    /// One tick at `now`. `adc` is the joint sensor's conversion of this
    /// instant, if the board has one.
    pub fn tick(&mut self, now: Micros, adc: Option<u16>, mail: &mut ControllerMail<'_>) {
        // A pulse is told of when it is rendered, up to two windows early: it
        // stays in the mailbox, and all behind it, until the tick it lies in
        // is over. So no muscle is ever ahead of `now`.
        let is_due = |event: &ControlEvent| match event {
            ControlEvent::Pulse { at, .. } => now.has_reached(*at),
            _ => true,
        };
        while mail.events.peek().is_some_and(is_due) {
            let Some(event) = mail.events.dequeue() else {
                break;
            };
            self.follow(event, now, mail);
        }
        let mut heard = None;
        while let Some(request) = mail.requests.dequeue() {
            heard = self.take(request, now, mail).or(heard);
        }
        if let Some(at) = heard {
            order(ControlOrder::Heard(at), mail);
        }
        let acted = self.control(now, adc, mail);
        self.control_forces(now, mail);
        for (muscle, state) in self.setup.muscles.iter().zip(&mut self.muscles) {
            muscle.force.advance(state, now);
        }
        self.sample(now, acted.as_ref(), mail);
    }

    fn follow(&mut self, event: ControlEvent, now: Micros, mail: &mut ControllerMail<'_>) {
        match event {
            ControlEvent::Armed => {
                // The session put all parts in before it ordered, and puts in
                // none of another order before these are taken or dropped.
                while let Some(part) = mail.parts.dequeue() {
                    self.setup.put(part);
                }
                self.rest(now);
            }
            ControlEvent::Refused => while mail.parts.dequeue().is_some() {},
            ControlEvent::Started => self.phase = Phase::Running,
            ControlEvent::Ended => self.phase = Phase::Off,
            ControlEvent::Pulse {
                channel,
                at,
                amplitude,
            } => {
                if let Some(slot) = self.amplitudes.get_mut(usize::from(channel)) {
                    *slot = amplitude;
                }
                for (muscle, state) in self.setup.muscles.iter().zip(&mut self.muscles) {
                    if muscle.channel == channel {
                        muscle
                            .force
                            .pulse(state, at, muscle.recruitment.gain(amplitude));
                    }
                }
            }
        }
    }

    /// Everything of the setup at rest and fresh.
    fn rest(&mut self, now: Micros) {
        self.muscles.clear();
        for muscle in &self.setup.muscles {
            // As many slots as muscles.
            let _ = self.muscles.push(muscle.force.at_rest(now));
        }
        self.forces.clear();
        for _ in &self.setup.forces {
            let _ = self.forces.push(Default::default()); // as many slots
        }
        self.joint = JointState::default();
        self.wall = WallState::default();
        self.amplitudes = [Amplitude::ZERO; CHANNELS];
        self.phase = Phase::Armed;
    }

    fn change_rung(&mut self, channel: u8, rung: Rung) -> Result<(), Refusal<'static>> {
        if self.phase == Phase::Off {
            return Err(Refusal::new(Code::NotArmed, "state"));
        }
        let mut muscles = self.setup.muscles.iter().zip(&mut self.muscles);
        let (muscle, state) = muscles
            .find(|(muscle, _)| muscle.channel == channel)
            .ok_or(Refusal::new(Code::NoMuscle, "muscle").on(channel))?;
        muscle
            .force
            .switch(state, rung)
            .map_err(|_| Refusal::new(Code::NoFatigue, "fatigue").on(channel))
    }

    /// Carries out a request. When its last byte arrived if it was a setpoint.
    fn take(
        &mut self,
        request: ControlRequest,
        now: Micros,
        mail: &mut ControllerMail<'_>,
    ) -> Option<Micros> {
        let (seq, result, setpoint) = match request {
            ControlRequest::Subscribe(period) => {
                (self.period, self.until_sample) = (period, period);
                return None;
            }
            ControlRequest::Angle {
                seq,
                arrived,
                at,
                angle,
                rate,
            } => {
                let result = match &self.setup.joint {
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    None => Err(Refusal::new(Code::NoJoint, "joint")),
                    Some(joint) => joint
                        .setpoint(&mut self.joint, now, at, angle, rate)
                        .map_err(Refusal::from),
                };
                (seq, result, Some(arrived))
            }
            ControlRequest::Force {
                seq,
                arrived,
                at,
                channel,
                millinewton,
                rate,
            } => {
                let mut forces = self.setup.forces.iter().zip(&mut self.forces);
                let result = match forces.find(|(force, _)| force.channel == channel) {
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    None => Err(Refusal::new(Code::NoForceControl, "channel").on(channel)),
                    Some((force, (state, _))) => force
                        .setpoint(state, now, at, millinewton, rate)
                        .map_err(|e| Refusal::from(e).on(channel)),
                };
                (seq, result, Some(arrived))
            }
            ControlRequest::Rung { seq, channel, rung } => {
                (seq, self.change_rung(channel, rung), None)
            }
            ControlRequest::Measurement { seq, at, angle } => {
                let result = match (&self.setup.joint, &self.setup.wall) {
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    (Some(joint), _) => joint
                        .measurement(&mut self.joint, now, at, angle)
                        .map_err(Refusal::from),
                    (None, Some(wall)) => wall
                        .measurement(&mut self.wall, now, at, angle)
                        .map_err(Refusal::from),
                    (None, None) => Err(Refusal::new(Code::NoJoint, "joint")),
                };
                (seq, result, None)
            }
        };
        let heard = setpoint.filter(|_| result.is_ok());
        let report = ControlReport::Verdict {
            seq,
            at: now,
            result,
            setpoint: setpoint.is_some(),
        };
        let _ = mail.reports.enqueue(report); // see `Mailboxes`
        heard
    }

    /// Runs joint or wall while stimulating; a sensor that cannot be believed
    /// is a fault for the pulser to latch.
    fn control(
        &mut self,
        now: Micros,
        adc: Option<u16>,
        mail: &mut ControllerMail<'_>,
    ) -> Option<Acted> {
        if self.phase != Phase::Running {
            return None;
        }
        let acted = match (&self.setup.joint, &self.setup.wall) {
            (Some(joint), _) => {
                let reading = adc.and_then(|code| joint.angle_from_code(code));
                let orders = joint.tick(&mut self.joint, now, reading);
                orders.map(Acted::from)
            }
            (None, Some(wall)) => {
                let reading = adc.and_then(|code| wall.angle_from_code(code));
                let orders = wall.tick(&mut self.wall, now, reading);
                orders.map(Acted::from)
            }
            (None, None) => return None,
        };
        match acted {
            Ok(acted) => {
                self.limiting |= acted.limiting;
                for &(channel, amplitude) in &acted.amplitudes {
                    // No burst will come to say so.
                    if amplitude == Amplitude::ZERO
                        && let Some(latest) = self.amplitudes.get_mut(usize::from(channel))
                    {
                        *latest = amplitude;
                    }
                }
                order(ControlOrder::Amplitudes(acted.amplitudes.clone()), mail);
                Some(acted)
            }
            // A host that measures may need until its first setpoint.
            Err(SensorFault::Absent) => None,
            Err(SensorFault::Stale { .. }) => {
                order(ControlOrder::Fault(Fault::SensorStale), mail);
                None
            }
            Err(SensorFault::OutOfRange { .. }) => {
                order(ControlOrder::Fault(Fault::SensorRange), mail);
                None
            }
        }
    }

    /// Runs the channels under force control while stimulating.
    fn control_forces(&mut self, now: Micros, mail: &mut ControllerMail<'_>) {
        if self.phase != Phase::Running {
            return;
        }
        for (force, (state, sample)) in self.setup.forces.iter().zip(&mut self.forces) {
            let Some(ForceOrders { target, drive, gap }) = force.tick(state, now) else {
                continue;
            };
            self.limiting |= drive.limiting.is_some();
            *sample = ForceSample {
                target_mn: target.to_millinewton(),
                period_us: drive.period_us,
                gap: gap.or(sample.gap), // since the last sample, as `limiting`
            };
            let pulses = ControlOrder::Pulses {
                channel: force.channel,
                amplitude: drive.amplitude,
                period_us: drive.period_us,
            };
            order(pulses, mail);
        }
    }

    fn sample(&mut self, now: Micros, acted: Option<&Acted>, mail: &mut ControllerMail<'_>) {
        if self.period == 0 {
            return;
        }
        self.until_sample = self.until_sample.saturating_sub(1);
        if self.until_sample != 0 {
            return;
        }
        self.until_sample = self.period;
        let mut sample = Telemetry {
            at: now,
            limiting: core::mem::take(&mut self.limiting),
            ..Telemetry::default()
        };
        if let Some(acted) = acted {
            sample.target_centideg = acted.target.to_centideg();
            sample.measured_centideg = acted.measured.to_centideg();
            sample.effort_milli = acted.effort_milli;
        }
        for (channel, &amplitude) in self.amplitudes.iter().enumerate() {
            if self.setup.channels & 1 << channel != 0 {
                let _ = sample.amplitudes.push(amplitude); // as many slots as channels
            }
        }
        for (muscle, state) in self.setup.muscles.iter().zip(&self.muscles) {
            let _ = sample
                .forces_mn
                .push(muscle.force.force(state).to_millinewton()); // same
        }
        for (_, force) in &mut self.forces {
            let _ = sample.force_control.push(*force); // same
            force.gap = None;
        }
        let _ = mail.reports.enqueue(ControlReport::Telemetry(sample)); // late readers lose samples
    }
}

/// The pulser empties its mailbox four times per tick, and a tick writes two
/// orders and one for each channel under force control: there is room.
fn order(order: ControlOrder, mail: &mut ControllerMail<'_>) {
    let _ = mail.orders.enqueue(order);
}
