//! The part of the device program that ticks at 1 kHz: joint control, the virtual wall, muscle
//! models and telemetry samples.

mod endpoint;
mod force;
mod in_force;
mod modulation;
mod muscles;
mod sample;
mod setup;
mod tables;

use super::mail::{
    ControlEvent, ControlMessage, ControlOrder, ControlRequest, ControlVerdict, ControllerMail,
};
use crate::control::{
    Amplitudes, Effort, EndpointState, ForceGap, ForceState, JointState, LimitCycle, Orders,
    SensorFault,
};
use crate::haptics::{ModulationsState, WallOrders, WallState};
use crate::link::{Code, Event, Refusal, Request, WrenchSample};
use crate::muscle::{Model, MuscleModelState};
use crate::pulse::CHANNELS;
use crate::safety::{Fault, State};
use crate::units::{Amplitude, Angle, Micros};
use heapless::Vec;
use in_force::CurrentPulses;
use sample::Subscription;
use setup::ControlSetup;
pub use tables::MuscleTables;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Phase {
    Off,
    Armed,
    Running,
}

/// Result of the joint's or wall's tick, for the pulser and for telemetry.
struct TickResult {
    amplitudes: Amplitudes,
    limiting: bool,
    /// Wanted angle; `None` before the first setpoint of a joint.
    target: Option<Angle>,
    measured: Angle,
    effort_milli: Option<i32>,
}

impl TickResult {
    /// Returns the result of a joint; `has_target` says whether its control law has run.
    fn from_joint_orders(orders: Orders, has_target: bool) -> Self {
        Self {
            amplitudes: orders.amplitudes,
            limiting: orders.limiting,
            target: has_target.then_some(orders.target),
            measured: orders.measured,
            effort_milli: has_target.then(|| Effort::to_milli(orders.effort)),
        }
    }
}

impl From<WallOrders> for TickResult {
    fn from(orders: WallOrders) -> Self {
        Self {
            amplitudes: orders.amplitudes,
            limiting: orders.limiting,
            target: Some(orders.wall),
            measured: orders.measured,
            effort_milli: Some(orders.penetration.to_millideg()),
        }
    }
}

/// State and telemetry of a channel under force control.
#[derive(Clone, Debug, Default)]
struct ForceChannel {
    state: ForceState,
    /// Wanted force, mN; `None` before the first setpoint.
    reference_mn: Option<u32>,
    /// Gap of the force range in which the reference has been since the last sample, if any.
    gap: Option<ForceGap>,
}

/// The controller, which owns the control law, the wall and the muscle models.
#[derive(Clone, Debug)]
pub struct Controller {
    phase: Phase,
    setup: ControlSetup,
    joint: JointState,
    wall: WallState,
    endpoint: EndpointState,
    modulations: ModulationsState,
    /// The arm's part of the next telemetry sample.
    wrench: Option<WrenchSample>,
    muscles: Vec<MuscleModelState, CHANNELS>,
    forces: Vec<ForceChannel, CHANNELS>,
    in_force: CurrentPulses,
    limiting: bool,
    /// The device's state, as the pulser reported it last.
    state: State,
    subscription: Subscription,
}

impl Default for Controller {
    fn default() -> Self {
        Self::new()
    }
}

impl Controller {
    /// Returns a controller without a setup.
    #[must_use]
    pub fn new() -> Self {
        Self {
            phase: Phase::Off,
            setup: ControlSetup::default(),
            joint: JointState::default(),
            wall: WallState::default(),
            endpoint: EndpointState::default(),
            modulations: ModulationsState::default(),
            wrench: None,
            muscles: Vec::new(),
            forces: Vec::new(),
            in_force: CurrentPulses::default(),
            limiting: false,
            state: State::Boot,
            subscription: Subscription::default(),
        }
    }

