//! A body without mechanics that records the pulses that reach it.

use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use std::sync::{Arc, Mutex, PoisonError};

/// Resistance between the electrodes of every channel, Ω.
pub(crate) const LOAD_OHM: f64 = 1_000.0;

/// Shared list of the pulses that reached the electrodes, in their order.
#[derive(Clone, Default)]
pub(crate) struct ElectrodeLog(Arc<Mutex<Vec<Pulse>>>);

impl ElectrodeLog {
    /// Returns a copy of all pulses recorded so far.
    pub(crate) fn pulses(&self) -> Vec<Pulse> {
        let heard = self.0.lock();
        heard.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Simulated body without mechanics that records the pulses of every channel.
pub(crate) struct Notes {
    loads: [Load; CHANNELS],
    heard: ElectrodeLog,
}

impl Notes {
    /// Creates a body that appends its pulses to `heard`.
    pub(crate) fn new(heard: &ElectrodeLog) -> Self {
        Self {
            loads: [Load::Ohms(LOAD_OHM); CHANNELS],
            heard: heard.clone(),
        }
    }
}

impl Body for Notes {
    fn pulse(&mut self, pulse: &Pulse) {
        let heard = self.heard.0.lock();
        heard.unwrap_or_else(PoisonError::into_inner).push(*pulse);
    }

    fn advance(&mut self, _: u64) -> bool {
        false
    }

    fn angle_deg(&self) -> f64 {
        0.0
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
