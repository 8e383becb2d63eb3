//! The reference board as the simulator has it: which pin is wired to what, the crystal, and
//! the clock that the core is to have (docs/hardware.md, pin map). The simulator's only table
//! of this. Written from that page, not from the firmware's (`board::wiring` there), so that a
//! wrong pin or clock there shows here.

use crate::trace::{CHANNELS, Levels, State};

/// The crystal, Hz.
pub const CRYSTAL_HZ: u32 = 8_000_000;

/// The core's clock once the image has set it up, Hz. What the chip simulator counts by comes
/// from the registers that the image writes; this is for who waits, counts and divides.
pub const CORE_HZ: u32 = 168_000_000;

/// Core cycles per microsecond of device time.
pub const CYCLES_PER_US: u64 = CORE_HZ as u64 / 1_000_000;

/// A GPIO port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// Port A.
    A,
    /// Port B.
    B,
    /// Port C.
    C,
    /// Port D.
    D,
    /// Port E.
    E,
}

impl Port {
    /// 0 for A, and so on.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// A pin.
pub type Pin = (Port, u8);

/// The ports whose pins the tape plays, in the order in which they move.
pub const TAPE_PORTS: [Port; 2] = [Port::B, Port::C];
/// The DAC, and its output, that sets each channel's amplitude.
pub const AMPLITUDES: [(usize, usize); CHANNELS] = [
    (0, 0),
    (0, 1),
    (0, 2),
    (0, 3),
    (0, 4),
    (1, 0),
    (1, 1),
    (1, 2),
    (1, 3),
    (1, 4),
];
/// The DAC, and its output, that sets the level of each bank's comparators.
pub const TRIPS: [(usize, usize); 6] = [(0, 5), (0, 6), (0, 7), (1, 5), (1, 6), (1, 7)];

/// Arm key: high is closed.
pub const ARM: Pin = (Port::A, 6);
/// Over-current latch: low is tripped.
pub const OVER_CURRENT: Pin = (Port::A, 7);
/// Hand-held stop: high is closed.
pub const HAND_STOP: Pin = (Port::A, 8);
/// Trigger in, rising edge.
pub const TRIGGER: Pin = (Port::A, 15);
/// /SYNC of DAC 1 (channels 1–5) and DAC 2 (6–10).
pub const DAC_SYNC: [Pin; 2] = [(Port::C, 11), (Port::D, 2)];
/// Clock and data of both DACs.
pub const DAC_CLOCK: Pin = (Port::C, 10);
/// See [`DAC_CLOCK`].
pub const DAC_DATA: Pin = (Port::C, 12);
/// Sync out.
pub const SYNC_OUT: Pin = (Port::B, 15);
/// Pump.
pub const PUMP: Pin = (Port::B, 10);
/// ADC channel of the joint angle, on PA0.
pub const JOINT: u8 = 0;
/// ADC channel of the current sense, on PA1.
pub const CURRENT: u8 = 1;

/// Cathodic and anodic line of each channel.
pub const LINES: [(Pin, Pin); CHANNELS] = [
    ((Port::C, 0), (Port::C, 1)),
    ((Port::C, 2), (Port::C, 3)),
    ((Port::C, 4), (Port::C, 5)),
    ((Port::C, 6), (Port::C, 7)),
    ((Port::C, 8), (Port::C, 9)),
    ((Port::B, 0), (Port::B, 1)),
    ((Port::B, 5), (Port::B, 6)),
    ((Port::B, 7), (Port::B, 8)),
    ((Port::B, 9), (Port::B, 12)),
    ((Port::B, 13), (Port::B, 14)),
];

/// Output levels of each of [`TAPE_PORTS`], bit n is pin n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs(pub [u16; 2]);

/// Which of [`TAPE_PORTS`] is `port`.
pub fn tape_port(port: Port) -> Option<usize> {
    TAPE_PORTS.iter().position(|&played| played == port)
}

impl Outputs {
    /// What the output stages do with these levels.
    pub fn levels(self) -> Levels {
        let high = |(port, pin): Pin| {
            let levels = tape_port(port).map_or(0, |n| self.0[n]);
            levels >> pin & 1 == 1
        };
        let mut levels = Levels::ISOLATED.with_sync(high(SYNC_OUT));
        for (channel, (cathodic, anodic)) in (0u8..).zip(LINES) {
            let state = match (high(cathodic), high(anodic)) {
                (false, false) => State::Isolated,
                (true, false) => State::Cathodic,
                (false, true) => State::Anodic,
                (true, true) => State::Grounded,
            };
            levels = levels.with_channel(channel, state);
        }
        levels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_moves_its_own_channel_only() {
        assert_eq!(Outputs::default().levels(), Levels::ISOLATED);
        for (channel, (cathodic, anodic)) in (0u8..).zip(LINES) {
            for (pin, state) in [(cathodic, State::Cathodic), (anodic, State::Anodic)] {
                let mut outputs = Outputs::default();
                outputs.0[tape_port(pin.0).unwrap()] = 1 << pin.1;
                assert_eq!(
                    outputs.levels(),
                    Levels::ISOLATED.with_channel(channel, state)
                );
            }
        }
    }

    #[test]
    fn no_pin_is_wired_twice() {
        let mut pins: Vec<_> = LINES.iter().flat_map(|&(c, a)| [c, a]).collect();
        pins.extend([ARM, OVER_CURRENT, HAND_STOP, TRIGGER, SYNC_OUT, PUMP]);
        pins.extend(DAC_SYNC);
        let count = pins.len();
        pins.sort_by_key(|(port, pin)| (port.index(), *pin));
        pins.dedup();
        assert_eq!(pins.len(), count);
    }
}
