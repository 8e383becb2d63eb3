//! Contents of the pulser's answers beside the verdict, and edges that no request asked for.

use super::State;
use crate::link::Event;
use crate::units::Micros;

/// Kind of order that a verdict answers, as far as the session needs it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AnsweredOrder {
    /// A `Start`, which the session counts until it is answered.
    Start,
    /// Amplitudes or a list of pulses.
    Setpoint,
    /// Any other order.
    Other,
}

/// Answer to [`super::OrderKind::Release`].
#[derive(Clone, Copy, Debug)]
pub struct ReleaseAnswer {
    /// Sequence number of the request, which the answer repeats.
    pub seq: u16,
    /// Time at which the pulser decided.
    pub at: Micros,
    /// Whether a restart was asked for, and not a takeover.
    pub restarts: bool,
    /// Whether the takeover or restart is granted.
    pub is_granted: bool,
    /// State of the device after the decision.
    pub state: State,
}

/// An edge of the trigger input or of the sync output.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// Time of the edge, which may be in the future.
    pub at: Micros,
    /// Whether it is an edge of the sync output, and not of the trigger input.
    pub is_sync: bool,
}

impl Edge {
    /// Returns the event that the session reports to the host.
    pub(in crate::device) const fn event(self) -> Event {
        if self.is_sync {
            Event::SyncEdge
        } else {
            Event::TriggerEdge
        }
    }
}
