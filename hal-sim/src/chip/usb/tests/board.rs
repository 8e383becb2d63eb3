//! A host and a controller with a driver (`driver`), without the core.

use crate::chip::Cycle;
use crate::chip::board::wiring::CORE_HZ;
use crate::chip::soc::Peripheral;
use crate::chip::soc::otg::Otg;
use crate::chip::usb::Host;
use std::collections::VecDeque;

use super::driver::{CONFIGURATION, Control};

pub const HZ: u64 = CORE_HZ as u64;
pub const MS: Cycle = HZ / 1_000;
pub const US: Cycle = HZ / 1_000_000;

/// Cycles of a register access.
const ACCESS: Cycle = 6;

#[derive(Clone, Debug)]
pub struct Board {
    pub host: Host,
    pub otg: Otg,
    pub now: Cycle,
    pub(super) thread_at: Cycle,
    /// Cycles from the handler to the thread.
    pub thread_delay: Cycle,
    pub(super) setup: [u8; 8],
    pub(super) setup_ready: bool,
    pub(super) control: Control,
    /// Packets that the handler has taken and the thread has not, by endpoint.
    pub(super) taken: [Option<Vec<u8>>; 2],
    /// Number of interrupts served.
    pub interrupts: u64,
    /// Number of times that the simulator woke for an event.
    pub wakes: u64,
    /// SETUP packets received.
    pub setups: Vec<[u8; 8]>,
    /// Data of control OUT transfers.
    pub control_data: Vec<Vec<u8>>,
    /// Data of the OUT endpoint, with the cycle at which the handler took it.
    pub received: Vec<(Cycle, Vec<u8>)>,
    /// Packets to write to the IN endpoint.
    pub to_send: VecDeque<Vec<u8>>,
    /// Whether the thread leaves OUT data in the handler's buffer.
    pub deaf: bool,
    /// Whether the handler itself discards OUT data, because the endpoint was armed for many
    /// packets.
    pub greedy: bool,
    /// Request code and lower byte of wValue of a request that the device refuses.
    pub refused: Option<(u8, u8)>,
    /// Whether the thread ignores endpoint 0.
    pub mute: bool,
    /// Configuration descriptor of the device.
    pub configuration: Vec<u8>,
    pub events: Vec<&'static str>,
}

impl Board {
    /// Returns a board after power-on, with the driver initialised and the cable plugged in.
    pub fn plugged() -> Self {
        Self::plugged_at(HZ)
    }

    /// Does the same as `plugged` with another core clock.
    pub fn plugged_at(hz: u64) -> Self {
        let mut board = Self {
            host: Host::new(hz),
            otg: Otg::new(hz),
            now: 0,
            thread_at: Cycle::MAX,
            thread_delay: 2_000,
            setup: [0; 8],
            setup_ready: false,
            control: Control::Idle,
            taken: [None, None],
            interrupts: 0,
            wakes: 0,
            setups: Vec::new(),
            control_data: Vec::new(),
            received: Vec::new(),
            to_send: VecDeque::new(),
            deaf: false,
            greedy: false,
            refused: None,
            mute: false,
            configuration: CONFIGURATION.to_vec(),
            events: Vec::new(),
        };
        board.initialise();
        board.host.plug(board.now, &mut board.otg);
        board
    }

    /// Returns a board with an enumerated device and an open port.
    pub fn open() -> Self {
        let mut board = Self::plugged();
        board.run(board.now + 400 * MS);
        assert_eq!(board.host.failure, None);
        assert!(board.host.open, "open after 400 ms");
        board
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        self.now += ACCESS;
        self.host.advance(self.now, &mut self.otg);
        self.otg.read(offset, self.now).unwrap()
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        self.now += ACCESS;
        self.host.advance(self.now, &mut self.otg);
        self.otg.write(offset, value, self.now).unwrap();
    }

    pub(super) fn modify(&mut self, offset: u32, set: u32) {
        let value = self.read(offset);
        self.write(offset, value | set);
    }

    pub fn send(&mut self, bytes: &[u8]) {
        self.host.advance(self.now, &mut self.otg);
        self.host.send(bytes, self.now);
    }

    /// Schedules the thread to look for work.
    pub fn wake(&mut self) {
        self.thread_at = self.thread_at.min(self.now + self.thread_delay);
    }

    /// Simulates up to `to`.
    pub fn run(&mut self, to: Cycle) {
        loop {
            if self.otg.line {
                self.interrupt();
            }
            let next = self.host.next_event(&self.otg).min(self.otg.next_event());
            let next = next.min(self.thread_at);
            if next > to {
                break;
            }
            self.wakes += 1;
            self.now = self.now.max(next);
            self.complete();
            if self.thread_at <= self.now {
                self.thread_at = Cycle::MAX;
                self.thread();
            }
        }
        self.now = self.now.max(to);
        self.complete();
    }

    fn complete(&mut self) {
        self.otg.advance(self.now).unwrap();
        self.host.advance(self.now, &mut self.otg);
    }
}
