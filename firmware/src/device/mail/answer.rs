//! What the pulser's answers say beside the verdict, and the edges that nobody asked for.

use super::State;
use crate::link::Event;
use crate::units::Micros;

/// What kind of order a verdict answers, as far as the session asks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Answered {
    Start,
    Setpoint,
    Other,
}

/// Answer to [`super::OrderKind::Release`].
#[derive(Clone, Copy, Debug)]
pub struct Released {
    /// The order's number.
    pub seq: u16,
    /// When it was decided.
    pub at: Micros,
    /// Of a restart.
    pub restarts: bool,
    /// The decision.
    pub is_granted: bool,
    /// The state from then on.
    pub state: State,
}

/// An edge of the trigger input or of the sync output.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// When it came, or will.
    pub at: Micros,
    /// Of the sync output.
    pub is_sync: bool,
}

impl Edge {
    /// As the session reports it.
    pub(in crate::device) const fn event(self) -> Event {
        if self.is_sync {
            Event::SyncEdge
        } else {
            Event::TriggerEdge
        }
    }
}
