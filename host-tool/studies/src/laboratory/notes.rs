//! A body that only notes which pulses reach it.

use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use std::sync::{Arc, Mutex, PoisonError};

/// Between the electrodes of each channel, Ω.
pub(crate) const LOAD_OHM: f64 = 1_000.0;

/// What reached the electrodes, in its order.
#[derive(Clone, Default)]
pub(crate) struct ElectrodeLog(Arc<Mutex<Vec<Pulse>>>);

impl ElectrodeLog {
    /// All of it so far.
    pub(crate) fn pulses(&self) -> Vec<Pulse> {
        let heard = self.0.lock();
        heard.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// A dummy load at each channel; what it is pulsed with is heard.
pub(crate) struct Notes {
    loads: [Load; CHANNELS],
    heard: ElectrodeLog,
}

impl Notes {
    /// Whose pulses go to `heard`.
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
