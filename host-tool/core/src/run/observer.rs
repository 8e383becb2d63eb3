//! Who looks at a session while it runs.

use super::Control;
use crate::link::{Interruption, Refused};
use crate::record::{Marker, Sample};
use firmware::link::{Event, HelloInfo, Status};

/// What an observer sees. Times count from the start of the trains, in s.
#[derive(Clone, Copy, Debug)]
pub enum Seen<'a> {
    /// The device opened the session.
    Hello(&'a HelloInfo),
    /// A telemetry sample.
    Sample(&'a Sample),
    /// The device reported an event.
    Event(f64, &'a Event),
    /// The device refused a setpoint or a frame.
    Refused(f64, &'a Refused),
    /// State, fault and counters: as wished, and at the end.
    Status(&'a Status),
    /// Something was done at the controls: the row that is recorded.
    Control(&'a Marker),
    /// The part done, 0 to 1.
    Progress(f64),
}

/// What an observer wants of the run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wish {
    /// Go on.
    Nothing,
    /// Go on and ask the device for its status.
    Status,
    /// Stop stimulating.
    Stop,
}

/// Sees a session run and may end it. A closure is an observer of progress.
pub trait Observer {
    /// Something arrived.
    fn see(&mut self, seen: Seen<'_>);

    /// Asked after everything that arrives and before every setpoint.
    fn wish(&mut self) -> Wish {
        Wish::Nothing
    }

    /// What a person at the controls did by `now_us`, host time since the start of the
    /// trains, if it was not asked for yet. Asked every 2 ms at least.
    fn control(&mut self, _now_us: u64) -> Option<Control> {
        None
    }

    /// What ends the run at once, whatever it waits for; asked before it begins.
    fn interruption(&self) -> Option<Interruption> {
        None
    }
}

impl<F: FnMut(f64)> Observer for F {
    fn see(&mut self, seen: Seen<'_>) {
        if let Seen::Progress(part) = seen {
            self(part);
        }
    }
}
