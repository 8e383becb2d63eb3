//! One muscle that several electrodes share, held in a frame that measures its force.
//!
//! Lives here: what electrodes reach of it (`spec`), its motor units in groups, each of
//! which tires by what it does itself. A unit fires whole or not at all: it answers each
//! electrode from a part of that electrode's strength on, so that what a group does follows
//! from who reaches it, and a unit that two electrodes reach fires at both their pulses.
//! Not here: persons, what is judged of them. In: pulses. Out: the frame's force.
//! Assumed, and said so wherever it is used: units alike in force and dynamics, groups of
//! one size, recruitment by Lee 2020's exponential, orders of recruitment that each
//! electrode has of its own.

mod spec;
mod unit;

pub use spec::{Electrode, InvalidShared, SharedSpec};

use super::{Body, CHANNELS, Load, Pulse};
use std::sync::{Arc, Mutex, PoisonError};
use unit::Unit;

/// From one reading of the frame to the next, µs.
pub const SAMPLE_US: u64 = 5_000;

/// What the frame read, N, one reading every [`SAMPLE_US`] from the body's begin.
pub type Readings = Arc<Mutex<Vec<f64>>>;

/// The muscle. Deterministic: pulses and spec decide everything.
pub struct Shared {
    spec: SharedSpec,
    units: Vec<Unit>,
    loads: [Load; CHANNELS],
    readings: Readings,
    /// Readings taken.
    taken: u64,
    latest_n: f64,
}

impl Shared {
    /// A rested one.
    ///
    /// # Errors
    /// Names the field that cannot be.
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

    /// What the frame reads from now on, whoever has the body.
    #[must_use]
    pub fn readings(&self) -> Readings {
        self.readings.clone()
    }

    /// What is left of the units' A, a mean of all: 1 of a rested muscle.
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
