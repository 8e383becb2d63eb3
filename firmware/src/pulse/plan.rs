//! The result of a refill: the output states of one window and its DAC writes.

use super::{BANKS, CHANNELS};
use crate::units::{DacCode, Micros};
use heapless::Vec;

/// State of the two output lines of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[repr(u8)]
pub enum State {
    /// Lines `00`: both electrodes float.
    Isolated = 0b00,
    /// Lines `01`: cathodic drive.
    Cathodic = 0b01,
    /// Lines `10`: anodic drive.
    Anodic = 0b10,
    /// Lines `11`: electrodes tied to the common ground.
    Grounded = 0b11,
}

/// State of all outputs: bits 2i and 2i+1 are the lines of channel i, bit 20 is the sync output.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Levels(pub u32);

impl Levels {
    /// Levels with every channel disconnected and sync low.
    pub const ISOLATED: Self = Self(0);
    /// Levels with every channel grounded and sync low.
    pub const GROUNDED: Self = Self((1 << (2 * CHANNELS)) - 1);
    /// Bit of the sync output.
    pub const SYNC: u32 = 1 << (2 * CHANNELS);

    /// Returns levels in which the channels of `mask` (bit i for channel i) are grounded and the
    /// others disconnected; sync low.
    #[must_use]
    pub const fn grounded(mask: u16) -> Self {
        // Spreads bit i to bit 2i: first halves, then quarters, pairs and single bits are moved
        // apart.
        let mut bits = mask as u32;
        bits = (bits | bits << 8) & 0x00FF_00FF;
        bits = (bits | bits << 4) & 0x0F0F_0F0F;
        bits = (bits | bits << 2) & 0x3333_3333;
        bits = (bits | bits << 1) & 0x5555_5555;
        Self((bits | bits << 1) & Self::GROUNDED.0)
    }

    /// Returns the levels with `channel` (below [`CHANNELS`]) in `state`.
    #[must_use]
    pub const fn with_channel(self, channel: usize, state: State) -> Self {
        let shift = 2 * (channel % CHANNELS);
        Self(self.0 & !(0b11 << shift) | (state as u32) << shift)
    }

    /// Returns the levels with sync low.
    #[must_use]
    pub const fn without_sync(self) -> Self {
        Self(self.0 & !Self::SYNC)
    }

    /// Returns the channels whose state differs in `other`, bit i for channel i.
    #[must_use]
    pub const fn changed_channels(self, other: Self) -> u16 {
        let lines = self.0 ^ other.0;
        even_bits(lines | lines >> 1)
    }

    /// Returns the grounded channels, bit i for channel i.
    #[must_use]
    pub const fn grounded_channels(self) -> u16 {
        even_bits(self.0 & self.0 >> 1)
    }

    /// Returns whether `channel` (below [`CHANNELS`]) drives current.
    #[must_use]
    pub const fn drives(self, channel: usize) -> bool {
        matches!(self.state(channel), State::Cathodic | State::Anodic)
    }

    /// Returns whether `channel` (below [`CHANNELS`]), and no other, drives current.
    #[must_use]
    #[inline]
    pub const fn drives_alone(self, channel: usize) -> bool {
        // Bit 2i is set if the two lines of channel i differ.
        let driven = (self.0 ^ self.0 >> 1) & 0x5_5555;
        driven == 1 << (2 * (channel % CHANNELS))
    }

    /// Returns the state of `channel` (below [`CHANNELS`]).
    #[must_use]
    pub const fn state(self, channel: usize) -> State {
        match self.0 >> (2 * (channel % CHANNELS)) & 0b11 {
            0b00 => State::Isolated,
            0b01 => State::Cathodic,
            0b10 => State::Anodic,
            _ => State::Grounded,
        }
    }
}

/// Returns bit 2i of `bits` as bit i, for all channels.
const fn even_bits(bits: u32) -> u16 {
    let mut bits = bits & 0x5_5555;
    bits = (bits | bits >> 1) & 0x3333_3333;
    bits = (bits | bits >> 2) & 0x0F0F_0F0F;
    bits = (bits | bits >> 4) & 0x00FF_00FF;
    (bits | bits >> 8) as u16 // ten bits
}

