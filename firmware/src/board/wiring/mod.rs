//! Wiring of a board, as data: which pin, clock, DMA stream, DAC output and output stage is
//! connected to what. Each board has one file; [`BOARD`] is the board of this build.
//!
//! This module builds on every target, because other layers depend on it too: for the words of the
//! tape and the scale of the current sense. It is therefore the lowest layer, although the rest of
//! `board` is the highest. [`check`] refuses impossible boards at compile time. docs/guides/porting.md
//! explains how to add a board. Registers and anything that runs do not belong here.
#![forbid(unsafe_code)]

mod check;
mod clocks;
mod feather_f405;
mod flexor_f405;
mod modes;
mod outputs;
mod pins;
mod weact_f405;

pub use clocks::Clocks;
pub use feather_f405::FEATHER_F405;
pub use flexor_f405::FLEXOR_F405;
pub use modes::Bits;
pub use outputs::{DacOutput, Dacs, Lines, Outputs, PinMap, Pump, Stages, TapeStreams};
pub use pins::{Alternate, Analogue, Inputs, Pin, Port};
pub use weact_f405::WEACT_F405;

/// Every board, the reference board first.
pub const BOARDS: [Wiring; 3] = [FLEXOR_F405, WEACT_F405, FEATHER_F405];

/// Board of this build.
#[cfg(not(feature = "breadboard"))]
pub const BOARD: Wiring = FLEXOR_F405;
/// Board of this build.
#[cfg(feature = "weact")]
pub const BOARD: Wiring = WEACT_F405;
/// Board of this build.
#[cfg(all(feature = "feather", not(feature = "weact")))]
pub const BOARD: Wiring = FEATHER_F405;

/// Number of stimulation channels. The protocol has ten, so every board has ten.
pub const CHANNELS: usize = 10;

/// Number of banks. A bank is one or two output stages that share a level of their comparators.
pub const BANKS: usize = 6;

/// Number of ports that the tape plays: all lines of the channels, sync out and the pump are on
/// them. Each port takes two requests of TIM1 per microsecond, and two streams of DMA2.
pub const TAPE_PORTS: usize = 2;

/// Complete wiring of a board.
#[derive(Clone, Copy, Debug)]
pub struct Wiring {
    /// Name of the board, which `Hello` reports; at most 16 ASCII characters.
    pub name: &'static str,
    /// Name of the product that USB reports; a string descriptor has at most 31 characters here.
    pub product: &'static str,
    /// What a breadboard has in place of output stages; `None` for a board with output stages.
    pub breadboard: Option<Breadboard>,
    /// Whether PA9 senses VBUS. Otherwise the board is powered by USB, or announces itself to the
    /// host without waiting for VBUS.
    pub senses_vbus: bool,
    /// Crystal and PLL.
    pub clocks: Clocks,
    /// Lines that the tape plays.
    pub outputs: Outputs,
    /// DMA streams that play and erase the tape.
    pub streams: TapeStreams,
    /// Lines that people, comparators and sensors drive.
    pub inputs: Inputs,
    /// The two DACs on SPI3.
    pub dacs: Dacs,
    /// Scales and timing of the output stages, as seen from DAC and ADC.
    pub stages: Stages,
}

/// Parts of a breadboard: a bought board for light-emitting diodes and a logic analyser, whose image
/// simulates the output stages (docs/guides/breadboard.md).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Breadboard {
    /// Input that a wire connects to 3.3 V. The reference board pulls the same pin of the chip low,
    /// so the image does not run there.
    pub strap: Pin,
    /// Light-emitting diode of the board.
    pub led: Led,
}

/// Light-emitting diode that blinks codes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Led {
    /// Pin that drives it.
    pub pin: Pin,
    /// Whether the high level lights it.
    pub is_active_high: bool,
}

/// Length of the longest name of a board, bytes.
pub const BOARD_NAME: usize = 16;

/// Output lines of [`BOARD`], for code that is generic over [`PinMap`].
#[derive(Clone, Copy, Debug)]
pub struct BoardPins;

impl PinMap for BoardPins {
    const OUTPUTS: Outputs = BOARD.outputs;
}

const _: () = {
    let mut n = 0;
    while n < BOARDS.len() {
        check::check(&BOARDS[n]);
        let mut other = 0;
        while other < BOARDS.len() {
            if other != n {
                check::check_pair(&BOARDS[n], &BOARDS[other]);
            }
            other += 1;
        }
        n += 1;
    }
};
