//! The lines that go out, the DMA streams that move them, the DACs and the output stages.

use super::pins::{Alternate, Pin, Port};
use super::{BANKS, CHANNELS, TAPE_PORTS};

/// Output lines of a board that code can be generic over, without cost: all that follows
/// from them is computed at compile time.
pub trait PinMap {
    /// The lines.
    const OUTPUTS: Outputs;
}

/// The two lines of a channel's output stage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Lines {
    /// High drives the cathodic direction.
    pub cathodic: Pin,
    /// High drives the anodic direction.
    pub anodic: Pin,
}

impl Lines {
    /// `cathodic` and `anodic` are pins of `port`.
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
    /// The ports of all these lines, in the order in which they move: the second does
    /// 48 ns after the first. Both lines of a channel are on one of them.
    pub ports: [Port; TAPE_PORTS],
    /// Lines of each channel.
    pub channels: [Lines; CHANNELS],
    /// Sync out.
    pub sync: Pin,
    /// The pump that supplies the output stages.
    pub pump: Pin,
}

/// Streams of DMA2 that TIM1 moves the tape with (RM0090 table 43).
#[derive(Clone, Copy, Debug)]
pub struct TapeStreams {
    /// Play each of [`Outputs::ports`]: at TIM1's update, and at its channel 1.
    pub play: [u8; TAPE_PORTS],
    /// Erase what was played of each: at TIM1's channels 2 and 3.
    pub erase: [u8; TAPE_PORTS],
    /// The request channel of all four.
    pub channel: u8,
}

/// The two DACs, on SPI3.
#[derive(Clone, Copy, Debug)]
pub struct Dacs {
    /// Clock.
    pub clock: Alternate,
    /// Data.
    pub data: Alternate,
    /// /SYNC of each DAC.
    pub select: [Pin; 2],
    /// The output that sets each channel's amplitude.
    pub channels: [DacOutput; CHANNELS],
    /// The output that sets the level of each bank's comparators.
    pub trips: [DacOutput; BANKS],
}

/// An output of one of the two DACs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DacOutput {
    /// Which DAC: 0 or 1.
    pub dac: u8,
    /// Which of its outputs: 0 (A) to 7 (H).
    pub output: u8,
}

impl DacOutput {
    /// Output `output` of DAC `dac`.
    #[must_use]
    pub const fn new(dac: u8, output: u8) -> Self {
        assert!(dac < 2 && output < 8, "two DACs of eight outputs");
        Self { dac, output }
    }
}

/// The output stages and their analogue part (docs/hardware.md).
#[derive(Clone, Copy, Debug)]
pub struct Stages {
    /// Isolation between anodic and cathodic drive of one channel, µs: the turn-off of the
    /// stage's switches.
    pub dead_time_us: u16,
    /// Current sense at 4095 counts of the ADC, µA.
    pub sense_full_scale_ua: u32,
    /// Limit of current at code 65 535 of a bank's comparators, µA; they trip at 1.25 times
    /// the limit.
    pub trip_full_scale_ua: u32,
    /// The bank of each channel, below [`BANKS`].
    pub banks: [u8; CHANNELS],
}

impl Stages {
    /// Whether each channel has a bank.
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
