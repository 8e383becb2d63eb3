//! Simulates the USB host at the other end of the cable: a full-speed root port with one CDC ACM
//! driver.
//!
//! Contains attachment and reset (`port`), enumeration (`transfer`, `request`, `descriptor`), the
//! serial port, frames (`frame`) and their transactions (`schedule`), packet times (`line`). The
//! device is in `soc::otg`. In: bytes, with the cycle from which on they wait. Out: bytes, with the
//! cycle of their ACK.

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

/// A simulated USB host. Call [`Host::advance`] with the present cycle before each access to the
/// device's registers, before [`Host::send`], and at the cycle of [`Host::next_event`]. The host
/// leaves out polls to which the device can only answer NAK. It computes the next poll from the
/// state that the device's registers had until then.
#[derive(Clone, PartialEq, Debug)]
pub struct Host {
    hz: u64,
    /// Cycle up to which the host has been advanced.
    now: Cycle,
    port: Port,
    frames: Frames,
    /// Latest frame whose start, and latest frame whose end of the periodic part, the device has
    /// been informed of.
    announced: (Option<u64>, Option<u64>),
    /// Cycle before which the device is informed of no start of frame and no end of a periodic
    /// part.
    quiet_until: Cycle,
    outlook: Option<NextEvents>,
    /// Cycle from which on the bus is free.
    free: Cycle,
    flight: Option<Flight>,
    address: u8,
    device: Device,
    /// Length of the whole configuration in bytes (wTotalLength), from the configuration's header.
    total: u16,
    control: Option<Control>,
    /// Line state to set once endpoint 0 is free.
    line_state: Option<Request>,
    /// Requests of other programs: SETUP and the data towards the device.
    foreign: VecDeque<([u8; 8], Vec<u8>)>,
    /// Next request of the host itself, which waits until the requests of other programs are
    /// served.
    interrupted: Option<Request>,
    control_pipe: Pipe,
    notify: Pipe,
    data_in: Pipe,
    data_out: Pipe,
    configured: bool,
    /// Whether the device is configured and its line state set, so that data can be transferred.
    pub(crate) open: bool,
    /// Whether the OUT pipe used the bus last. If so, and both pipes are ready, IN goes first.
    out_was_last: bool,
    outgoing: VecDeque<Write>,
    incoming: VecDeque<(Cycle, Packet)>,
    delivered: Option<Cycle>,
    /// Reason why the host gave up, if it did; unplugging clears it.
    pub(crate) failure: Option<Failure>,
}

/// Bytes that a program wrote at once; they share no packet with other writes.
#[derive(Clone, PartialEq, Debug)]
struct Write {
    bytes: Vec<u8>,
    sent: usize,
    eligible: Cycle,
}

impl Host {
    /// Creates a host with an empty port; cycles are those of a clock of `hz` hertz.
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

    /// Returns whether both hosts behave the same from now on: everything except cached predictions
    /// is equal.
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        let bare = |item: &Self| {
            let mut item = item.clone();
            (item.outlook, item.quiet_until) = (None, 0);
            item
        };
        bare(self) == bare(other)
    }

    /// Changes the clock that counts cycles to `hz` hertz from cycle `at` on. A packet on the wire
    /// is not stretched, because software sets its clocks up before it uses USB.
    pub fn set_hz(&mut self, hz: u64, at: Cycle) {
        self.port.set_hz(self.hz, hz, at);
        self.frames.set_hz(hz, at);
        self.quiet_until = 0;
        self.outlook = None;
        self.hz = hz;
    }

    /// Plugs the cable in at `at`, so that VBUS comes on; does nothing if it is plugged in.
    pub fn plug(&mut self, at: Cycle, otg: &mut Otg) {
        if self.port == Port::Empty {
            otg.set_vbus(true, at);
            self.port = Port::Powered(at);
            self.outlook = None;
        }
    }

    /// Pulls the cable at `at`. Bytes on their way are lost.
    pub fn unplug(&mut self, at: Cycle, otg: &mut Otg) {
        otg.set_vbus(false, at);
        self.disconnect();
        self.port = Port::Empty;
        self.outlook = None;
        self.failure = None;
    }

    /// Opens the serial port again after [`Self::close`], as a program does: sets DTR and RTS.
    pub fn open(&mut self, at: Cycle) {
        self.request_line_state(Request::Open, at);
    }

    /// Closes the serial port as a program does: DTR and RTS go off, nothing is read or written
    /// from now on, and waiting bytes are dropped.
    pub fn close(&mut self, at: Cycle) {
        self.open = false;
        self.outlook = None;
        self.outgoing.clear();
        self.request_line_state(Request::Close, at);
    }

    /// Sends the request `setup` of another program to the device on endpoint 0 at `at`; `data` go
    /// towards the device if `setup` has a data stage in that direction. The request waits until
    /// frames run and other requests are done. The device may refuse an unknown request; if it
    /// stops answering, that is a failure until the cable is pulled.
    pub fn control(&mut self, setup: [u8; 8], data: Vec<u8>, at: Cycle) {
        self.outlook = None;
        match (&self.control, self.port, self.failure) {
            (None, Port::Running, None) => self.begin_other_request(setup, data, at),
            _ => self.foreign.push_back((setup, data)),
        }
    }

    /// Returns the number of requests of other programs that are waiting or in progress.
    pub fn pending_requests(&self) -> usize {
        let is_foreign = |control: &Control| matches!(control.request, Request::Foreign(_));
        self.foreign.len() + usize::from(self.control.as_ref().is_some_and(is_foreign))
    }

    /// Returns the reason why the host gave up, if it did.
    pub const fn failure(&self) -> Option<Failure> {
        self.failure
    }

    /// Queues `bytes` for the device, as one write of a program at `at`. The host's driver hands
    /// them to the bus with the next frame.
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

    /// Returns whether data can be transferred: the device is configured, and its line state is
    /// set.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Returns the number of bytes that wait to be sent.
    pub fn unsent_bytes(&self) -> usize {
        self.outgoing.iter().map(|w| w.bytes.len() - w.sent).sum()
    }

    /// Returns the cycle at which the device's latest ACK of sent bytes ended; `None` before the
    /// first.
    pub fn last_delivery(&self) -> Option<Cycle> {
        self.delivered
    }

    /// Takes the next packet from the device, never empty, with the cycle at which the host's ACK
    /// ended.
    pub fn received(&mut self) -> Option<(Cycle, Packet)> {
        self.incoming.pop_front()
    }

    /// Returns the description of the device from its descriptors; `None` until the device is
    /// configured.
    pub fn device(&self) -> Option<&Device> {
        self.configured.then_some(&self.device)
    }

    /// Returns the number (0–2047) of the frame at `at`; `None` while no frames are sent.
    pub fn frame(&self, at: Cycle) -> Option<u16> {
        self.are_frames_running()
            .then(|| (self.frames.index(at) & 0x7FF) as u16)
    }

    /// Returns the cycle at which the frame that contains `at` begins, while frames are sent.
    pub fn frame_start(&self, at: Cycle) -> Cycle {
        self.frames.start(self.frames.index(at))
    }
}
