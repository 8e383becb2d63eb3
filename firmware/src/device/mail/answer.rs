//! What the pulser's answers say beside the verdict.

use super::State;
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
