//! Output lines, the DMA streams that move them, the DACs and the output stages.

use super::pins::{Alternate, Pin, Port};
use super::{BANKS, CHANNELS, TAPE_PORTS};

/// Source of a board's output lines, for generic code without run-time cost: everything that
/// follows from them is computed at compile time.
pub trait PinMap {
    /// Output lines of the board.
    const OUTPUTS: Outputs;
}

/// The two lines of a channel's output stage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Lines {
    /// Line whose high level drives the cathodic direction.
    pub cathodic: Pin,
    /// Line whose high level drives the anodic direction.
    pub anodic: Pin,
}

impl Lines {
    /// Returns the lines with these pin numbers of `port`.
    #[must_use]
    pub const fn new(port: Port, cathodic: u8, anodic: u8) -> Self {
        Self {
            cathodic: Pin::new(port, cathodic),
            anodic: Pin::new(port, anodic),
        }
    }
}

/// Lines that the tape plays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outputs {
    /// Ports of all these lines, in the order in which they move: the second moves 48 ns after the
    /// first. Both lines of a channel are on the same port.
    pub ports: [Port; TAPE_PORTS],
    /// Lines of each channel, from channel 1 on; `None` for a channel that the board lacks.
    pub channels: [Option<Lines>; CHANNELS],
    /// Output for synchronising other instruments, "sync out".
    pub sync: Pin,
    /// Line of the pump that supplies the output stages.
    pub pump: Pump,
}

/// Use of the pump's pin.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pump {
    /// The tape drives the pin.
    Driven(Pin),
    /// The board has no output stages to supply. The pin stays an input, and its configuration is
    /// locked.
    Input(Pin),
}

impl Pump {
    /// Returns the pin, whatever its use.
    #[must_use]
    pub const fn pin(self) -> Pin {
        match self {
            Self::Driven(pin) | Self::Input(pin) => pin,
        }
    }

    /// Returns whether the tape drives the pin.
    #[must_use]
    pub const fn is_driven(self) -> bool {
        matches!(self, Self::Driven(_))
    }
}

/// Streams of DMA2 with which TIM1 moves the tape (RM0090 table 43).
#[derive(Clone, Copy, Debug)]
pub struct TapeStreams {
    /// Streams that play each of [`Outputs::ports`], at TIM1's update and at its channel 1.
    pub play: [u8; TAPE_PORTS],
    /// Streams that erase the played slot of each port, at TIM1's channels 2 and 3.
    pub erase: [u8; TAPE_PORTS],
    /// Request channel of all four streams.
    pub channel: u8,
}

/// The two DACs, on SPI3.
#[derive(Clone, Copy, Debug)]
pub struct Dacs {
    /// SPI clock pin, SPI3_SCK.
    pub clock: Alternate,
    /// SPI data pin, SPI3_MOSI.
    pub data: Alternate,
    /// /SYNC pin of each DAC.
    pub select: [Pin; 2],
    /// Output that sets each channel's amplitude.
    pub channels: [DacOutput; CHANNELS],
    /// Output that sets the level of each bank's comparators.
    pub trips: [DacOutput; BANKS],
}

/// Output of one of the two DACs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DacOutput {
    /// Index of the DAC, 0 or 1.
    pub dac: u8,
    /// Index of the DAC's output, 0 (A) to 7 (H).
    pub output: u8,
}

impl DacOutput {
    /// Creates an output; the build fails if an index is out of range.
    #[must_use]
    pub const fn new(dac: u8, output: u8) -> Self {
        assert!(dac < 2 && output < 8, "two DACs of eight outputs");
        Self { dac, output }
    }
}

/// Analogue properties of the output stages (docs/reference/hardware.md).
#[derive(Clone, Copy, Debug)]
pub struct Stages {
    /// Disconnected time between anodic and cathodic drive of one channel, µs: the turn-off time of
    /// the stage's switches.
    pub dead_time_us: u16,
    /// Sensed current at 4095 counts of the ADC, µA.
    pub sense_full_scale_ua: u32,
    /// Current limit at code 65 535 of a bank's comparators, µA; they trip at 1.25 times the limit.
    pub trip_full_scale_ua: u32,
    /// Bank of each channel, below [`BANKS`].
    pub banks: [u8; CHANNELS],
}

impl Stages {
    /// Returns whether each channel's bank exists.
    pub(super) const fn are_banked(&self) -> bool {
        let mut channel = 0;
        while channel < CHANNELS {
            if self.banks[channel] as usize >= BANKS {
                return false;
            }
            channel += 1;
        }
        true
    }
}
