//! A driver that works like the image's: `interrupt` empties the receive FIFO, `thread` serves
//! endpoint 0 and the data endpoints some time later.

use super::board::Board;
use crate::chip::Cycle;
use std::collections::VecDeque;

/// Cycles from the interrupt line to the handler.
const ENTRY: Cycle = 20;

const EPENA: u32 = 1 << 31;
const EPDIS: u32 = 1 << 30;
const SD0PID: u32 = 1 << 28;
const SNAK: u32 = 1 << 27;
const CNAK: u32 = 1 << 26;
const STALL: u32 = 1 << 21;
const USBAEP: u32 = 1 << 15;
const INT: u32 = 0b11 << 18;
const BULK: u32 = 0b10 << 18;
const IRQS: u32 = 0xC00C_3814;

pub const DEVICE: [u8; 18] = [
    18, 1, 0x10, 0x02, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x10, 0x00, 1, 2, 3, 1,
];

/// Configuration of one CDC ACM function, with its association: 70 bytes.
pub const CONFIGURATION: [u8; 70] = [
    9, 2, 70, 0, 2, 1, 0, 0x80, 50, // configuration
    8, 11, 0, 2, 2, 2, 0, 0, // association
    9, 4, 0, 0, 1, 2, 2, 0, 0, // communications interface
    5, 0x24, 0, 0x10, 0x01, // header
    4, 0x24, 2, 2, // ACM
    5, 0x24, 6, 0, 1, // union
    7, 5, 0x81, 3, 8, 0, 255, // notifications
    9, 4, 1, 0, 2, 10, 0, 0, 0, // data interface
    7, 5, 0x01, 2, 64, 0, 0, // OUT
    7, 5, 0x82, 2, 64, 0, 0, // IN
];

/// State of endpoint 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Control {
    Idle,
    /// Packets still to be written; the status stage follows the last one.
    Writing(VecDeque<Vec<u8>>),
    AwaitStatus,
    AwaitData,
}

impl Board {
    pub(super) fn initialise(&mut self) {
        self.write(0x00C, 1 << 30 | 1 << 6);
        assert_eq!(self.read(0x014) & 1, 0, "device mode");
        self.modify(0x038, 1 << 16);
        self.modify(0x038, 1 << 19);
        self.write(0x804, 0b10);
        self.write(0x800, 0b11);
        self.write(0x810, 1);
        self.write(0x814, 1 << 3);
        self.write(0x018, IRQS);
        self.write(0x014, u32::MAX);
        self.write(0x008, 1);
        self.write(0x804, 0);
    }

    pub(super) fn interrupt(&mut self) {
        self.interrupts += 1;
        self.now += ENTRY;
        let status = self.read(0x014);
        if status & 0xC000_3804 != 0 {
            self.write(0x018, 1 << 18 | 1 << 19 | 1 << 4);
        }
        while self.read(0x014) & 1 << 4 != 0 {
            self.pop_entry();
        }
        if status & 1 << 18 != 0 {
            self.clear_endpoints(0x900, 0);
        }
        if status & 1 << 19 != 0 {
            self.clear_endpoints(0xB00, 16);
        }
        self.wake();
    }

    fn clear_endpoints(&mut self, base: u32, shift: u32) {
        let which = self.read(0x818) >> shift & 0xFFFF;
        for n in (0..4).filter(|n| which >> n & 1 == 1) {
            let bits = self.read(base + n * 0x20 + 8);
            self.write(base + n * 0x20 + 8, bits);
            if base == 0xB00 && bits & 1 << 3 != 0 {
                self.setup_ready = true;
            }
        }
    }

