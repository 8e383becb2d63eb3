//! One muscle that several electrodes share, held in a frame that measures its force.
//!
//! Submodules: `spec` (the part of the muscle that each electrode reaches) and `unit` (the motor
//! units, in groups, each of which fatigues by its own activity). A unit fires as a whole or not at
//! all: it responds to each electrode above a certain strength of that electrode. The force of a
//! group follows from the electrodes that reach it, and a unit that two electrodes reach fires at
//! the pulses of both. Wearers and the evaluation of results belong to other modules. Input:
//! pulses. Output: the force on the frame. The following is assumed, and reported wherever it
//! matters: units with the same force and dynamics, groups of equal size, recruitment by Lee 2020's
//! exponential, an independent order of recruitment per electrode.

mod spec;
mod unit;

pub use spec::{Electrode, InvalidShared, SharedSpec};

use super::{Body, CHANNELS, Load, Pulse};
use std::sync::{Arc, Mutex, PoisonError};
use unit::Unit;

/// Interval between readings of the frame, µs.
pub const SAMPLE_US: u64 = 5_000;

/// Readings of the frame, N, one every [`SAMPLE_US`] from the start of the simulation.
pub type Readings = Arc<Mutex<Vec<f64>>>;

/// The shared muscle. The simulation is deterministic: pulses and specification determine every
/// value.
pub struct Shared {
    spec: SharedSpec,
    units: Vec<Unit>,
    loads: [Load; CHANNELS],
    readings: Readings,
    /// Number of readings taken since the start of the simulation.
    taken: u64,
    latest_n: f64,
}

impl Shared {
    /// Creates a rested muscle.
    ///
    /// # Errors
    /// Returns the name of the first field of `spec` whose value is out of range.
    pub fn new(spec: SharedSpec) -> Result<Self, InvalidShared> {
        spec.check()?;
        let units = unit::rested_units(&spec);
        Ok(Self {
            spec,
            units,
            loads: [Load::NOMINAL; CHANNELS],
            readings: Readings::default(),
            taken: 0,
            latest_n: 0.0,
        })
    }

    /// Returns a shared handle to the readings, which stays valid when the body moves to another
    /// owner.
    #[must_use]
    pub fn readings(&self) -> Readings {
        self.readings.clone()
    }

    /// Returns the share of the force scale A that fatigue leaves, as the mean of all units; 1 for
    /// a rested muscle.
    #[must_use]
    pub fn remaining_strength(&self) -> f64 {
        let left = self.units.iter().map(Unit::remaining_strength);
        left.sum::<f64>() / self.units.len() as f64
    }
}

impl Body for Shared {
    fn pulse(&mut self, pulse: &Pulse) {
        let Some(Some(electrode)) = self.spec.electrodes.get(pulse.channel) else {
            return;
        };
        let ma = self.loads[pulse.channel].current_ma(pulse.drive);
        let strength = electrode.strength(ma);
        if strength <= 0.0 {
            return;
        }
        for unit in &mut self.units {
            unit.pulse(pulse.t_us, pulse.channel, strength);
        }
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let before = self.taken;
        while (self.taken + 1) * SAMPLE_US <= to_us {
            self.taken += 1;
            let t_us = self.taken * SAMPLE_US;
            let force = self.units.iter_mut().map(|unit| unit.force_at(t_us));
            let each_n = self.spec.strength_n / self.spec.units() as f64;
            self.latest_n = each_n * force.sum::<f64>();
            let mut readings = self.readings.lock().unwrap_or_else(PoisonError::into_inner);
            readings.push(self.latest_n);
        }
        self.taken != before
    }

    fn angle_deg(&self) -> f64 {
        0.0
    }

    fn sensed_deg(&self) -> f64 {
        0.0
    }

    fn instrument_n(&self) -> Option<f64> {
        Some(self.latest_n)
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
