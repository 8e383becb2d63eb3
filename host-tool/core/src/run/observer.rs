//! Observers of a running session.

use super::Control;
use crate::link::{Interruption, RefusalInWords};
use crate::record::{Marker, Sample};
use firmware::link::{Event, HelloInfo, Status};

/// Occurrence that an observer is shown. Times count from the start of the trains, in s.
#[derive(Clone, Copy, Debug)]
pub enum Observation<'a> {
    /// The device opened the session.
    Hello(&'a HelloInfo),
    /// A telemetry sample.
    Sample(&'a Sample),
    /// The device reported an event.
    Event(f64, &'a Event),
    /// The device refused a setpoint or a frame.
    Refused(f64, &'a RefusalInWords),
    /// The device's state, fault and counters: after [`ObserverRequest::Status`], and at the end.
    Status(&'a Status),
    /// A person used the controls; the marker is the row that is recorded.
    Control(&'a Marker),
    /// The completed part of the session, 0 to 1.
    Progress(f64),
}

/// Wish of an observer about the rest of the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ObserverRequest {
    /// Continue.
    Nothing,
    /// Continue, and ask the device for its status.
    Status,
    /// Stop stimulation and end the session.
    Stop,
}

/// Observer that sees a session run and may end it. A closure is an observer of the progress, 0 to
/// 1.
pub trait Observer {
    /// Receives each occurrence as soon as it arrives.
    fn observe(&mut self, seen: Observation<'_>);

    /// Returns the observer's wish. It is called after every message that arrives and before every
    /// setpoint.
    fn next_request(&mut self) -> ObserverRequest {
        ObserverRequest::Nothing
    }

    /// Returns the next action of a person at the controls that happened by `now_us` and was not
    /// returned before; `None` if there is none. `now_us` is host time since the start of the
    /// trains, µs. It is called at least every 2 ms.
    fn next_control(&mut self, _now_us: u64) -> Option<Control> {
        None
    }

    /// Returns the interruption that can end the run at once, whatever the run waits for. It is
    /// called once, before the run begins.
    fn interruption(&self) -> Option<Interruption> {
        None
    }
}

impl<F: FnMut(f64)> Observer for F {
    fn observe(&mut self, seen: Observation<'_>) {
        if let Observation::Progress(part) = seen {
            self(part);
        }
    }
}
