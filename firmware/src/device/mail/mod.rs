//! What the owners say to each other: single-producer, single-consumer.

mod answer;
mod asked;
mod post;

use super::part::ControlPart;
use crate::control::Amplitudes;
use crate::haptics::JOINTS;
use crate::limb::{LINES, LineSpec};
use crate::link::{Event, Refusal, Response};
use crate::pulse::CHANNELS;
use crate::safety::{
    Denied, Entry, FaultRecord, Left, Notice, PulseList, Setup, State, Stimuli, Stimulus,
};
use crate::units::{Amplitude, Micros};
use heapless::spsc::{Consumer, Producer, Queue};

pub use answer::{Answered, Edge, Released};
pub use asked::{Asked, ControlRequest};
use post::{Lost, StopFlag};

/// Session → pulser.
#[derive(Clone, Copy, Debug)]
pub struct Order {
    /// The request's number, for the verdict.
    pub seq: u16,
    /// When its last byte arrived.
    pub at: Micros,
    /// Stops raised when it was posted.
    pub stops: u32,
    /// What to do.
    pub kind: OrderKind,
}

/// What a session orders.
#[derive(Clone, Copy, Debug)]
pub enum OrderKind {
    /// Arm the setup that lies in the setup mailbox.
    Arm,
    Start,
    Acknowledge,
    Status,
    KeepAlive,
    /// Say whether another host may take over, or the device restart.
    Release {
        /// Which of the two.
        restarts: bool,
    },
    /// Play the list that lies in the list mailbox.
    Pulses,
    Amplitudes {
        /// From when they hold; `None` is on arrival.
        at: Option<Micros>,
        stimuli: Stimuli,
    },
    /// The session ends and its host has another: what waits for its time is forgotten.
    /// The one order without an answer.
    Forget,
}

/// Pulser → session.
#[derive(Clone, Copy, Debug)]
pub enum Report {
    /// Answer to an [`Order`].
    Verdict {
        /// The order's number.
        seq: u16,
        /// When it was decided.
        at: Micros,
        /// The decision.
        result: Result<(), Denied>,
        /// What it answers.
        answered: Answered,
        /// The state from then on.
        state: State,
    },
    /// Answer to [`OrderKind::Release`].
    Released(Released),
    /// Stops up to this one are carried out; void is what was posted before.
    Stopped {
        /// As counted by the [`StopFlag`].
        stops: u32,
        /// When.
        at: Micros,
        /// The state from then on.
        state: State,
    },
    /// Answer to [`OrderKind::Status`].
    Status {
        /// The order's number.
        seq: u16,
        /// Device time.
        at: Micros,
        /// State then.
        state: State,
        /// Pulses started since boot.
        pulses: u32,
        /// Trigger edges without a prepared train.
        idle_triggers: u32,
        /// Timed amplitudes that came too late.
        late_setpoints: u32,
        /// The latched or last fault.
        fault: Option<FaultRecord>,
        /// What is left of time and charge.
        left: Option<Left>,
    },
    /// Something changed.
    Changed {
        /// When.
        at: Micros,
        /// The state from then on.
        state: State,
        /// What happened.
        notice: Notice,
    },
}

/// Parts of the largest setup: the channels, a muscle for each, joint, wall or arm, or
/// joints that are modulated.
const PARTS: usize = CHANNELS + 1 + JOINTS;

/// Answer to an angle, a force, a measurement or a change
/// of rung.
#[derive(Clone, Debug)]
pub struct ControlVerdict {
    /// The request's number.
    pub seq: u16,
    /// When it was decided.
    pub at: Micros,
    /// The decision.
    pub result: Result<(), Refusal<'static>>,
    /// Whether it was a setpoint.
    pub setpoint: bool,
}

/// Controller → session.
#[derive(Clone, Debug)]
pub enum ControlReport {
    /// Answer to a request.
    Verdict(ControlVerdict),
    /// What no request asked for.
    Event {
        /// When.
        at: Micros,
        /// What.
        event: Event,
    },
}

