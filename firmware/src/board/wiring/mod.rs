//! How a board is wired, as data: which pin, clock, DMA stream, DAC output and output stage
//! is connected to what. One file per board; [`BOARD`] is the board of this build.
//!
//! Builds on every target, because more than the registers depends on it: the words of the
//! tape, the scale of the current sense. It is therefore the lowest layer, although the rest
//! of `board` is the highest. What no board may do is refused at compile time ([`check`]).
//! docs/porting.md says how to add a board. Not here: registers, and anything that runs.
#![forbid(unsafe_code)]

mod check;
mod clocks;
mod flexor_f405;
mod modes;
mod outputs;
mod pins;

pub use clocks::Clocks;
pub use flexor_f405::FLEXOR_F405;
pub use modes::Bits;
pub use outputs::{DacOutput, Dacs, Lines, Outputs, PinMap, Stages, TapeStreams};
pub use pins::{Alternate, Analogue, Inputs, Pin, Port};

/// The board of this build.
pub const BOARD: Wiring = FLEXOR_F405;

/// Stimulation channels. The protocol has ten, so every board has.
pub const CHANNELS: usize = 10;

/// Banks of one or two output stages, each with a level of its comparators.
pub const BANKS: usize = 6;

/// Ports that the tape plays: all lines of the channels, sync out and the pump are on them.
/// Each port takes two requests of TIM1 a microsecond, and two streams of DMA2.
pub const TAPE_PORTS: usize = 2;

/// All wiring of a board.
#[derive(Clone, Copy, Debug)]
pub struct Wiring {
    /// Crystal and PLL.
    pub clocks: Clocks,
    /// Lines that the tape plays.
    pub outputs: Outputs,
    /// DMA streams that play and erase the tape.
    pub streams: TapeStreams,
    /// Lines that people, comparators and sensors drive.
    pub inputs: Inputs,
    /// The two DACs.
    pub dacs: Dacs,
    /// What the output stages do with DAC codes and report to the ADC.
    pub stages: Stages,
}

/// The output lines of [`BOARD`].
#[derive(Clone, Copy, Debug)]
pub struct BoardPins;

impl PinMap for BoardPins {
    const OUTPUTS: Outputs = BOARD.outputs;
}

const _: () = check::check(&BOARD);
