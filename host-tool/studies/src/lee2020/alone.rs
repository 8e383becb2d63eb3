//! Stimulates the simulated wrist directly, without a device, which is fast enough for many seeds.

use super::error::LeeError;
use super::protocol::{Stimulator, Train};
use hal_sim::body::bench::sensor::SAMPLE_US;
use hal_sim::body::bench::{Wrist, WristSpec};
use hal_sim::body::{Body, Drive, Pulse};
use host_core::identify::ForceRecord;

/// A simulated wrist that is stimulated without a device: every pulse starts at its exact
/// microsecond.
#[derive(Clone, Debug)]
pub struct ExactWrist {
    wrist: Wrist,
    now_us: u64,
}

impl ExactWrist {
    /// # Errors
    /// Fails if the test rig is invalid.
    pub fn new(spec: WristSpec, seed: u64) -> Result<Self, LeeError> {
        Ok(Self {
            wrist: Wrist::new(spec, seed)?,
            now_us: 0,
        })
    }

    /// Returns the wrist on the test rig.
    #[must_use]
    pub const fn wrist(&self) -> &Wrist {
        &self.wrist
    }

    /// Returns the wrist for changes to its electrodes.
    pub const fn wrist_mut(&mut self) -> &mut Wrist {
        &mut self.wrist
    }

    /// Plays a train. Returns the record of the force sensor, and the true force at each sample, N.
    pub fn train_with_truth(&mut self, train: &Train) -> (ForceRecord, Vec<f64>) {
        let first_us = self.now_us + train.before as u64 * SAMPLE_US;
        let mut pulses_us = Vec::with_capacity(train.pulses as usize);
        for place in 0..train.pulses {
            let after_us = u64::from(place) * u64::from(train.period_us());
            pulses_us.push((first_us + after_us - self.now_us) as u32); // at most seconds
            self.wrist.pulse(&Pulse {
                t_us: first_us + after_us,
                channel: self.wrist.spec().channel,
                drive: Drive::Milliamps(train.ma),
                width_us: train.width_us,
                conducted: false,
            });
        }
        let (mut samples_n, mut truth) = (Vec::new(), Vec::new());
        for sample in 0..train.samples as u64 {
            self.wrist.advance(self.now_us + sample * SAMPLE_US);
            samples_n.push(self.wrist.instrument_n().unwrap_or_default());
            truth.push(self.wrist.force_n());
        }
        self.now_us += train.samples as u64 * SAMPLE_US;
        let record = ForceRecord {
            pulses_us,
            samples_n,
            gain: 1.0,
        };
        (record, truth)
    }
}

impl Stimulator for ExactWrist {
    fn train(&mut self, train: &Train) -> Result<ForceRecord, LeeError> {
        Ok(self.train_with_truth(train).0)
    }

    fn rest(&mut self, s: f64) -> Result<(), LeeError> {
        self.now_us += (1e3 * s).round() as u64 * SAMPLE_US;
        self.wrist.advance(self.now_us);
        Ok(())
    }
}
