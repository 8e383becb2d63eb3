//! State that the thread at the device and the thread at the terminal share.

use super::{Model, Order};
use host_core::link::Interruption;
use host_core::run::{Control, Observation, Observer, ObserverRequest};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time between two requests for the device's status.
const STATUS_PERIOD: Duration = Duration::from_millis(200);

/// Time without a check for keys after which the session is stopped, because no key could reach it.
const UNATTENDED: Duration = Duration::from_secs(2);

/// The model, and the orders that wait to be carried out.
pub struct Shared {
    model: Mutex<Model>,
    quit: AtomicBool,
    stop: AtomicBool,
    acknowledge: AtomicBool,
    controls: Mutex<VecDeque<Control>>,
    /// Time of the last check for keys.
    attended: Mutex<Instant>,
    interruption: Interruption,
}

impl Shared {
    /// Creates the shared state without any orders. A signal that `interruption` receives ends a
    /// run at once.
    pub fn new(model: Model, interruption: Interruption) -> Self {
        Self {
            model: Mutex::new(model),
            quit: AtomicBool::new(false),
            stop: AtomicBool::new(false),
            acknowledge: AtomicBool::new(false),
            controls: Mutex::default(),
            attended: Mutex::new(Instant::now()),
            interruption,
        }
    }

    /// Locks the model. If a thread panicked while it held the lock, the model keeps its last
    /// values.
    pub fn model(&self) -> MutexGuard<'_, Model> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn order(&self, order: Order) {
        let flag = match order {
            Order::Quit => &self.quit,
            Order::Stop => &self.stop,
            Order::Acknowledge => &self.acknowledge,
        };
        flag.store(true, Ordering::Release);
    }

    /// Queues an action on the running session.
    pub fn push_control(&self, control: Control) {
        self.controls().push_back(control);
    }

    /// Notes that the keyboard is being checked now.
    pub fn mark_attended(&self) {
        *self.attended.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    /// Returns whether the last check for keys is too long ago.
    fn is_unattended(&self) -> bool {
        let attended = self.attended.lock();
        attended.unwrap_or_else(PoisonError::into_inner).elapsed() > UNATTENDED
    }

    fn controls(&self) -> MutexGuard<'_, VecDeque<Control>> {
        self.controls.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns whether the user or the system asked to quit.
    pub fn is_quitting(&self) -> bool {
        self.is_quit_ordered() || self.interruption.received_signal().is_some()
    }

    fn is_quit_ordered(&self) -> bool {
        self.quit.load(Ordering::Acquire)
    }

    /// Returns whether an acknowledgement was ordered since the last call.
    pub fn take_acknowledge(&self) -> bool {
        self.acknowledge.swap(false, Ordering::AcqRel)
    }

    fn take_stop(&self) -> bool {
        self.stop.swap(false, Ordering::AcqRel)
    }
}

/// Observer that updates the model from a run and passes orders to the run.
pub struct Watch<'a> {
    shared: &'a Shared,
    /// Whether to request the device's status by the wall clock. Not in a recorded session, because
    /// a rerun must repeat every request.
    asks: bool,
    asked: Option<Instant>,
    /// Whether the session was stopped because no key could reach it.
    is_left: bool,
}

impl<'a> Watch<'a> {
    /// Creates an observer that updates the model of `shared`.
    pub fn new(shared: &'a Shared) -> Self {
        Self {
            shared,
            asks: shared.model().hands.is_none(),
            asked: None,
            is_left: false,
        }
    }
}

impl Observer for Watch<'_> {
    fn observe(&mut self, seen: Observation<'_>) {
        self.shared.model().observe(seen);
    }

    fn next_request(&mut self) -> ObserverRequest {
        // A run handles signals by itself, and reports that ending separately.
        if self.shared.take_stop() || self.shared.is_quit_ordered() {
            self.shared.model().is_ending = true;
            return ObserverRequest::Stop;
        }
        if !self.asks || self.asked.is_some_and(|at| at.elapsed() < STATUS_PERIOD) {
            return ObserverRequest::Nothing;
        }
        self.asked = Some(Instant::now());
        ObserverRequest::Status
    }

    fn next_control(&mut self, _: u64) -> Option<Control> {
        // A terminal that accepts no output also keeps its thread from reading keys.
        let has_hands = !self.asks;
        if has_hands && !self.is_left && self.shared.is_unattended() {
            self.is_left = true;
            return Some(Control::Stop);
        }
        self.shared.controls().pop_front()
    }

    fn interruption(&self) -> Option<Interruption> {
        Some(self.shared.interruption.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_reach_the_run_once_and_quitting_persists() {
        let shared = Shared::new(
            Model::new("native simulator", None),
            Interruption::default(),
        );
        let mut watch = Watch::new(&shared);
        assert_eq!(watch.next_request(), ObserverRequest::Status);
        assert_eq!(watch.next_request(), ObserverRequest::Nothing);
        shared.order(Order::Stop);
        assert_eq!(watch.next_request(), ObserverRequest::Stop);
        assert_eq!(watch.next_request(), ObserverRequest::Nothing);
        shared.order(Order::Quit);
        assert_eq!(watch.next_request(), ObserverRequest::Stop);
        assert_eq!(watch.next_request(), ObserverRequest::Stop);
        assert!(!shared.take_acknowledge());
        shared.order(Order::Acknowledge);
        assert!(shared.take_acknowledge());
        assert!(!shared.take_acknowledge());
    }
}
