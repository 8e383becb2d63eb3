//! Boards for the simulator: the wiring of the pins, the crystal, and the expected clock of the core.
//! The reference board was written from docs/reference/hardware.md, pin map, and the boards that one can buy
//! from their makers' schematics, not from the firmware's `board::wiring`, so that a wrong pin or
//! clock in the firmware shows here.

use crate::trace::{CHANNELS, Levels, State};

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

/// Pins of /SYNC, which selects a DAC while low: of DAC 1 (channels 1–5) and DAC 2 (channels 6–10).
pub const DAC_SYNC: [Pin; 2] = [(Port::C, 11), (Port::D, 2)];
/// Pin of the clock line to both DACs.
pub const DAC_CLOCK: Pin = (Port::C, 10);
/// Pin of the data line to both DACs.
pub const DAC_DATA: Pin = (Port::C, 12);
/// Pin of the synchronisation output, for measuring instruments.
pub const SYNC_OUT: Pin = (Port::B, 15);
/// Pin of the pump, which the pulse tape of the reference board toggles every 25 µs. Without its
/// edges, the supply of the output stages goes off. On a breadboard the pin stays an input.
pub const PUMP: Pin = (Port::B, 10);
/// Pins of the cathodic and the anodic line of a channel.
pub type Lines = (Pin, Pin);

/// Connection of PA9, at which the chip senses VBUS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vbus {
    /// PA9 is connected to VBUS.
    Sensed,
    /// PA9 is not connected.
    Open,
    /// PA9 is connected to 3.3 V.
    High,
}

/// A board as its schematic has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wiring {
    /// Name by which `--board` selects the board.
    pub name: &'static str,
    /// Nominal frequency of the crystal, HSE, Hz.
    pub crystal_hz: u32,
    /// Lines of each channel, from channel 1 on; `None` for a channel whose pins the board does not
    /// bring out.
    pub lines: [Option<Lines>; CHANNELS],
    /// Pin of the arm key; high means that the key is closed.
    pub arm: Pin,
    /// Pin of the over-current latch; low means that the latch has tripped.
    pub over_current: Pin,
    /// Pin of the hand-held stop; high means that its contact is closed.
    pub hand_stop: Pin,
    /// Pin of the trigger input; its rising edge is the trigger.
    pub trigger: Pin,
    /// ADC channel of the joint angle.
    pub joint: u8,
    /// ADC channel of the current sense; `None` without output stages.
    pub current: Option<u8>,
    /// Connection of PA9.
    pub vbus: Vbus,
    /// Pin that a wire connects to 3.3 V; `None` on the reference board.
    pub strap: Option<Pin>,
    /// Pin of the light-emitting diode, which a high level lights; `None` without one.
    pub led: Option<Pin>,
}

impl Wiring {
    /// Returns whether the board is a breadboard, without output stages.
    #[must_use]
    pub const fn is_breadboard(&self) -> bool {
        self.strap.is_some()
    }
}

/// The reference board (docs/reference/hardware.md).
pub const REFERENCE: Wiring = Wiring {
    name: "reference",
    crystal_hz: 8_000_000,
    lines: [
        Some(((Port::C, 0), (Port::C, 1))),
        Some(((Port::C, 2), (Port::C, 3))),
        Some(((Port::C, 4), (Port::C, 5))),
        Some(((Port::C, 6), (Port::C, 7))),
        Some(((Port::C, 8), (Port::C, 9))),
        Some(((Port::B, 0), (Port::B, 1))),
        Some(((Port::B, 5), (Port::B, 6))),
        Some(((Port::B, 7), (Port::B, 8))),
        Some(((Port::B, 9), (Port::B, 12))),
        Some(((Port::B, 13), (Port::B, 14))),
    ],
    arm: (Port::A, 6),
    over_current: (Port::A, 7),
    hand_stop: (Port::A, 8),
    trigger: (Port::A, 15),
    joint: 0,         // PA0
    current: Some(1), // PA1
    vbus: Vbus::Sensed,
    strap: None,
    led: None,
};

