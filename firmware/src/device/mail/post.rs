//! Posting: what finds no room is counted, and a `Stop` needs none.

use super::{
    ControlEvent, ControlOrder, ControlReport, ControlVerdict, ControllerMail, Edge, PulserMail,
    Report, SessionMail,
};
use crate::link::{Event, Response, Telemetry};
use crate::safety::Entry;
use crate::units::Micros;
use core::sync::atomic::{AtomicU32, Ordering};
use heapless::spsc::Producer;

/// Slots of the event mailbox that pulses leave to changes of state, of which
/// there are at most two a window.
const RESERVED: usize = 16;

/// The stops that hosts asked for, counted: raised by the session, looked at by
/// pulser and controller. It is beside the mailboxes, so that a stop is never
/// refused and waits behind nothing. Every order carries the count it was posted
/// at: one from before the latest stop is void.
#[derive(Debug, Default)]
pub struct StopFlag(AtomicU32);

impl StopFlag {
    pub(super) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Raises it once more; the session alone does. Returns the count then.
    pub(in crate::device) fn raise(&self) -> u32 {
        let raised = self.raised().wrapping_add(1);
        self.0.store(raised, Ordering::Release);
        raised
    }

    /// The count now.
    pub(in crate::device) fn raised(&self) -> u32 {
        self.0.load(Ordering::Acquire)
    }
}

/// Messages that found no room since boot, of whichever owner.
#[derive(Debug, Default)]
pub struct Lost(AtomicU32);

impl Lost {
    pub(super) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// How many.
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

/// A mailbox had no room; it was counted.
#[derive(Clone, Copy, Debug)]
pub struct Full;

impl PulserMail<'_> {
    /// Tells the session. It leaves room for the answer to every order that it
    /// posts, so only an event can be lost here, and only if it is late.
    pub(in crate::device) fn report(&mut self, report: Report) -> Result<(), Full> {
        self.lost.post(&mut self.reports, report)
    }

    /// Tells the session of an edge, apart from what it leaves room for.
    pub(in crate::device) fn tell_edge(&mut self, edge: Edge) -> Result<(), Full> {
        self.lost.post(&mut self.edges, edge)
    }

    /// Tells the controller of a pulse. One that is lost is missing in its
    /// muscle's model; a controller so late is caught by the watchdog.
    pub(in crate::device) fn tell_pulse(&mut self, event: ControlEvent) -> Result<(), Full> {
        if self.control_events.len() + RESERVED >= self.control_events.capacity() {
            self.lost.0.fetch_add(1, Ordering::Relaxed);
            return Err(Full);
        }
        self.notify(event)
    }

    /// Has `entry` written; one that finds no room comes again with the next window.
    pub(in crate::device) fn keep(&mut self, entry: Entry) -> Result<(), Full> {
        self.entries.enqueue(entry).map_err(|_| Full)
    }

    /// Tells the controller of what must not be lost.
    #[inline]
    pub(in crate::device) fn notify(&mut self, event: ControlEvent) -> Result<(), Full> {
        self.lost.post(&mut self.control_events, event)
    }
}

impl ControllerMail<'_> {
    /// Answers a request. The session leaves room for the answer to every one
    /// that it posts.
    pub(in crate::device) fn answer(&mut self, verdict: ControlVerdict) -> Result<(), Full> {
        (self.lost).post(&mut self.reports, ControlReport::Verdict(verdict))
    }

    /// Tells the session of what no request asked for.
    pub(in crate::device) fn tell(&mut self, at: Micros, event: Event) -> Result<(), Full> {
        let report = ControlReport::Event { at, event };
        self.lost.post(&mut self.reports, report)
    }

    /// Posts a sample, as the session will say it, if that has taken those before it.
    #[inline(never)] // its room is no part of each tick's frame
    pub(in crate::device) fn sample(&mut self, sample: Telemetry) -> Result<(), Full> {
        self.lost
            .post(&mut self.samples, Response::Telemetry(sample))
    }

    /// Orders of the pulser, which takes them four times a tick: there is room
    /// for a tick's. One that is lost is given again by the next tick.
    #[inline]
    pub(in crate::device) fn order(&mut self, order: ControlOrder) -> Result<(), Full> {
        self.lost.post(&mut self.orders, order)
    }
}

impl SessionMail<'_> {
    /// What was spent of the wearer's allowance, to be written where a reset leaves it alone
    /// by whoever runs the session: at every exit, and while stimulation goes on more often
    /// than every 250 ms.
    pub fn take_entry(&mut self) -> Option<Entry> {
        self.entries.dequeue()
    }

    /// Whether the pulser can answer one order more. Orders are looked at first:
    /// one that is answered meanwhile counts twice, none is missed.
    pub(in crate::device) fn has_room_for_order(&self) -> bool {
        self.orders.len() + self.reports.len() < self.orders.capacity()
    }

    /// Whether the controller can answer one request more.
    pub(in crate::device) fn has_room_for_request(&self) -> bool {
        let waiting = self.control_requests.len() + self.control_reports.len();
        waiting < self.control_reports.capacity() && self.control_requests.ready()
    }
}
