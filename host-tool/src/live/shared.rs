//! What the thread at the device and the thread at the terminal share.

use super::{Model, Order};
use host_core::link::Interruption;
use host_core::run::{Control, Observation, Observer, ObserverRequest};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Between two questions for the device's status.
const STATUS_PERIOD: Duration = Duration::from_millis(200);

/// Keys that nobody has looked for in this time reach no session: it is stopped.
const UNATTENDED: Duration = Duration::from_secs(2);

/// The model, and orders that wait to be carried out.
pub struct Shared {
    model: Mutex<Model>,
    quit: AtomicBool,
    stop: AtomicBool,
    acknowledge: AtomicBool,
    controls: Mutex<VecDeque<Control>>,
    /// When keys were looked for last.
    attended: Mutex<Instant>,
    interruption: Interruption,
}

impl Shared {
    /// No orders yet; `interruption` ends a run at once.
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

    /// The model. A thread that panicked with it leaves it as it was.
    pub fn model(&self) -> MutexGuard<'_, Model> {
        self.model.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives an order.
    pub fn order(&self, order: Order) {
        let flag = match order {
            Order::Quit => &self.quit,
            Order::Stop => &self.stop,
            Order::Acknowledge => &self.acknowledge,
        };
        flag.store(true, Ordering::Release);
    }

    /// Does something at the controls.
    pub fn push_control(&self, control: Control) {
        self.controls().push_back(control);
    }

    /// Somebody looks for keys now.
    pub fn mark_attended(&self) {
        *self.attended.lock().unwrap_or_else(PoisonError::into_inner) = Instant::now();
    }

    /// Whether nobody has looked for keys for so long that no hand reaches the session.
    fn is_unattended(&self) -> bool {
        let attended = self.attended.lock();
        attended.unwrap_or_else(PoisonError::into_inner).elapsed() > UNATTENDED
    }

    fn controls(&self) -> MutexGuard<'_, VecDeque<Control>> {
        self.controls.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether leaving was ordered, here or by the system.
    pub fn is_quitting(&self) -> bool {
        self.is_quit_ordered() || self.interruption.received_signal().is_some()
    }

    fn is_quit_ordered(&self) -> bool {
        self.quit.load(Ordering::Acquire)
    }

    /// Whether an acknowledgement was ordered since last asked.
    pub fn take_acknowledge(&self) -> bool {
        self.acknowledge.swap(false, Ordering::AcqRel)
    }

    fn take_stop(&self) -> bool {
        self.stop.swap(false, Ordering::AcqRel)
    }
}

/// Fills the model from a run and brings it the orders.
pub struct Watch<'a> {
    shared: &'a Shared,
    /// Whether the device is asked for its status, by the wall clock: not in a session that
    /// is to be repeated, where every request counts.
    asks: bool,
    asked: Option<Instant>,
    /// No hand reaches the session any more, and it was stopped for that.
    is_left: bool,
}

impl<'a> Watch<'a> {
    /// Watches for `shared`.
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
        // A run heeds the system by itself, and tells that ending apart.
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
        // A terminal that takes no output keeps its reader from the keys, too.
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