/// WeAct Studio's 64-pin core board, schematic V1.1: a crystal of 8 MHz, the diode at PB2, PA9 on a
/// header only, every other pin that Flexor uses on headers.
pub const WEACT: Wiring = Wiring {
    name: "weact",
    current: None,
    vbus: Vbus::Open,
    strap: Some((Port::A, 4)),
    led: Some((Port::B, 2)),
    ..REFERENCE
};

/// Adafruit's Feather STM32F405 Express, product 4382: a crystal of 12 MHz, the diode at PC1, PA9 at
/// 3.3 V. On headers: PA4 to PA7, PB6 to PB11, PB13 to PB15, PC1 to PC7.
pub const FEATHER: Wiring = Wiring {
    name: "feather",
    crystal_hz: 12_000_000,
    lines: [
        None,
        Some(((Port::C, 2), (Port::C, 3))),
        Some(((Port::C, 4), (Port::C, 5))),
        Some(((Port::C, 6), (Port::C, 7))),
        None,
        None,
        None,
        Some(((Port::B, 7), (Port::B, 8))),
        None,
        Some(((Port::B, 13), (Port::B, 14))),
    ],
    arm: (Port::A, 4),
    hand_stop: (Port::A, 6),
    trigger: (Port::A, 5),
    joint: 3, // PA3, half of the battery's voltage
    current: None,
    vbus: Vbus::High,
    strap: Some((Port::B, 9)),
    led: Some((Port::C, 1)),
    ..REFERENCE
};

/// Every board, the reference board first.
pub const BOARDS: [Wiring; 3] = [REFERENCE, WEACT, FEATHER];

/// Levels of the pins of each of [`TAPE_PORTS`]; bit n is pin n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs(pub [u16; 2]);

/// Returns the index of `port` in [`TAPE_PORTS`], if the tape plays it.
pub fn tape_port(port: Port) -> Option<usize> {
    TAPE_PORTS.iter().position(|&played| played == port)
}

impl Outputs {
    /// Returns the state of each channel of `board` and of the synchronisation output at these pin
    /// levels.
    pub fn levels(self, board: &Wiring) -> Levels {
        let high = |(port, pin): Pin| {
            let levels = tape_port(port).map_or(0, |n| self.0[n]);
            levels >> pin & 1 == 1
        };
        let mut levels = Levels::ISOLATED.with_sync(high(SYNC_OUT));
        for (channel, lines) in (0u8..).zip(board.lines) {
            let Some((cathodic, anodic)) = lines else {
                continue;
            };
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
        for board in &BOARDS {
            assert_eq!(Outputs::default().levels(board), Levels::ISOLATED);
            for (channel, lines) in (0u8..).zip(board.lines) {
                let Some((cathodic, anodic)) = lines else {
                    continue;
                };
                for (pin, state) in [(cathodic, State::Cathodic), (anodic, State::Anodic)] {
                    let mut outputs = Outputs::default();
                    outputs.0[tape_port(pin.0).unwrap()] = 1 << pin.1;
                    assert_eq!(
                        outputs.levels(board),
                        Levels::ISOLATED.with_channel(channel, state)
                    );
                }
            }
        }
    }

    #[test]
    fn no_pin_is_wired_twice() {
        for board in &BOARDS {
            let lines = board.lines.iter().flatten();
            let mut pins: Vec<_> = lines.flat_map(|&(c, a)| [c, a]).collect();
            pins.extend([board.arm, board.over_current, board.hand_stop]);
            pins.extend([board.trigger, SYNC_OUT, PUMP, DAC_CLOCK, DAC_DATA]);
            pins.extend(DAC_SYNC);
            pins.extend(board.strap.into_iter().chain(board.led));
            let count = pins.len();
            pins.sort_by_key(|(port, pin)| (port.index(), *pin));
            pins.dedup();
            assert_eq!(pins.len(), count, "{}", board.name);
        }
    }
}
