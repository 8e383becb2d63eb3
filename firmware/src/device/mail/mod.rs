//! Messages between the three parts of the device program, through queues with one producer and
//! one consumer each.

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
    Denial, Entry, FaultRecord, Notice, PulseList, RemainingAllowance, Setup, State, Stimuli,
    Stimulus,
};
use crate::units::{Amplitude, Micros};
use heapless::spsc::{Consumer, Producer, Queue};

pub use answer::{AnsweredOrder, Edge, ReleaseAnswer};
pub use asked::{ControlMessage, ControlRequest};
use post::{LostMessages, StopFlag};

/// A message from the session to the pulser.
#[derive(Clone, Copy, Debug)]
pub struct Order {
    /// The request's number, which the verdict repeats.
    pub seq: u16,
    /// Time at which the last byte of the request arrived.
    pub at: Micros,
    /// Number of stops raised when the order was posted.
    pub stops: u32,
    /// Action that the pulser carries out or refuses.
    pub kind: OrderKind,
}

/// An action that the session requests from the pulser.
#[derive(Clone, Copy, Debug)]
pub enum OrderKind {
    /// Arm the setup in the setup mailbox.
    Arm,
    /// Begin stimulation; the device must be armed.
    Start,
    /// Clear the latched fault after a last grounding.
    Acknowledge,
    /// Report state, counters and fault in a [`Report::Status`].
    Status,
    /// Note that the host still runs.
    KeepAlive,
    /// Decide whether another host may take over, or whether the device may restart.
    Release {
        /// Whether a restart is asked for, and not a takeover.
        restarts: bool,
    },
    /// Play the list in the list mailbox.
    Pulses,
    /// Set the amplitudes and widths of several channels.
    Amplitudes {
        /// Device time from which the amplitudes are valid; `None` means on arrival.
        at: Option<Micros>,
        /// Amplitudes and widths by channel.
        stimuli: Stimuli,
    },
    /// Drop the queued timed setpoints, because their session has ended. This is the only order
    /// without an answer.
    Forget,
}

/// A message from the pulser to the session.
#[derive(Clone, Copy, Debug)]
pub enum Report {
    /// The pulser's answer to an [`Order`]: accepted, or the refusal.
    Verdict {
        /// Number of the order that is answered.
        seq: u16,
        /// Time at which the order was decided.
        at: Micros,
        /// `Ok` if the order was accepted, else the reason for its refusal.
        result: Result<(), Denial>,
        /// Kind of the order that was answered.
        answered: AnsweredOrder,
        /// State of the device after the decision.
        state: State,
    },
    /// Answer to [`OrderKind::Release`].
    Released(ReleaseAnswer),
    /// All stops up to this count are carried out; orders posted before them are void.
    Stopped {
        /// Count of stops, as in the [`StopFlag`].
        stops: u32,
        /// Time at which the stops were carried out.
        at: Micros,
        /// State of the device after the stops.
        state: State,
    },
    /// Answer to [`OrderKind::Status`].
    Status {
        /// Number of the order that is answered.
        seq: u16,
        /// Device time of the report.
        at: Micros,
        /// State of the device at that time.
        state: State,
        /// Number of pulses started since boot.
        pulses: u32,
        /// Number of trigger edges that met no prepared train.
        idle_triggers: u32,
        /// Number of timed setpoints that arrived after their time.
        late_setpoints: u32,
        /// The latched or last fault; `None` if there was none.
        fault: Option<FaultRecord>,
        /// Time and charge left of the wearer's allowance; `None` before the first arming.
        left: Option<RemainingAllowance>,
    },
    /// A change of state, or another notice of the guard that no order asked for.
    Changed {
        /// Time of the change.
        at: Micros,
        /// State of the device after the change.
        state: State,
        /// Kind of the change, with its cause or measured values.
        notice: Notice,
    },
}

/// Number of parts of the largest setup: the channels, a muscle for each, and a joint, a wall, an
/// arm, or joints whose stimulation follows their angles.
const PARTS: usize = CHANNELS + 1 + JOINTS;

/// Answer to an angle, a force, a measurement or a change of the muscle's model level.
#[derive(Clone, Debug)]
pub struct ControlVerdict {
    /// Number of the request that is answered.
    pub seq: u16,
    /// Time at which the request was decided.
    pub at: Micros,
    /// `Ok` if the request was accepted, else the reason for its refusal.
    pub result: Result<(), Refusal<'static>>,
    /// Whether the request was a setpoint.
    pub setpoint: bool,
}

/// A message from the controller to the session.
#[derive(Clone, Debug)]
pub enum ControlReport {
    /// Answer to a request.
    Verdict(ControlVerdict),
    /// An event that no request asked for.
    Event {
        /// Time of the event.
        at: Micros,
        /// The event as the host receives it.
        event: Event,
    },
}

