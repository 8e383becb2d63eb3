//! Edges of a simulated device, kept for the record of a drive.

use crate::record::Edge;
use crate::run::{FullestPeriod, Outputs, edges_between};
use crate::session::Session;
use hal_sim::trace::Trace;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Receiver of a simulated device's output that its owner can still read.
#[derive(Clone, Default)]
pub(super) struct DriveOutputs(Arc<Mutex<EdgeStore>>);

#[derive(Default)]
enum EdgeStore {
    #[default]
    Nothing,
    /// One period, for the pictures of a record.
    Period(FullestPeriod),
    /// All edges; times in µs after the start of the trains.
    All(Vec<Edge>),
}

impl DriveOutputs {
    pub(super) fn new(session: &Session, keeps_all: bool) -> Self {
        let kept = match keeps_all {
            true => EdgeStore::All(Vec::new()),
            false => EdgeStore::Period(FullestPeriod::new(session, 0)),
        };
        Self(Arc::new(Mutex::new(kept)))
    }

    fn store(&self) -> MutexGuard<'_, EdgeStore> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes and returns the edges.
    pub(super) fn take_edges(&self) -> Vec<Edge> {
        match std::mem::take(&mut *self.store()) {
            EdgeStore::Nothing => Vec::new(),
            EdgeStore::Period(period) => period.into_edges(),
            EdgeStore::All(edges) => edges,
        }
    }
}

impl Outputs for DriveOutputs {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        match &mut *self.store() {
            EdgeStore::Nothing => {}
            EdgeStore::Period(period) => period.receive(piece, epoch_us),
            EdgeStore::All(edges) => edges.extend(edges_between(piece, epoch_us, u64::MAX)),
        }
    }

    fn end(&mut self, now_us: u64) {
        if let EdgeStore::Period(period) = &mut *self.store() {
            period.end(now_us);
        }
    }
}