    /// Runs one tick at `now`. `adc` is the joint sensor's reading, if the board has one. `tables` are
    /// the same in every tick; a board places them, because they are too long for a stack.
    pub fn tick(
        &mut self,
        now: Micros,
        adc: Option<u16>,
        tables: &mut MuscleTables,
        mail: &mut ControllerMail<'_>,
    ) {
        // A pulse is reported when it is rendered, up to two windows early. It stays in the
        // mailbox, with all messages behind it, until the tick that contains it is over. So no
        // muscle is ever ahead of `now`.
        let is_due = |event: &ControlEvent| match event {
            ControlEvent::Pulse { at, .. } => now.has_reached(*at),
            _ => true,
        };
        while mail.events.peek().is_some_and(is_due) {
            let Some(event) = mail.events.dequeue() else {
                break;
            };
            self.handle_event(event, now, tables, mail);
        }
        let mut heard = None;
        let raised = mail.stop.count_raised();
        while let Some(ControlMessage { stops, request }) = mail.requests.dequeue() {
            heard = self
                .handle_request(request, stops == raised, now, mail)
                .or(heard);
        }
        if let Some(at) = heard {
            let _ = mail.post_order(ControlOrder::Heard(at)); // counted
        }
        self.in_force.silence_overdue(now);
        let acted = self.run_joint_or_wall(now, adc, mail);
        self.control_forces(now, tables, mail);
        self.control_endpoint(now, mail);
        self.control_modulations(now, mail);
        self.advance_muscles(now, tables, mail);
        self.post_sample(now, acted.as_ref(), tables, mail);
    }

    fn handle_event(
        &mut self,
        event: ControlEvent,
        now: Micros,
        tables: &mut MuscleTables,
        mail: &mut ControllerMail<'_>,
    ) {
        match event {
            ControlEvent::Armed => {
                // The session put all parts into the mailbox before it ordered, and puts in none
                // of another order before these are taken or dropped.
                while let Some(part) = mail.parts.dequeue() {
                    self.setup.insert(part);
                }
                self.take_lines(mail);
                self.reset_to_rest(now, tables);
            }
            ControlEvent::Refused => {
                while mail.lines.dequeue().is_some() {}
                while mail.parts.dequeue().is_some() {}
            }
            ControlEvent::Started => self.phase = Phase::Running,
            ControlEvent::Ended => self.end_control(),
            ControlEvent::State(state) => self.state = state,
            ControlEvent::Pulse {
                channel,
                at,
                stimulus,
                is_delayed,
            } => {
                self.limiting |= is_delayed;
                if let Some(joint) = &self.setup.joint {
                    joint.note_pulse(&mut self.joint, channel, is_delayed);
                }
                self.in_force.record_pulse(channel, at, stimulus);
                self.handle_pulse(channel, at, stimulus.amplitude, tables);
            }
            ControlEvent::Slowed => self.limiting = true,
        }
    }

    /// Resets the state of every controller and muscle model in the setup, when it is armed.
    fn reset_to_rest(&mut self, now: Micros, tables: &mut MuscleTables) {
        self.muscles.clear();
        for muscle in &self.setup.muscles {
            // As many slots as muscles.
            let _ = self.muscles.push(muscle.force.at_rest(now));
        }
        tables.begin(&self.setup.muscles);
        self.forces.clear();
        for _ in &self.setup.forces {
            let _ = self.forces.push(Default::default()); // as many slots
        }
        self.joint = JointState::default();
        self.wall = WallState::default();
        self.reset_endpoint();
        self.reset_modulations();
        self.in_force.reset(self.setup.periods_us);
        self.phase = Phase::Armed;
    }

    /// Ends control: no channel plays, and no setpoint is in force any more.
    fn end_control(&mut self) {
        self.phase = Phase::Off;
        self.in_force.silence();
        self.wrench = None;
        for followed in &mut self.forces {
            followed.reference_mn = None;
        }
    }

