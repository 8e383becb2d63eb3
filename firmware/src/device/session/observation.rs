//! State of the session for the log of the code that runs it.

use super::Session;
use crate::link::Refusal;
use crate::safety::{FaultRecord, State};

impl Session {
    /// Returns the latest state that the pulser reported.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns the fault that latched last, in this run or before it.
    #[must_use]
    pub const fn last_fault(&self) -> Option<FaultRecord> {
        self.identity.last_fault
    }

    /// Returns the latest refusal since the last call, if there was one.
    pub const fn take_refusal(&mut self) -> Option<Refusal<'static>> {
        self.refusal.take()
    }
}
