//! The USB host at the other end of the cable: a full-speed root port with one
//! CDC ACM driver.
//!
//! Lives here: attachment and reset (`port`), enumeration (`transfer`,
//! `request`, `descriptor`), the serial port, frames (`frame`) and the transactions in them (`schedule`),
//! packet times (`line`). Not here: the device (`soc::otg`). In: bytes with
//! the cycle from which on they wait. Out: bytes with the cycle of their ACK.

mod descriptor;
mod failure;
mod frame;
mod line;
mod port;
mod request;
mod schedule;
#[cfg(test)]
mod tests;
mod transfer;

pub use descriptor::{Device, Endpoint};
pub use failure::Failure;

use crate::chip::Cycle;
use crate::chip::soc::otg::{Otg, Packet};
use frame::Frames;
use port::{NextEvents, Port};
use request::{Control, Request};
use schedule::{Flight, Pipe};
use std::collections::VecDeque;

/// The host. Call [`Host::advance`] with the present cycle before each access
/// to the device's registers and before [`Host::send`], and at
/// [`Host::next_event`]: a poll that can only be NAKed is left out, and the
/// next one is found from the state that the registers had until then.
#[derive(Clone, PartialEq, Debug)]
pub struct Host {
    hz: u64,
    /// All before has happened.
    now: Cycle,
    port: Port,
    frames: Frames,
    /// Frame whose start, and whose end of the periodic part, was announced.
    announced: (Option<u64>, Option<u64>),
    /// Nothing is to be announced before.
    quiet_until: Cycle,
    outlook: Option<NextEvents>,
    /// The bus is free from then on.
    free: Cycle,
    flight: Option<Flight>,
    address: u8,
    device: Device,
    /// wTotalLength.
    total: u16,
    control: Option<Control>,
    /// Line state to set once endpoint 0 is free.
    line_state: Option<Request>,
    /// Requests of other programs: SETUP and the data towards the device.
    foreign: VecDeque<([u8; 8], Vec<u8>)>,
    /// Its own next request, once those are served.
    interrupted: Option<Request>,
    control_pipe: Pipe,
    notify: Pipe,
    data_in: Pipe,
    data_out: Pipe,
    configured: bool,
    /// Whether the device is configured and its line state set: bytes flow.
    pub(crate) open: bool,
    /// The OUT pipe had the bus last: IN goes first at a tie.
    out_was_last: bool,
    outgoing: VecDeque<Write>,
    incoming: VecDeque<(Cycle, Packet)>,
    delivered: Option<Cycle>,
    /// Why the host gave up, if it did; unplugging clears it.
    pub(crate) failure: Option<Failure>,
}

/// Bytes that a program wrote at once: they share no packet with others.
#[derive(Clone, PartialEq, Debug)]
struct Write {
    bytes: Vec<u8>,
    sent: usize,
    eligible: Cycle,
}

impl Host {
    /// A host with an empty port; cycles are those of a clock of `hz` hertz.
    pub fn new(hz: u64) -> Self {
        Self {
            hz,
            now: 0,
            port: Port::Empty,
            frames: Frames::new(0, hz),
            announced: (None, None),
            quiet_until: 0,
            outlook: None,
            free: 0,
            flight: None,
            address: 0,
            device: Device::default(),
            total: 0,
            control: None,
            line_state: None,
            foreign: VecDeque::new(),
            interrupted: None,
            control_pipe: Pipe::default(),
            notify: Pipe::default(),
            data_in: Pipe::default(),
            data_out: Pipe::default(),
            configured: false,
            open: false,
            out_was_last: false,
            outgoing: VecDeque::new(),
            incoming: VecDeque::new(),
            delivered: None,
            failure: None,
        }
    }

