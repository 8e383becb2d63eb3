//! Output of a simulated device on its way to the record, and to the page.

use hal_sim::trace::{Edge, Trace};
use host_core::run::{FullestPeriod, Outputs};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Receiver of outputs that its owner can still read: the period for the record, if there is one,
/// and all edges that the page may not have received yet.
#[derive(Clone)]
pub struct Tap(Arc<Mutex<TapState>>);

struct TapState {
    fullest: Option<FullestPeriod>,
    edges: Vec<Edge>,
    /// Time up to which the page has received edges, µs of the port's time.
    shown_us: u64,
}

impl Tap {
    /// Creates a receiver that also selects the period of a record.
    pub fn new(fullest: Option<FullestPeriod>) -> Self {
        Self(Arc::new(Mutex::new(TapState {
            fullest,
            edges: Vec::new(),
            shown_us: 0,
        })))
    }

    fn state(&self) -> MutexGuard<'_, TapState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Removes and returns the period of the record.
    pub fn take_period(&self) -> Option<FullestPeriod> {
        self.state().fullest.take()
    }

    /// Returns the edges before `to_us` that were not returned before: those that were received, and
    /// those that `present` still has.
    pub fn take_edges(&self, present: &Trace, to_us: u64) -> Vec<Edge> {
        let mut state = self.state();
        let from_us = state.shown_us;
        let mut edges = std::mem::take(&mut state.edges);
        let is_new = |edge: &Edge| (from_us..to_us).contains(&edge.t_us);
        edges.extend(present.edges_from(from_us));
        edges.retain(is_new);
        state.shown_us = to_us.max(from_us);
        edges
    }
}

/// Returns four numbers for each edge from the start of the trains on: time after the start in µs,
/// channel from 1, state, and amplitude code.
pub fn numbers(edges: Vec<Edge>, started_us: u64) -> Vec<u64> {
    // Earlier edges are those of the electrode check.
    let edges = edges.into_iter().filter(|edge| edge.t_us >= started_us);
    let numbers = edges.flat_map(|edge| {
        let channel = u64::from(edge.channel) + 1;
        let code = u64::from(edge.dac_code);
        [edge.t_us - started_us, channel, edge.state as u64, code]
    });
    numbers.collect()
}

impl Outputs for Tap {
    fn receive(&mut self, piece: &Trace, epoch_us: u64) {
        let mut state = self.state();
        let from_us = state.shown_us;
        state.edges.extend(piece.edges_from(from_us));
        if let Some(fullest) = &mut state.fullest {
            fullest.receive(piece, epoch_us);
        }
    }

    fn end(&mut self, now_us: u64) {
        if let Some(fullest) = &mut self.state().fullest {
            fullest.end(now_us);
        }
    }
}
