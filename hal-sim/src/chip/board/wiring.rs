//! Defines the reference board for the simulator: the wiring of the pins, the crystal, and the
//! expected clock of the core (docs/hardware.md, pin map). This is the simulator's only such table.
//! It was written from that page, not from the firmware's `board::wiring`, so that a wrong pin or
//! clock in the firmware shows here.

use crate::trace::{CHANNELS, Levels, State};

/// Frequency of the board's crystal, HSE, Hz.
pub const CRYSTAL_HZ: u32 = 8_000_000;

/// Clock of the core once the image has set it up, Hz. The chip simulator derives its own clock
/// from the registers that the image writes; this constant serves for timeouts, counts and
/// conversions.
pub const CORE_HZ: u32 = 168_000_000;

/// Core cycles per microsecond of device time.
pub const CYCLES_PER_US: u64 = CORE_HZ as u64 / 1_000_000;

/// A GPIO port that the board uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// Port A: inputs, ADC, USB.
    A,
    /// Port B: lines of the tape, sync out, pump.
    B,
    /// Port C: lines of the tape, DACs.
    C,
    /// Port D: /SYNC of DAC 2.
    D,
    /// Port E, which the board does not use.
    E,
}

impl Port {
    /// Returns the number of the port: 0 for A, and so on.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// A pin: its port and its number, 0–15.
pub type Pin = (Port, u8);

/// Ports whose pins the pulse tape plays, in the order in which their pins change within a
/// microsecond.
pub const TAPE_PORTS: [Port; 2] = [Port::B, Port::C];
/// For each channel, the DAC (0 or 1) and the output of that DAC that set its amplitude.
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
/// For each bank of one or two stages, the DAC (0 or 1) and the output of that DAC that set the
/// threshold of the bank's comparators.
pub const TRIPS: [(usize, usize); 6] = [(0, 5), (0, 6), (0, 7), (1, 5), (1, 6), (1, 7)];

/// Pin of the arm key; high means that the key is closed.
pub const ARM: Pin = (Port::A, 6);
/// Pin of the over-current latch; low means that the latch has tripped.
pub const OVER_CURRENT: Pin = (Port::A, 7);
/// Pin of the hand-held stop; high means that its contact is closed.
pub const HAND_STOP: Pin = (Port::A, 8);
/// Pin of the trigger input; its rising edge is the trigger.
pub const TRIGGER: Pin = (Port::A, 15);
/// Pins of /SYNC, which selects a DAC while low: of DAC 1 (channels 1–5) and DAC 2 (channels 6–10).
pub const DAC_SYNC: [Pin; 2] = [(Port::C, 11), (Port::D, 2)];
/// Pin of the clock line to both DACs.
pub const DAC_CLOCK: Pin = (Port::C, 10);
/// Pin of the data line to both DACs.
pub const DAC_DATA: Pin = (Port::C, 12);
/// Pin of the synchronisation output, for measuring instruments.
pub const SYNC_OUT: Pin = (Port::B, 15);
/// Pin of the pump, which the pulse tape toggles every 25 µs. Without its edges, the supply of the
/// output stages goes off.
pub const PUMP: Pin = (Port::B, 10);
/// ADC channel of the joint angle, on PA0.
pub const JOINT: u8 = 0;
/// ADC channel of the current sense, on PA1.
pub const CURRENT: u8 = 1;

/// Pins of the cathodic and the anodic line of each channel.
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

/// Levels of the pins of each of [`TAPE_PORTS`]; bit n is pin n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs(pub [u16; 2]);

/// Returns the index of `port` in [`TAPE_PORTS`], if the tape plays it.
pub fn tape_port(port: Port) -> Option<usize> {
    TAPE_PORTS.iter().position(|&played| played == port)
}

impl Outputs {
    /// Returns the state of each output stage and of the synchronisation output at these pin
    /// levels.
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
