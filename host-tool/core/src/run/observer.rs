//! Observers of a running session.

use super::Control;
use crate::link::{Interruption, RefusalInWords};
use crate::record::{Marker, Sample};
use firmware::link::{Event, HelloInfo, Status};

/// Something that happened during a run and that an observer is informed of. Times are in s since
/// the start of the trains.
#[derive(Clone, Copy, Debug)]
pub enum Observation<'a> {
    /// The device answered `Hello` and opened the session.
    Hello(&'a HelloInfo),
    /// The device sent a telemetry sample.
    Sample(&'a Sample),
    /// The device reported an event.
    Event(f64, &'a Event),
    /// The device refused a setpoint or a frame.
    Refused(f64, &'a RefusalInWords),
    /// The device sent its state, fault and counters. It does so after [`ObserverRequest::Status`]
    /// and at the end of the session.
    Status(&'a Status),
    /// A person used the controls. The marker is the row of `markers.csv` that records it.
    Control(&'a Marker),
    /// The completed share of the session's length, 0 to 1.
    Progress(f64),
}

/// What an observer wants the run to do next.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ObserverRequest {
    /// Continue the session.
    Nothing,
    /// Continue the session, and request the device's status.
    Status,
    /// Stop stimulation and end the session before its time.
    Stop,
}

/// Observer that is informed of everything that happens in a run, and that can end the run. A
/// closure with one argument is an observer that receives only the progress, 0 to 1.
pub trait Observer {
    /// Receives each occurrence as soon as it arrives.
    fn observe(&mut self, seen: Observation<'_>);

    /// Returns what the run should do next. The run calls this function after every message of the
    /// device and before every setpoint.
    fn next_request(&mut self) -> ObserverRequest {
        ObserverRequest::Nothing
    }

    /// Returns the next action of a person at the controls that happened by `now_us` and was not
    /// returned before; `None` if there is none. `now_us` is host time since the start of the
    /// trains, µs. The run calls this function at least every 2 ms.
    fn next_control(&mut self, _now_us: u64) -> Option<Control> {
        None
    }

    /// Returns the flag by which a signal ends the run at once, even while the run waits for the
    /// device. The run calls this function once, before it begins.
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