    fn pop_entry(&mut self) {
        let word = self.read(0x020);
        let endpoint = (word & 0xF) as usize;
        let length = (word >> 4 & 0x7FF) as usize;
        match word >> 17 & 0xF {
            6 => {
                if self.read(0x910) >> 19 & 0b11 != 0 {
                    self.flush(0);
                }
                let [a, b] = [self.read(0x1000), self.read(0x1000)].map(u32::to_le_bytes);
                self.setup = [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]];
                self.setups.push(self.setup);
            }
            2 => {
                let mut bytes = Vec::new();
                for _ in 0..length.div_ceil(4) {
                    bytes.extend_from_slice(&self.read(0x1000).to_le_bytes());
                }
                bytes.truncate(length);
                assert_eq!(self.taken[endpoint], None, "the buffer was free");
                if endpoint == 1 {
                    self.received.push((self.now, bytes.clone()));
                }
                if !self.greedy {
                    self.taken[endpoint] = Some(bytes);
                }
            }
            _ => {}
        }
    }

    fn flush(&mut self, number: u32) {
        self.write(0x010, number << 6 | 1 << 5);
        while self.read(0x010) & 1 << 5 != 0 {}
    }

    pub(super) fn thread(&mut self) {
        self.bus_events();
        self.serve_control();
        if self.setup_ready && self.control == Control::Idle && !self.mute {
            self.setup_ready = false;
            self.modify(0xB10, 0b11 << 29);
            self.modify(0xB00, CNAK);
            self.request();
            self.serve_control();
        }
        if !self.deaf && self.taken[1].is_some() {
            self.taken[1] = None;
            self.rearm(1);
        }
        while self.read(0x940) & (EPENA | USBAEP) == USBAEP {
            let Some(packet) = self.to_send.pop_front() else {
                break;
            };
            self.write_packet(2, &packet);
        }
    }

    fn rearm(&mut self, n: u32) {
        self.modify(0xB10 + n * 0x20, 1 << 19 | 64);
        self.modify(0xB00 + n * 0x20, CNAK);
    }

    fn bus_events(&mut self) {
        let status = self.read(0x014);
        let clear = |board: &mut Self, bit: u32, name| {
            board.write(0x014, bit);
            board.write(0x018, IRQS);
            board.events.push(name);
        };
        if status & 1 << 30 != 0 {
            clear(self, 1 << 30, "power");
        }
        if status & 1 << 2 != 0 {
            let bits = self.read(0x004);
            self.write(0x004, bits);
            clear(self, 0, "no power");
            self.disable_all();
        }
        if status & 1 << 12 != 0 {
            self.bus_reset();
            clear(self, 1 << 12, "reset");
        }
        if status & 1 << 13 != 0 {
            assert_eq!(self.read(0x808) >> 1 & 0b11, 0b11, "full speed");
            self.modify(0x00C, 6 << 10);
            clear(self, 1 << 13, "speed");
            self.control = Control::Idle;
        }
        if status & 1 << 11 != 0 {
            clear(self, 1 << 11, "suspend");
        }
    }

    fn bus_reset(&mut self) {
        self.write(0x024, 62);
        self.write(0x028, 16 << 16 | 62);
        self.write(0x104, 16 << 16 | 78);
        self.write(0x108, 16 << 16 | 94);
        self.write(0x010, 1 << 4 | 1 << 5 | 0x10 << 6);
        while self.read(0x010) & 0x30 != 0 {}
        self.write(0x900, 0);
        self.write(0x920, 8 | INT | SD0PID | 1 << 22 | SNAK);
        self.write(0x940, 64 | BULK | SD0PID | 2 << 22 | SNAK);
        self.write(0xB00, 0);
        self.modify(0xB10, 64 | 0b11 << 29);
        self.write(0xB20, 64 | BULK | SD0PID);
        self.modify(0xB30, 64 | 1 << 19);
        self.modify(0x81C, 0b111 | 0b11 << 16);
        let dcfg = self.read(0x800);
        self.write(0x800, dcfg & !(0x7F << 4));
    }

    fn disable_all(&mut self) {
        for base in [0x900, 0x920, 0x940, 0xB00, 0xB20] {
            if self.read(base) & EPENA != 0 {
                self.modify(base, SNAK | EPDIS);
            }
            let control = self.read(base);
            self.write(base, control & !USBAEP);
        }
        (0..4).for_each(|n| self.flush(n));
        self.taken = [None, None];
        self.to_send.clear();
    }

    fn enable_all(&mut self) {
        for base in [0x920, 0x940] {
            self.modify(base, USBAEP | SNAK);
        }
        self.modify(0xB20, USBAEP);
        self.modify(0xB30, 64 | 1 << 19);
        self.modify(0xB20, CNAK | EPENA);
    }

    fn write_packet(&mut self, n: u32, bytes: &[u8]) {
        self.write(0x910 + n * 0x20, 1 << 29 | 1 << 19 | bytes.len() as u32);
        self.modify(0x900 + n * 0x20, CNAK | EPENA);
        for chunk in bytes.chunks(4) {
            let mut word = [0; 4];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write(0x1000 * (n + 1), u32::from_le_bytes(word));
        }
    }

    fn request(&mut self) {
        let [_, code, low, high, .., l0, l1] = self.setup;
        let length = usize::from(u16::from_le_bytes([l0, l1]));
        if self.refused == Some((code, low)) {
            self.modify(0x900, STALL);
            self.modify(0xB00, STALL);
            return;
        }
        match (code, high) {
            (6, kind) => {
                let bytes = match (kind, low) {
                    (1, _) => DEVICE.to_vec(),
                    (2, _) => self.configuration.clone(),
                    (_, 1) => string("Flexor"),
                    (_, 2) => string("Flexor stimulator"),
                    (_, _) => string("00112233445566778899AABB"),
                };
                let part = &bytes[..bytes.len().min(length)];
                let mut packets: VecDeque<_> = part.chunks(64).map(<[u8]>::to_vec).collect();
                if part.len() < length && part.len() % 64 == 0 {
                    packets.push_back(Vec::new());
                }
                self.control = Control::Writing(packets);
            }
            (5, _) => {
                let dcfg = self.read(0x800);
                self.write(0x800, dcfg | u32::from(low) << 4);
                self.write_packet(0, &[]);
            }
            (0x20, _) => self.control = Control::AwaitData,
            (9, _) => {
                self.enable_all();
                self.write_packet(0, &[]);
            }
            _ => self.write_packet(0, &[]),
        }
    }

    fn serve_control(&mut self) {
        match &mut self.control {
            Control::Idle => {}
            Control::Writing(_) => {
                if self.read(0x900) & EPENA != 0 {
                    return;
                }
                let Control::Writing(packets) = &mut self.control else {
                    return;
                };
                match packets.pop_front() {
                    Some(packet) => self.write_packet(0, &packet),
                    None => self.control = Control::AwaitStatus,
                }
                self.wake();
            }
            Control::AwaitStatus => {
                if self.taken[0].take().is_some() {
                    self.control = Control::Idle;
                    self.rearm(0);
                }
            }
            Control::AwaitData => {
                if let Some(bytes) = self.taken[0].take() {
                    self.control_data.push(bytes);
                    self.control = Control::Idle;
                    self.rearm(0);
                    self.write_packet(0, &[]);
                }
            }
        }
    }
}

fn string(text: &str) -> Vec<u8> {
    let mut bytes = vec![0, 3];
    bytes.extend(text.encode_utf16().flat_map(u16::to_le_bytes));
    bytes[0] = bytes.len() as u8;
    bytes
}