    /// Carries out a request; if `is_latest` is false, a stop came after it, and it may cause no
    /// output. Returns the arrival time of an accepted setpoint.
    fn handle_request(
        &mut self,
        request: ControlRequest,
        is_latest: bool,
        now: Micros,
        mail: &mut ControllerMail<'_>,
    ) -> Option<Micros> {
        let (seq, result, setpoint) = match request {
            ControlRequest::Subscribe(period) => {
                self.subscription.subscribe(period);
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
                    _ if !is_latest => Err(Refusal::new(Code::Stopped, "stop")),
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    None => Err(Refusal::new(Code::NoJoint, "joint")),
                    Some(joint) => joint
                        .accept_setpoint(&mut self.joint, now, at, angle, rate)
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
                    _ if !is_latest => Err(Refusal::new(Code::Stopped, "stop")),
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    None => {
                        Err(Refusal::new(Code::NoForceControl, "channel").with_channel(channel))
                    }
                    Some((force, followed)) => force
                        .accept_setpoint(&mut followed.state, now, at, millinewton, rate)
                        .map_err(|e| Refusal::from(e).with_channel(channel)),
                };
                (seq, result, Some(arrived))
            }
            ControlRequest::MuscleLevel {
                seq,
                channel,
                level,
            } => (seq, self.change_model_level(channel, level, now), None),
            ControlRequest::Wrench {
                seq,
                arrived,
                at,
                force_mn,
            } => {
                let result = match is_latest {
                    true => self.accept_force(now, at, force_mn),
                    false => Err(Refusal::new(Code::Stopped, "stop")),
                };
                (seq, result, Some(arrived))
            }
            ControlRequest::Held {
                seq,
                arrived,
                is_held,
            } => {
                // A release causes no output.
                let result = match is_latest || !is_held {
                    true => self.set_object_held(now, is_held),
                    false => Err(Refusal::new(Code::Stopped, "stop")),
                };
                (seq, result, Some(arrived))
            }
            ControlRequest::Measurement {
                seq,
                at,
                joint: axis,
                angle,
            } => {
                let result = match (&self.setup.joint, &self.setup.wall) {
                    _ if self.phase == Phase::Off => Err(Refusal::new(Code::NotArmed, "state")),
                    _ if self.setup.endpoint.is_some() => {
                        self.accept_posture_angle(now, at, axis, angle)
                    }
                    _ if !self.setup.modulations.is_empty() => {
                        self.accept_joint_angle(now, at, axis, angle)
                    }
                    _ if axis > 0 => Err(Refusal::from(
                        Request::JOINT.with_max_at_most(0).out_of_range(axis),
                    )),
                    (Some(joint), _) => joint
                        .accept_measurement(&mut self.joint, now, at, angle)
                        .map_err(Refusal::from),
                    (None, Some(wall)) => wall
                        .accept_measurement(&mut self.wall, now, at, angle)
                        .map_err(Refusal::from),
                    (None, None) => Err(Refusal::new(Code::NoJoint, "joint")),
                };
                (seq, result, None)
            }
        };
        let heard = setpoint.filter(|_| result.is_ok());
        let report = ControlVerdict {
            seq,
            at: now,
            result,
            setpoint: setpoint.is_some(),
        };
        let _ = mail.answer(report); // counted
        heard
    }

    /// Runs joint or wall while stimulating; a stale or implausible sensor is a fault.
    fn run_joint_or_wall(
        &mut self,
        now: Micros,
        adc: Option<u16>,
        mail: &mut ControllerMail<'_>,
    ) -> Option<TickResult> {
        if self.phase != Phase::Running {
            return None;
        }
        let acted = match (&self.setup.joint, &self.setup.wall) {
            (Some(joint), _) => {
                let reading = adc.and_then(|code| joint.angle_from_code(code));
                let orders = joint.tick(&mut self.joint, now, reading);
                orders.map(|orders| TickResult::from_joint_orders(orders, self.joint.has_target()))
            }
            (None, Some(wall)) => {
                let reading = adc.and_then(|code| wall.angle_from_code(code));
                let orders = wall.tick(&mut self.wall, now, reading);
                orders.map(TickResult::from)
            }
            (None, None) => return None,
        };
        match acted {
            Ok(acted) => {
                self.limiting |= acted.limiting;
                for &(channel, amplitude) in &acted.amplitudes {
                    self.record_order(channel, amplitude);
                }
                let _ = mail.post_order(ControlOrder::Amplitudes(acted.amplitudes.clone())); // counted
                if let Some(found) = self.joint.take_limit_cycle() {
                    Self::report_limit_cycle(found, now, mail);
                }
                Some(acted)
            }
            // A host that measures may need time until its first measurement.
            Err(SensorFault::Absent) => None,
            Err(SensorFault::Stale { .. }) => {
                let _ = mail.post_order(ControlOrder::Fault(Fault::SensorStale)); // counted
                None
            }
            Err(SensorFault::OutOfRange { .. }) => {
                let _ = mail.post_order(ControlOrder::Fault(Fault::SensorRange)); // counted
                None
            }
        }
    }

    /// Reports to the host a limit cycle that lowered the gain. One that persists at the lowest
    /// gain is a fault for the pulser to latch.
    fn report_limit_cycle(found: LimitCycle, now: Micros, mail: &mut ControllerMail<'_>) {
        let Some(gain_milli) = found.gain_milli else {
            let _ = mail.post_order(ControlOrder::Fault(Fault::LimitCycle)); // counted
            return;
        };
        let event = Event::LimitCycle {
            swing_centideg: found.swing.to_centideg().unsigned_abs(),
            period_ms: found.period_ms,
            gain_milli,
        };
        let _ = mail.report_event(now, event); // counted
    }

    /// Records a requested amplitude as the present one, except during a fall, which lowers it.
    fn record_order(&mut self, channel: u8, amplitude: Amplitude) {
        if self.state == State::Stimulating {
            self.in_force.set_amplitude(channel, amplitude);
        }
    }
}