/// Controller → pulser. A word-sized tag, so that it is copied word by word.
#[derive(Clone, Debug)]
#[repr(u32)]
pub enum ControlOrder {
    /// Amplitudes from the control law.
    Amplitudes(Amplitudes),
    /// An amplitude for an arm's muscle, or for a modulated joint's.
    Amplitude {
        /// From 0.
        channel: u8,
        /// Of the next burst.
        amplitude: Amplitude,
    },
    /// Amplitude and pulse rate from force control.
    Pulses {
        /// From 0.
        channel: u8,
        /// Of the next burst.
        amplitude: Amplitude,
        /// Burst start to burst start, µs.
        period_us: u32,
    },
    /// A valid setpoint of the session's owner arrived then.
    Heard(Micros),
    /// The joint's sensor cannot be believed.
    Fault(crate::safety::Fault),
}

/// Pulser → controller.
#[derive(Clone, Copy, Debug)]
pub enum ControlEvent {
    /// The setup in the mailbox is armed.
    Armed,
    /// The setup in the mailbox was refused.
    Refused,
    /// Stimulation started.
    Started,
    /// Stimulation or arming ended.
    Ended,
    /// The device's state from then on.
    State(State),
    /// A pulse was rendered.
    Pulse {
        /// From 0.
        channel: u8,
        /// Its leading edge.
        at: Micros,
        /// What it is made of.
        stimulus: Stimulus,
        /// A rise or the slope keeps it below what was ordered.
        is_delayed: bool,
    },
    /// What it ordered rose faster than the wearer allows, and was slowed down.
    Slowed,
}

/// All mailboxes; each holds one item less than its number. What is large has one of its
/// own. The controller's is not empty from an arm order to its verdict.
#[derive(Debug, Default)]
pub struct Mailboxes {
    setup: Queue<Setup, 2>,
    lists: Queue<PulseList, 2>,
    orders: Queue<Order, 32>,
    // A verdict for every order of one window, and what changes in it.
    reports: Queue<Report, 40>,
    entries: Queue<Entry, 4>,
    // Two a window, for as many as the session may be away.
    edges: Queue<Edge, 32>,
    control_parts: Queue<ControlPart, { PARTS + 1 }>,
    lines: Queue<LineSpec, { LINES + 1 }>,
    control_requests: Queue<Asked, 16>,
    // A verdict for every request of one tick, an event, and then some.
    control_reports: Queue<ControlReport, 24>,
    // As many ticks as the session may be making tables.
    samples: Queue<Response<'static>, 9>,
    // Two a tick and one for each channel under force control, of an arm or of modulated
    // joints, taken four times a tick.
    control_orders: Queue<ControlOrder, 16>,
    // 4 windows of at most 20 pulses between two control ticks, and 2 of pulses
    // still to come.
    control_events: Queue<ControlEvent, 168>,
    stop: StopFlag,
    lost: Lost,
}

/// The pulser's ends.
pub struct PulserMail<'a> {
    pub(super) setup: Consumer<'a, Setup>,
    pub(super) lists: Consumer<'a, PulseList>,
    pub(super) orders: Consumer<'a, Order>,
    pub(super) reports: Producer<'a, Report>,
    pub(super) entries: Producer<'a, Entry>,
    edges: Producer<'a, Edge>,
    pub(super) control_orders: Consumer<'a, ControlOrder>,
    pub(super) control_events: Producer<'a, ControlEvent>,
    pub(super) stop: &'a StopFlag,
    lost: &'a Lost,
}

/// The controller's ends.
pub struct ControllerMail<'a> {
    pub(super) parts: Consumer<'a, ControlPart>,
    pub(super) lines: Consumer<'a, LineSpec>,
    pub(super) requests: Consumer<'a, Asked>,
    pub(super) reports: Producer<'a, ControlReport>,
    samples: Producer<'a, Response<'static>>,
    pub(super) orders: Producer<'a, ControlOrder>,
    pub(super) events: Consumer<'a, ControlEvent>,
    pub(super) stop: &'a StopFlag,
    lost: &'a Lost,
}

