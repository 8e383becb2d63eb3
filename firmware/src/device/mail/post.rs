//! Posting to mailboxes. Messages that find no room are counted; a `Stop` needs no room.

use super::{
    ControlEvent, ControlOrder, ControlReport, ControlVerdict, ControllerMail, Edge, PulserMail,
    Report, SessionMail,
};
use crate::link::{Event, Response, Telemetry};
use crate::safety::Entry;
use crate::units::Micros;
use core::sync::atomic::{AtomicU32, Ordering};
use heapless::spsc::Producer;

/// Slots of the event mailbox that pulses leave free for changes of state, of which there are at
/// most two per window.
const RESERVED: usize = 16;

/// Counter of the stops that hosts asked for. The session raises it; pulser and controller read
/// it. It is separate from the mailboxes, so that a stop is never refused and waits behind
/// nothing. Every order carries the count at which it was posted: an order from before the latest
/// stop is void.
#[derive(Debug, Default)]
pub struct StopFlag(AtomicU32);

impl StopFlag {
    pub(super) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Raises the count by one, and returns it. Only the session calls this.
    pub(in crate::device) fn raise(&self) -> u32 {
        let raised = self.count_raised().wrapping_add(1);
        self.0.store(raised, Ordering::Release);
        raised
    }

    /// Returns the present count.
    pub(in crate::device) fn count_raised(&self) -> u32 {
        self.0.load(Ordering::Acquire)
    }
}

/// Number of messages of any sender that found no room since boot.
#[derive(Debug, Default)]
pub struct LostMessages(AtomicU32);

impl LostMessages {
    pub(super) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Returns the number of lost messages.
    pub(in crate::device) fn count(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }

    fn post<T>(&self, mailbox: &mut Producer<'_, T>, item: T) -> Result<(), Full> {
        mailbox.enqueue(item).map_err(|_| {
            self.0.fetch_add(1, Ordering::Relaxed);
            Full
        })
    }
}

/// The error that a mailbox had no room; the lost message was counted.
#[derive(Clone, Copy, Debug)]
pub struct Full;

impl PulserMail<'_> {
    /// Sends a report to the session. The session leaves room for the answer to every order that it
    /// posts, so only an event can be lost here, and only if the session is late.
    pub(in crate::device) fn report(&mut self, report: Report) -> Result<(), Full> {
        self.lost.post(&mut self.reports, report)
    }

    /// Reports an edge to the session, in a mailbox separate from the answers.
    pub(in crate::device) fn report_edge(&mut self, edge: Edge) -> Result<(), Full> {
        self.lost.post(&mut self.edges, edge)
    }

    /// Reports a pulse to the controller. A lost pulse is missing in its muscle's model; the
    /// watchdog catches a controller that is so late.
    pub(in crate::device) fn report_pulse(&mut self, event: ControlEvent) -> Result<(), Full> {
        if self.control_events.len() + RESERVED >= self.control_events.capacity() {
            self.lost.0.fetch_add(1, Ordering::Relaxed);
            return Err(Full);
        }
        self.notify(event)
    }

    /// Hands over `entry` to be written. If there is no room, the caller repeats it in the next
    /// window.
    pub(in crate::device) fn send_entry(&mut self, entry: Entry) -> Result<(), Full> {
        self.entries.enqueue(entry).map_err(|_| Full)
    }

    /// Reports an event to the controller that must not be lost.
    #[inline]
    pub(in crate::device) fn notify(&mut self, event: ControlEvent) -> Result<(), Full> {
        self.lost.post(&mut self.control_events, event)
    }
}