    /// Whether both do the same from now on: all but what is foreseen is equal.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        let bare = |item: &Self| {
            let mut item = item.clone();
            (item.outlook, item.quiet_until) = (None, 0);
            item
        };
        bare(self) == bare(other)
    }

    /// The clock that counts cycles is `hz` hertz from cycle `at` on. A packet
    /// on the wire is not stretched: software sets its clocks up before.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        self.port.set_hz(self.hz, hz, at);
        self.frames.set_hz(hz, at);
        self.quiet_until = 0;
        self.outlook = None;
        self.hz = hz;
    }

    /// The cable is plugged in at `at`: VBUS comes on. Nothing if it is.
    pub fn plug(&mut self, at: Cycle, otg: &mut Otg) {
        if self.port == Port::Empty {
            otg.set_vbus(true, at);
            self.port = Port::Powered(at);
            self.outlook = None;
        }
    }

    /// The cable is pulled at `at`. Bytes on their way are lost.
    pub fn unplug(&mut self, at: Cycle, otg: &mut Otg) {
        otg.set_vbus(false, at);
        self.disconnect();
        self.port = Port::Empty;
        self.outlook = None;
        self.failure = None;
    }

    /// A program opens the port again after [`Self::close`].
    pub fn open(&mut self, at: Cycle) {
        self.request_line_state(Request::Open, at);
    }

    /// The program closes the port: DTR and RTS go off, and nothing is read or
    /// written from now on; bytes that wait are dropped.
    pub fn close(&mut self, at: Cycle) {
        self.open = false;
        self.outlook = None;
        self.outgoing.clear();
        self.request_line_state(Request::Close, at);
    }

    /// Another program asks the device on endpoint 0 at `at`, whatever `setup` says; `data`
    /// go towards the device if it says that there are any. Before frames run, and while
    /// a request is under way, it waits. What the device does not know it may refuse; if it
    /// answers no more, that is a failure until the cable is pulled.
    pub fn control(&mut self, setup: [u8; 8], data: Vec<u8>, at: Cycle) {
        self.outlook = None;
        match (&self.control, self.port, self.failure) {
            (None, Port::Running, None) => self.begin_other_request(setup, data, at),
            _ => self.foreign.push_back((setup, data)),
        }
    }

    /// Requests of other programs that are not done.
    pub fn pending_requests(&self) -> usize {
        let is_foreign = |control: &Control| matches!(control.request, Request::Foreign(_));
        self.foreign.len() + usize::from(self.control.as_ref().is_some_and(is_foreign))
    }

    /// Why the host gave up, if it did.
    pub const fn failure(&self) -> Option<Failure> {
        self.failure
    }

    /// Queues `bytes` for the device, as one write of a program at `at`. The
    /// host's driver hands them to the bus with the next frame.
    pub fn send(&mut self, bytes: &[u8], at: Cycle) {
        if bytes.is_empty() {
            return;
        }
        self.outlook = None;
        self.outgoing.push_back(Write {
            bytes: bytes.to_vec(),
            sent: 0,
            eligible: self.frames.start(self.frames.index(at) + 1),
        });
    }

    /// Whether a program's bytes flow: the device is configured, its line state set.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Bytes that wait to be sent.
    pub fn unsent_bytes(&self) -> usize {
        self.outgoing.iter().map(|w| w.bytes.len() - w.sent).sum()
    }

    /// The cycle at which the device's ACK of the last packet of sent bytes
    /// ended.
    pub fn last_delivery(&self) -> Option<Cycle> {
        self.delivered
    }

    /// The next packet from the device, never empty, and the cycle at which
    /// the host's ACK ended.
    pub fn received(&mut self) -> Option<(Cycle, Packet)> {
        self.incoming.pop_front()
    }

    /// What the device says that it is, once it is configured.
    pub fn device(&self) -> Option<&Device> {
        self.configured.then_some(&self.device)
    }

    /// Number (0–2047) of the frame at `at`, while the bus runs.
    pub fn frame(&self, at: Cycle) -> Option<u16> {
        self.are_frames_running()
            .then(|| (self.frames.index(at) & 0x7FF) as u16)
    }

    /// Start of the frame that `at` lies in, while the bus runs.
    pub fn frame_start(&self, at: Cycle) -> Cycle {
        self.frames.start(self.frames.index(at))
    }
}