/// A change of the outputs at one slot of a window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Change {
    /// Slot of the change, in µs after the start of the window, 0–249.
    pub slot: u8,
    /// The outputs from that slot on.
    pub levels: Levels,
}

/// A pulse that starts in this window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PulseStart {
    /// Channel that pulses, below [`CHANNELS`].
    pub channel: u8,
    /// Time of the leading edge of the first phase.
    pub at: Micros,
    /// DAC code of the amplitude with which the pulse is output.
    pub code: DacCode,
    /// Width of each phase, µs.
    pub width_us: u16,
}

/// A time at which the current sense samples one channel.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Sample {
    /// Channel that is sampled, below [`CHANNELS`].
    pub channel: u8,
    /// Whether the second phase of the pulse is sampled, not the first.
    pub second: bool,
    /// Time of the sample; it is inside the phase.
    pub at: Micros,
}

/// Largest number of distinct edge times in one window. With burst intervals of at least 200 µs a
/// channel starts at most two pulses in 250 µs; each has at most four edges, and an earlier pulse
/// has at most three left: 11 × 10 channels.
pub const MAX_CHANGES: usize = 112;

/// Largest number of pulses that one window can start: two for each channel, see [`MAX_CHANGES`].
pub const MAX_PULSES: usize = 2 * CHANNELS;

/// The next window, ready to be painted on the pulse tape or recorded.
#[derive(Clone, Debug)]
pub struct WindowPlan {
    /// Device time of slot 0.
    pub start: Micros,
    /// Levels at the start of the window, before the first change.
    pub initial: Levels,
    /// Level changes, in the order of their slots.
    pub changes: Vec<Change, MAX_CHANGES>,
    /// Amplitudes to write now, before the window plays: at most one burst start per channel and
    /// window, because periods exceed two windows.
    pub dac: Vec<(u8, DacCode), CHANNELS>,
    /// Trip levels of the banks' comparators to write now, if any: at arming.
    pub trips: Option<[DacCode; BANKS]>,
    /// Pulses started in this window, for the muscle model.
    pub pulses: Vec<PulseStart, MAX_PULSES>,
    /// The sample that the current sense takes in this window, if any.
    pub sample: Option<Sample>,
    /// Whether the pump's line toggles in this window, which keeps the output supply on.
    pub pump: bool,
}

impl WindowPlan {
    /// Returns a window in which every channel is disconnected and the pump is off.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            start: Micros::new(0),
            initial: Levels::ISOLATED,
            changes: Vec::new(),
            dac: Vec::new(),
            trips: None,
            pulses: Vec::new(),
            sample: None,
            pump: false,
        }
    }

    /// Empties the plan for the window at `start` with `initial` levels.
    pub fn reset(&mut self, start: Micros, initial: Levels) {
        self.start = start;
        self.initial = initial;
        self.changes.clear();
        self.dac.clear();
        self.trips = None;
        self.pulses.clear();
        self.sample = None;
        self.pump = false;
    }

    /// Returns whether `channel` is the only channel that drives current from `slot` of this window
    /// on, for the 2 µs that a sample takes.
    #[must_use]
    #[inline]
    pub fn drives_alone(&self, channel: u8, slot: u8) -> bool {
        let is_alone = |levels: Levels| levels.drives_alone(channel.into());
        let mut levels = self.initial;
        for change in &self.changes {
            if change.slot > slot {
                let is_held = change.slot > slot.saturating_add(1);
                return is_alone(levels) && (is_held || is_alone(change.levels));
            }
            levels = change.levels;
        }
        is_alone(levels)
    }

    /// Returns the levels at the end of the window.
    #[must_use]
    pub fn last_levels(&self) -> Levels {
        self.changes.last().map_or(self.initial, |c| c.levels)
    }
}

impl Default for WindowPlan {
    fn default() -> Self {
        Self::new()
    }
}
