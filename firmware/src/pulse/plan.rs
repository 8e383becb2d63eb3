//! What a refill produces: the output states of one window and its DAC writes.

use super::{BANKS, CHANNELS};
use crate::units::{DacCode, Micros};
use heapless::Vec;

/// State of one channel's two output lines.
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

/// The state of all outputs: bits 2i and 2i+1 are channel i, bit 20 is sync out.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Levels(pub u32);

impl Levels {
    /// Every channel isolated, sync low.
    pub const ISOLATED: Self = Self(0);
    /// Every channel grounded, sync low.
    pub const GROUNDED: Self = Self((1 << (2 * CHANNELS)) - 1);
    /// The sync output's bit.
    pub const SYNC: u32 = 1 << (2 * CHANNELS);

    /// The channels of `mask` (bit i is channel i) grounded, the others
    /// isolated; sync low.
    #[must_use]
    pub const fn grounded(mask: u16) -> Self {
        // Spreads bit i to bit 2i: halves, quarters, pairs, single bits apart.
        let mut bits = mask as u32;
        bits = (bits | bits << 8) & 0x00FF_00FF;
        bits = (bits | bits << 4) & 0x0F0F_0F0F;
        bits = (bits | bits << 2) & 0x3333_3333;
        bits = (bits | bits << 1) & 0x5555_5555;
        Self((bits | bits << 1) & Self::GROUNDED.0)
    }

    /// The same levels with `channel` (below [`CHANNELS`]) in `state`.
    #[must_use]
    pub const fn with(self, channel: usize, state: State) -> Self {
        let shift = 2 * (channel % CHANNELS);
        Self(self.0 & !(0b11 << shift) | (state as u32) << shift)
    }

    /// The same without the sync output.
    #[must_use]
    pub const fn without_sync(self) -> Self {
        Self(self.0 & !Self::SYNC)
    }

    /// The channels whose state is another in `other`, bit i for channel i.
    #[must_use]
    pub const fn changed(self, other: Self) -> u16 {
        let lines = self.0 ^ other.0;
        of_pairs(lines | lines >> 1)
    }

    /// The grounded channels, bit i for channel i.
    #[must_use]
    pub const fn grounded_channels(self) -> u16 {
        of_pairs(self.0 & self.0 >> 1)
    }

    /// Whether `channel` (below [`CHANNELS`]) drives current.
    #[must_use]
    pub const fn drives(self, channel: usize) -> bool {
        matches!(self.state(channel), State::Cathodic | State::Anodic)
    }

    /// Whether `channel` (below [`CHANNELS`]), and no other, drives current.
    #[must_use]
    #[inline]
    pub const fn drives_alone(self, channel: usize) -> bool {
        // Bit 2i is channel i, whose two lines differ.
        let driven = (self.0 ^ self.0 >> 1) & 0x5_5555;
        driven == 1 << (2 * (channel % CHANNELS))
    }

    /// State of `channel` (below [`CHANNELS`]).
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

/// Bit 2i of `bits` as bit i, of the channels.
const fn of_pairs(bits: u32) -> u16 {
    let mut bits = bits & 0x5_5555;
    bits = (bits | bits >> 1) & 0x3333_3333;
    bits = (bits | bits >> 2) & 0x0F0F_0F0F;
    bits = (bits | bits >> 4) & 0x00FF_00FF;
    (bits | bits >> 8) as u16 // ten bits
}

/// From `slot` on, the outputs are at `levels`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Change {
    /// Microsecond inside the window, 0–249.
    pub slot: u8,
    /// The outputs from there on.
    pub levels: Levels,
}

/// A pulse that this window starts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PulseStart {
    /// Channel, below [`CHANNELS`].
    pub channel: u8,
    /// Leading edge of the first phase.
    pub at: Micros,
    /// Amplitude in force.
    pub code: DacCode,
    /// Of each of its phases, µs.
    pub width_us: u16,
}

/// A moment at which the current sense samples one channel.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Sample {
    /// Channel, below [`CHANNELS`].
    pub channel: u8,
    /// In the second phase of its pulse, not in the first.
    pub second: bool,
    /// The moment; it lies inside the phase.
    pub at: Micros,
}

/// Distinct edge times one window can hold. With burst intervals of at least
/// 200 µs a channel starts at most two pulses in 250 µs; each has at most four
/// edges, and an earlier pulse has at most three left: 11 × 10 channels.
pub const MAX_CHANGES: usize = 112;

/// Pulses one window can start: two for each channel, see [`MAX_CHANGES`].
pub const MAX_PULSES: usize = 2 * CHANNELS;

/// The next window, ready to be painted on the tape or recorded.
#[derive(Clone, Debug)]
pub struct WindowPlan {
    /// Time of slot 0.
    pub start: Micros,
    /// Levels before the first change.
    pub initial: Levels,
    /// Level changes, by increasing slot.
    pub changes: Vec<Change, MAX_CHANGES>,
    /// Amplitudes to write now, before the window plays: at most one burst
    /// start per channel and window, because periods exceed two windows.
    pub dac: Vec<(u8, DacCode), CHANNELS>,
    /// Levels of the banks' comparators to write now, if any: at arming.
    pub trips: Option<[DacCode; BANKS]>,
    /// Pulses started in this window, for the muscle model.
    pub pulses: Vec<PulseStart, MAX_PULSES>,
    /// What the current sense is asked to sample.
    pub sample: Option<Sample>,
    /// Whether the pump bit toggles, which keeps the output supply up.
    pub pump: bool,
}

impl WindowPlan {
    /// An isolated window without a pump.
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

    /// Whether `channel` is the only one that is driven from `slot` of this window on
    /// for the 2 µs in which a sample is held.
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

    /// Levels at the end of the window.
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