/// The session's ends.
pub struct SessionMail<'a> {
    pub(super) setup: Producer<'a, Setup>,
    pub(super) lists: Producer<'a, PulseList>,
    pub(super) orders: Producer<'a, Order>,
    pub(super) reports: Consumer<'a, Report>,
    entries: Consumer<'a, Entry>,
    pub(super) edges: Consumer<'a, Edge>,
    pub(super) control_parts: Producer<'a, ControlPart>,
    pub(super) lines: Producer<'a, LineSpec>,
    pub(super) control_requests: Producer<'a, Asked>,
    pub(super) control_reports: Consumer<'a, ControlReport>,
    pub(super) samples: Consumer<'a, Response<'static>>,
    pub(super) stop: &'a StopFlag,
    pub(super) lost: &'a Lost,
}

impl Mailboxes {
    /// Empty mailboxes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            setup: Queue::new(),
            lists: Queue::new(),
            orders: Queue::new(),
            reports: Queue::new(),
            entries: Queue::new(),
            edges: Queue::new(),
            control_parts: Queue::new(),
            lines: Queue::new(),
            control_requests: Queue::new(),
            control_reports: Queue::new(),
            samples: Queue::new(),
            control_orders: Queue::new(),
            control_events: Queue::new(),
            stop: StopFlag::new(),
            lost: Lost::new(),
        }
    }

    /// Whether nothing waits for the pulser that has told of `stops` stops but
    /// amplitudes and the time of a setpoint, and nothing of its own for the session.
    pub(super) fn is_empty_for_pulser(&self, stops: u32) -> bool {
        use ControlOrder::{Amplitude, Amplitudes, Heard};
        let mut waiting = self.control_orders.iter();
        self.orders.is_empty()
            && waiting.all(|order| matches!(order, Amplitudes(_) | Amplitude { .. } | Heard(_)))
            && self.reports.is_empty()
            && self.stop.raised() == stops
    }

    /// What waits longest of the controller's orders.
    pub(super) fn next_control_order(&mut self) -> Option<ControlOrder> {
        self.control_orders.dequeue()
    }

    /// Whether [`super::Session::poll`] would find anything. For simulators.
    #[must_use]
    pub fn has_for_session(&self) -> bool {
        !(self.reports.is_empty()
            && self.control_reports.is_empty()
            && self.samples.is_empty()
            && self.edges.is_empty())
    }

    /// The three owners' ends.
    pub fn split(&mut self) -> (PulserMail<'_>, ControllerMail<'_>, SessionMail<'_>) {
        let (setup_tx, setup_rx) = self.setup.split();
        let (lists_tx, lists_rx) = self.lists.split();
        let (orders_tx, orders_rx) = self.orders.split();
        let (reports_tx, reports_rx) = self.reports.split();
        let (entries_tx, entries_rx) = self.entries.split();
        let (edges_tx, edges_rx) = self.edges.split();
        let (control_parts_tx, control_parts_rx) = self.control_parts.split();
        let (lines_of_arm_tx, lines_of_arm_rx) = self.lines.split();
        let (requests_tx, requests_rx) = self.control_requests.split();
        let (control_reports_tx, control_reports_rx) = self.control_reports.split();
        let (samples_tx, samples_rx) = self.samples.split();
        let (control_orders_tx, control_orders_rx) = self.control_orders.split();
        let (events_tx, events_rx) = self.control_events.split();
        let (stop, lost) = (&self.stop, &self.lost);
        let pulser = PulserMail {
            setup: setup_rx,
            lists: lists_rx,
            orders: orders_rx,
            reports: reports_tx,
            entries: entries_tx,
            edges: edges_tx,
            control_orders: control_orders_rx,
            control_events: events_tx,
            stop,
            lost,
        };
        let controller = ControllerMail {
            parts: control_parts_rx,
            lines: lines_of_arm_rx,
            requests: requests_rx,
            reports: control_reports_tx,
            samples: samples_tx,
            orders: control_orders_tx,
            events: events_rx,
            stop,
            lost,
        };
        let session = SessionMail {
            setup: setup_tx,
            lists: lists_tx,
            orders: orders_tx,
            reports: reports_rx,
            entries: entries_rx,
            edges: edges_rx,
            control_parts: control_parts_tx,
            lines: lines_of_arm_tx,
            control_requests: requests_tx,
            control_reports: control_reports_rx,
            samples: samples_rx,
            stop,
            lost,
        };
        (pulser, controller, session)
    }
}
