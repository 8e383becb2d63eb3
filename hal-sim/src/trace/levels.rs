//! State of all output lines at one instant, packed into one word.

use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// Number of stimulation channels of the board.
pub const CHANNELS: usize = 10;

const SYNC: u32 = 1 << 20;

/// State of one channel's output stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum State {
    /// Both switches open: no current path to the other channels.
    #[default]
    Isolated = 0b00,
    /// Current is driven in the cathodic direction.
    Cathodic = 0b01,
    /// Current is driven in the anodic direction.
    Anodic = 0b10,
    /// Electrode tied to the return: discharges, and conducts for other channels.
    Grounded = 0b11,
}

impl State {
    /// Returns true in the two states that drive current.
    pub const fn is_driven(self) -> bool {
        matches!(self, State::Cathodic | State::Anodic)
    }

    /// Returns the sign of the charge delivered: +1 anodic, −1 cathodic, 0 otherwise.
    pub const fn sign(self) -> i64 {
        match self {
            State::Anodic => 1,
            State::Cathodic => -1,
            State::Isolated | State::Grounded => 0,
        }
    }

    /// Returns the word for the state in edge files.
    pub const fn name(self) -> &'static str {
        match self {
            State::Isolated => "isolated",
            State::Cathodic => "cathodic",
            State::Anodic => "anodic",
            State::Grounded => "grounded",
        }
    }

    const fn from_bits(bits: u32) -> State {
        match bits & 0b11 {
            0b00 => State::Isolated,
            0b01 => State::Cathodic,
            0b10 => State::Anodic,
            _ => State::Grounded,
        }
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for State {
    type Err = ();

    fn from_str(text: &str) -> Result<State, ()> {
        let mut states = (0..4).map(State::from_bits);
        states.find(|state| state.name() == text).ok_or(())
    }
}

/// All output lines: bits 2i and 2i+1 hold the [`State`] of channel i (from 0), bit 20 the sync
/// output. The remaining bits are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[repr(transparent)]
pub struct Levels(pub u32);

impl Levels {
    /// All channels isolated, sync low: the state before the first record.
    pub const ISOLATED: Levels = Levels(0);

    /// Returns the state of a channel, 0…9.
    pub const fn state(self, channel: u8) -> State {
        State::from_bits(self.0 >> (2 * channel))
    }

    /// Returns the same lines with one channel, 0…9, in another state.
    #[must_use]
    pub const fn with_channel(self, channel: u8, state: State) -> Levels {
        Levels(self.0 & !(0b11 << (2 * channel)) | (state as u32) << (2 * channel))
    }

    /// Returns whether the sync output is high.
    pub const fn sync(self) -> bool {
        self.0 & SYNC != 0
    }

    /// Returns the same lines with the sync output high or low.
    #[must_use]
    pub const fn with_sync(self, high: bool) -> Levels {
        Levels(if high { self.0 | SYNC } else { self.0 & !SYNC })
    }

    /// Returns the channels whose state differs from `before`, in ascending order.
    pub const fn changed_channels(self, before: Levels) -> ChangedChannels {
        ChangedChannels((self.0 ^ before.0) & (SYNC - 1))
    }
}

/// Iterator over the channels that changed, in ascending order. A channel changed if at least one
/// of its two bits is set.
#[derive(Clone, Copy, Debug, Default)]
pub struct ChangedChannels(u32);

impl Iterator for ChangedChannels {
    type Item = u8;

    #[inline]
    fn next(&mut self) -> Option<u8> {
        if self.0 == 0 {
            return None;
        }
        let channel = self.0.trailing_zeros() / 2;
        self.0 &= !(0b11 << (2 * channel));
        Some(channel as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_as_the_simulators_write_them() {
        // Channel 0 is in bits 0 and 1.
        let states = [0, 1, 2].map(|channel| Levels(0b10_01_11).state(channel));
        assert_eq!(states, [State::Grounded, State::Cathodic, State::Anodic]);
        let levels = Levels::ISOLATED
            .with_channel(9, State::Anodic)
            .with_sync(true);
        assert_eq!(levels, Levels(0b10 << 18 | 1 << 20));
        assert_eq!(levels.with_channel(9, State::Isolated), Levels(1 << 20));
    }

    #[test]
    fn changed_names_each_channel_once_and_ignores_sync() {
        let before = Levels::ISOLATED.with_channel(3, State::Anodic);
        let after = Levels::ISOLATED
            .with_channel(0, State::Grounded)
            .with_channel(3, State::Cathodic)
            .with_channel(9, State::Cathodic)
            .with_sync(true);
        assert_eq!(
            after.changed_channels(before).collect::<Vec<_>>(),
            [0, 3, 9]
        );
        assert_eq!(after.changed_channels(after).count(), 0);
    }
}
