//! Computes how long packets take on the wire (USB 2.0 chapters 7 and 8), to the bit: 12 Mbit/s,
//! stuffed bits included. Times are in half bits, the finest unit of the specification.

use crate::chip::Cycle;

/// Number of half bits per second.
const HALF_BITS_PER_S: u64 = 24_000_000;

/// Turn-around time between packets of device and host, half bits: 6.5 bits, the longest that the
/// specification allows a device (7.1.18.1).
pub const TURN_AROUND: u64 = 13;
/// Time between two packets of the host, half bits: 2 bits, the shortest allowed (7.1.18.1).
pub const SAME_SOURCE: u64 = 4;
/// Time between two transactions, half bits. With this value a 64-byte bulk transaction loses about
/// the three bytes of delays that table 5-9 counts, and 19 transactions fit a frame.
pub const BETWEEN: u64 = 16;
/// Time after which the sender gives up on an answer, half bits: 18 bits (7.1.19.1).
pub const TIME_OUT: u64 = 36;
/// Length of a handshake, half bits: SYNC, PID, end of packet. ACK, NAK and STALL need no stuffing.
pub const HANDSHAKE: u64 = 2 * (8 + 8 + 3);

/// Packet identifiers (table 8-1), with their check bits.
pub mod pid {
    pub const OUT: u8 = 0xE1;
    pub const IN: u8 = 0x69;
    pub const SETUP: u8 = 0x2D;
    pub const DATA0: u8 = 0xC3;
    pub const DATA1: u8 = 0x4B;
}

/// Converts `half_bits` into cycles of a clock of `hz`.
pub fn cycles(half_bits: u64, hz: u64) -> Cycle {
    half_bits * hz / HALF_BITS_PER_S
}

/// Counter of the bits of a packet, with the zeros that are stuffed after six ones (7.1.9). The
/// last bit of SYNC is a one and counts.
struct Bits {
    count: u64,
    ones: u32,
}

impl Bits {
    fn after_sync() -> Self {
        Self { count: 8, ones: 1 }
    }

    fn push(&mut self, value: u32, bits: u32) {
        for n in 0..bits {
            self.count += 1;
            self.ones = if value >> n & 1 == 1 {
                self.ones + 1
            } else {
                0
            };
            if self.ones == 6 {
                self.count += 1;
                self.ones = 0;
            }
        }
    }

    /// Returns the length of the packet, half bits; two bits of SE0 and one of J end it.
    fn half_bits(&self) -> u64 {
        2 * (self.count + 3)
    }
}

/// Returns the length of a token packet, half bits.
pub fn token(pid: u8, address: u8, endpoint: usize) -> u64 {
    let fields = u32::from(address) | (endpoint as u32 & 0xF) << 7;
    let mut bits = Bits::after_sync();
    bits.push(u32::from(pid), 8);
    bits.push(fields, 11);
    bits.push(crc5(fields), 5);
    bits.half_bits()
}

/// Returns the length of a data packet, half bits; `data1` selects its identifier.
pub fn data(bytes: &[u8], data1: bool) -> u64 {
    let pid = if data1 { pid::DATA1 } else { pid::DATA0 };
    let mut bits = Bits::after_sync();
    bits.push(u32::from(pid), 8);
    for byte in bytes {
        bits.push(u32::from(*byte), 8);
    }
    bits.push(u32::from(crc16(bytes)), 16);
    bits.half_bits()
}

/// Length of a start of frame, half bits, without stuffed bits, so that every frame begins alike.
pub const SOF: u64 = 2 * (8 + 8 + 11 + 5 + 3);

/// Returns the longest time that a bulk or control transaction of `bytes` bytes takes, cycles
/// (5.11.3, without the host's delay). A transaction that might not end within its frame is not
/// begun.
pub fn budget(bytes: usize, hz: u64) -> Cycle {
    let stuffed = 7 * 8 * bytes as u64 / 6;
    let ns = 9_107 + 8_354 * (3 + stuffed) / 100;
    ns * hz / 1_000_000_000
}

/// Computes the CRC5 of the 11 bits of a token, in the order of transmission (8.3.5.1).
fn crc5(fields: u32) -> u32 {
    let mut crc = 0x1F;
    for n in 0..11 {
        let bit = (fields >> n ^ crc) & 1;
        crc = crc >> 1 ^ if bit == 1 { 0x14 } else { 0 };
    }
    crc ^ 0x1F
}

/// Computes the CRC16 of a data packet, in the order of transmission (8.3.5.2).
fn crc16(bytes: &[u8]) -> u16 {
    let mut crc = 0xFFFF;
    for byte in bytes {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = crc >> 1 ^ if crc & 1 == 1 { 0xA001 } else { 0 };
        }
    }
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with tokens as bus analysers show them: SETUP to address 0 is 2D 00 10, to address
    /// 1 it is 2D 01 E8. The CRC16 is an example of the USB-IF's paper, first transmitted bit
    /// lowest.
    #[test]
    fn crc_of_known_packets() {
        assert_eq!(crc5(0) << 11, 0x1000);
        assert_eq!(crc5(1) << 11, 0xE800);
        assert_eq!(crc16(&[0, 1, 2, 3]), 0x7AEF, "1111011101011110");
        // GET_DESCRIPTOR of 64 bytes ends in DD 94.
        assert_eq!(crc16(&[0x80, 6, 0, 1, 0, 0, 0x40, 0]), 0x94DD);
    }

    #[test]
    fn bits_of_packets() {
        // Address 0, endpoint 0: no run of six ones.
        assert_eq!(token(pid::IN, 0, 0), 2 * 35);
        // No data: CRC16 of nothing is 0, sent inverted: 16 zeros.
        assert_eq!(data(&[], false), 2 * (8 + 8 + 16 + 3));
        // 0xFF × 3 is 24 ones after DATA1's last zero: four stuffed zeros.
        let plain = 8 + 8 + 24 + 16 + 3;
        assert!(data(&[0xFF; 3], true) >= 2 * (plain + 4));
    }

    #[test]
    fn nineteen_bulk_packets_fit_a_frame() {
        let transaction = token(pid::OUT, 5, 1)
            + SAME_SOURCE
            + data(&[0; 64], false)
            + TURN_AROUND
            + HANDSHAKE
            + BETWEEN;
        let frame = HALF_BITS_PER_S / 1_000 - SOF - BETWEEN;
        assert_eq!(frame / transaction, 19, "table 5-9");
    }
}