impl ControllerMail<'_> {
    /// Answers a request. The session leaves room for the answer to every request that it posts.
    pub(in crate::device) fn answer(&mut self, verdict: ControlVerdict) -> Result<(), Full> {
        (self.lost).post(&mut self.reports, ControlReport::Verdict(verdict))
    }

    /// Reports an event to the session that no request asked for.
    pub(in crate::device) fn report_event(&mut self, at: Micros, event: Event) -> Result<(), Full> {
        let report = ControlReport::Event { at, event };
        self.lost.post(&mut self.reports, report)
    }

    /// Posts a sample in the form in which the session sends it, if the session has taken the
    /// samples before it.
    #[inline(never)] // its room is no part of each tick's frame
    pub(in crate::device) fn post_sample(&mut self, sample: Telemetry) -> Result<(), Full> {
        self.lost
            .post(&mut self.samples, Response::Telemetry(sample))
    }

    /// Posts an order to the pulser, which takes orders four times per tick, so that there is room
    /// for the orders of a tick. The next tick repeats an order that is lost.
    #[inline]
    pub(in crate::device) fn post_order(&mut self, order: ControlOrder) -> Result<(), Full> {
        self.lost.post(&mut self.orders, order)
    }
}

impl SessionMail<'_> {
    /// Removes and returns an entry with the time and charge spent. The code that runs the session
    /// must write it to memory that a reset does not clear. Entries come at every end of
    /// stimulation and, while stimulation continues, more often than every 250 ms.
    pub fn take_entry(&mut self) -> Option<Entry> {
        self.entries.dequeue()
    }

    /// Returns whether the pulser can answer one more order. Orders are counted first: an order
    /// that is answered meanwhile counts twice, none is missed.
    pub(in crate::device) fn has_room_for_order(&self) -> bool {
        self.orders.len() + self.reports.len() < self.orders.capacity()
    }

    /// Returns whether the controller can answer one more request.
    pub(in crate::device) fn has_room_for_request(&self) -> bool {
        let waiting = self.control_requests.len() + self.control_reports.len();
        waiting < self.control_reports.capacity() && self.control_requests.ready()
    }
}

impl Clone for StopFlag {
    /// Returns a counter of its own that starts at the present count.
    fn clone(&self) -> Self {
        Self(AtomicU32::new(self.count_raised()))
    }
}

impl Clone for LostMessages {
    /// Returns a counter of its own that starts at the present number.
    fn clone(&self) -> Self {
        Self(AtomicU32::new(self.count()))
    }
}

#[cfg(test)]
mod tests {
    use super::{ControlEvent, Micros};
    use crate::device::mail::{Mailboxes, Order, OrderKind};
    use std::vec::Vec;

    fn post(mail: &mut Mailboxes, seq: u16) {
        let (.., mut session) = mail.split();
        let stops = session.stop.raise();
        let order = Order {
            seq,
            at: Micros::new(0),
            stops,
            kind: OrderKind::Status,
        };
        assert!(session.orders.enqueue(order).is_ok(), "the mailbox is full");
    }

    fn take(mail: &mut Mailboxes) -> Vec<u16> {
        let (mut pulser, ..) = mail.split();
        std::iter::from_fn(|| pulser.orders.dequeue().map(|order| order.seq)).collect()
    }

    #[test]
    fn a_copy_has_the_same_messages_and_counts_and_is_independent() {
        let mut mail = Mailboxes::new();
        // The ring buffer of the original begins in the middle.
        (0..20).for_each(|seq| post(&mut mail, seq));
        assert_eq!(take(&mut mail).len(), 20);
        (20..45).for_each(|seq| post(&mut mail, seq));
        let (mut pulser, ..) = mail.split();
        while pulser.report_pulse(ControlEvent::Slowed).is_ok() {}
        let mut copy = mail.clone();
        assert_eq!(copy.stop.count_raised(), mail.stop.count_raised());
        assert_eq!(copy.lost.count(), 1);
        assert_eq!(copy.control_events.len(), mail.control_events.len());

        post(&mut copy, 45);
        let (mut pulser, ..) = copy.split();
        assert!(pulser.report_pulse(ControlEvent::Slowed).is_err());
        assert_eq!(take(&mut copy), (20..=45).collect::<Vec<_>>());
        assert_eq!(take(&mut mail), (20..45).collect::<Vec<_>>());
        assert_eq!((mail.stop.count_raised(), mail.lost.count()), (45, 1));
        assert_eq!((copy.stop.count_raised(), copy.lost.count()), (46, 2));
    }
}