/// A message from the controller to the pulser. Its tag is one word, so that it is copied word by
/// word.
#[derive(Clone, Debug)]
#[repr(u32)]
pub enum ControlOrder {
    /// Amplitudes of all channels of the joint or of the wall.
    Amplitudes(Amplitudes),
    /// An amplitude for the muscle of an arm, or of a joint whose stimulation follows its angle.
    Amplitude {
        /// Channel of the muscle, from 0.
        channel: u8,
        /// Amplitude of the next burst.
        amplitude: Amplitude,
    },
    /// Amplitude and pulse rate from force control.
    Pulses {
        /// Channel under force control, from 0.
        channel: u8,
        /// Amplitude of the next burst.
        amplitude: Amplitude,
        /// Time from burst start to burst start, µs.
        period_us: u32,
    },
    /// Arrival time of a valid setpoint from the session's owner.
    Heard(Micros),
    /// A fault that the controller found, such as an implausible reading of a joint's sensor.
    Fault(crate::safety::Fault),
}

/// A message from the pulser to the controller.
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
    /// State of the device from then on.
    State(State),
    /// A pulse was rendered.
    Pulse {
        /// Channel of the pulse, from 0.
        channel: u8,
        /// Time of the pulse's leading edge.
        at: Micros,
        /// Amplitude and width of the pulse.
        stimulus: Stimulus,
        /// Whether a rise or the slope limit keeps the amplitude below the wanted one.
        is_delayed: bool,
    },
    /// The controller's amplitudes rose faster than the wearer allows, and were reduced.
    Slowed,
}

/// All mailboxes; each has room for one item less than the number in its type. Large items have a
/// mailbox of their own. The controller's mailbox of parts is not empty from an arm order to its
/// verdict.
#[derive(Clone, Debug, Default)]
pub struct Mailboxes {
    setup: Queue<Setup, 2>,
    lists: Queue<PulseList, 2>,
    orders: Queue<Order, 32>,
    // One verdict for every order of one window, and the changes in it.
    reports: Queue<Report, 40>,
    entries: Queue<Entry, 4>,
    // Two per window, for as many windows as the session may be away.
    edges: Queue<Edge, 32>,
    control_parts: Queue<ControlPart, { PARTS + 1 }>,
    lines: Queue<LineSpec, { LINES + 1 }>,
    control_requests: Queue<ControlMessage, 16>,
    // One verdict for every request of one tick, an event, and some spare room.
    control_reports: Queue<ControlReport, 24>,
    // As many ticks as the session may need to compute tables.
    samples: Queue<Response<'static>, 9>,
    // Two per tick, and one for each channel under force control, of an arm, or of joints whose
    // stimulation follows their angles; the pulser takes them four times per tick.
    control_orders: Queue<ControlOrder, 16>,
    // Pulses of 4 windows between two control ticks, at most 20 each, and of 2 windows that are
    // rendered but not played.
    control_events: Queue<ControlEvent, 168>,
    stop: StopFlag,
    lost: LostMessages,
}

/// The pulser's ends of the mailboxes.
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
    lost: &'a LostMessages,
}

/// The controller's ends of the mailboxes.
pub struct ControllerMail<'a> {
    pub(super) parts: Consumer<'a, ControlPart>,
    pub(super) lines: Consumer<'a, LineSpec>,
    pub(super) requests: Consumer<'a, ControlMessage>,
    pub(super) reports: Producer<'a, ControlReport>,
    samples: Producer<'a, Response<'static>>,
    pub(super) orders: Producer<'a, ControlOrder>,
    pub(super) events: Consumer<'a, ControlEvent>,
    pub(super) stop: &'a StopFlag,
    lost: &'a LostMessages,
}

/// The session's ends of the mailboxes.
pub struct SessionMail<'a> {
    pub(super) setup: Producer<'a, Setup>,
    pub(super) lists: Producer<'a, PulseList>,
    pub(super) orders: Producer<'a, Order>,
    pub(super) reports: Consumer<'a, Report>,
    entries: Consumer<'a, Entry>,
    pub(super) edges: Consumer<'a, Edge>,
    pub(super) control_parts: Producer<'a, ControlPart>,
    pub(super) lines: Producer<'a, LineSpec>,
    pub(super) control_requests: Producer<'a, ControlMessage>,
    pub(super) control_reports: Consumer<'a, ControlReport>,
    pub(super) samples: Consumer<'a, Response<'static>>,
    pub(super) stop: &'a StopFlag,
    pub(super) lost: &'a LostMessages,
}

impl Mailboxes {
    /// Returns empty mailboxes.
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
            lost: LostMessages::new(),
        }
    }

    /// Returns whether nothing waits for the pulser except amplitudes and the time of a setpoint,
    /// and nothing from the pulser waits for the session. `stops` is the number of stops that the
    /// pulser has reported.
    pub(super) fn is_empty_for_pulser(&self, stops: u32) -> bool {
        use ControlOrder::{Amplitude, Amplitudes, Heard};
        let mut waiting = self.control_orders.iter();
        self.orders.is_empty()
            && waiting.all(|order| matches!(order, Amplitudes(_) | Amplitude { .. } | Heard(_)))
            && self.reports.is_empty()
            && self.stop.count_raised() == stops
    }

    /// Removes and returns the oldest of the controller's orders.
    pub(super) fn next_control_order(&mut self) -> Option<ControlOrder> {
        self.control_orders.dequeue()
    }

    /// Returns whether [`super::Session::poll`] would find a message. For simulators.
    #[must_use]
    pub fn has_message_for_session(&self) -> bool {
        !(self.reports.is_empty()
            && self.control_reports.is_empty()
            && self.samples.is_empty()
            && self.edges.is_empty())
    }

    /// Returns the ends of the mailboxes for the three parts of the device program.
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
