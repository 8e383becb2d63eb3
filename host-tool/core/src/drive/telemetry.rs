//! Telemetry and events as they arrive, for a program that follows a trial.

use super::{Drive, DriveError, Stage};
use crate::link::Port;
use crate::record::Sample;
use crate::run::{Observation, Observer};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Largest number of samples that wait for a reader: more than two minutes at 1 kHz.
const MOST_WAITING: usize = 131_072;

/// Samples that have arrived and were not read yet.
#[derive(Clone, Default)]
pub(super) struct TelemetryQueue(Arc<Mutex<Queue>>);

#[derive(Default)]
struct Queue {
    /// Whether somebody reads the samples; otherwise none are stored.
    is_read: bool,
    samples: VecDeque<Sample>,
}

impl TelemetryQueue {
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Observer for TelemetryQueue {
    fn observe(&mut self, seen: Observation<'_>) {
        let Observation::Sample(sample) = seen else {
            return;
        };
        let mut queue = self.queue();
        if queue.is_read {
            if queue.samples.len() == MOST_WAITING {
                queue.samples.pop_front();
            }
            queue.samples.push_back(sample.clone());
        }
    }
}

impl Drive {
    /// Removes and returns the samples that have arrived since the last call. The first call
    /// returns none and makes later samples wait for the next one. Of more than 131 072 waiting
    /// samples the oldest are lost here; the record has all of them.
    pub fn take_samples(&mut self) -> Vec<Sample> {
        let mut queue = self.telemetry.queue();
        queue.is_read = true;
        queue.samples.drain(..).collect()
    }

    /// Returns the events of the present or latest trial from number `first` (from 0) on: time in
    /// s since the start of the trains, and description.
    #[must_use]
    pub fn events_from(&self, first: usize) -> Vec<(f64, String)> {
        let events = self.trial().map(|trial| trial.events.iter().skip(first));
        events.into_iter().flatten().cloned().collect()
    }

    /// Returns a copy of a simulated device with its wearer, in its present state. The copy goes on
    /// independently and records nothing.
    ///
    /// # Errors
    /// The drive is not armed, or the device or its wearer cannot be copied.
    pub fn fork(&self) -> Result<Self, DriveError> {
        let Stage::Active {
            stepper,
            is_started,
        } = &self.stage
        else {
            return Err(DriveError::NotCopyable);
        };
        let copy = stepper.snapshot_with(|port| Box::new(port) as Box<dyn Port>);
        let (source, copy) = (self.source.copy())
            .zip(copy)
            .ok_or(DriveError::NotCopyable)?;
        Ok(Self {
            stage: Stage::Active {
                stepper: Box::new(copy),
                is_started: *is_started,
            },
            session: self.session.clone(),
            trial: self.trial.clone(),
            count: self.count,
            telemetry_ms: self.telemetry_ms,
            keeps_edges: self.keeps_edges,
            ..Self::new(source)
        })
    }
}
