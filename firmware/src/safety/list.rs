//! A list of pulses that a channel plays once, in place of its train's own.

use super::Stimulus;
use crate::pulse::TrainSpec;
use crate::range::Range;
use crate::units::Amplitude;
use core::num::NonZeroU32;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Pulses that a list can hold.
pub const MAX_LISTED: usize = 16;

/// One pulse of a list.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct ListedPulse {
    /// From the start of the pulse before, µs; of the first, from when the channel's next
    /// burst would begin.
    pub after_us: u32,
    /// In the stage's thousandths.
    pub amplitude: Amplitude,
    /// Of each phase, µs.
    pub width_us: u16,
}

impl ListedPulse {
    /// Of [`Self::after_us`]; after the first, at least the channel's shortest period.
    pub const AFTER_US: Range = Range::new("after_us", 0, TrainSpec::PERIOD_US.max);
    /// Of [`Self::amplitude`]: a list is silent between pulses, not in them.
    pub const AMPLITUDE: Range = Range::new("amplitude", 1, i32::MAX);

    /// What it is made of.
    #[must_use]
    pub const fn stimulus(&self) -> Stimulus {
        Stimulus {
            amplitude: self.amplitude,
            width_us: self.width_us,
        }
    }
}

/// A list for one channel.
#[derive(Clone, PartialEq, Eq, Debug, Hash)]
pub struct PulseList {
    /// From 0.
    pub channel: u8,
    /// One after the other.
    pub pulses: Vec<ListedPulse, MAX_LISTED>,
}

impl PulseList {
    /// How many pulses a list may have.
    pub const COUNT: Range = Range::new("pulses", 1, MAX_LISTED as i32);
}

/// No channel.
const NONE: u8 = u8::MAX;

/// The list under way, and how far it is.
#[derive(Debug, Hash)]
pub(super) struct Playing {
    list: PulseList,
    /// Of its pulses, the one that comes next.
    next: u8,
    /// The first one's wait is over, or has begun.
    waits: bool,
}

impl Playing {
    /// Nothing.
    pub(super) const NOTHING: Self = Self {
        list: PulseList {
            channel: NONE,
            pulses: Vec::new(),
        },
        next: 0,
        waits: false,
    };

    /// Begins with the next burst.
    pub(super) fn new(list: &PulseList) -> Self {
        Self {
            list: list.clone(),
            ..Self::NOTHING
        }
    }

    /// Whether it is under way at all.
    pub(super) const fn is_under_way(&self) -> bool {
        self.list.channel != NONE
    }

    /// Whether it is under way on `channel`.
    #[inline]
    pub(super) const fn is_on(&self, channel: u8) -> bool {
        self.list.channel == channel
    }

    /// What comes now, or none where a burst is left out; after the last one, nothing is
    /// under way.
    pub(super) fn turn(&mut self) -> Option<Stimulus> {
        if self.next == 0 && !self.waits && self.after_us().is_some() {
            self.waits = true;
            return None;
        }
        let pulse = self.list.pulses.get(usize::from(self.next)).copied();
        self.next = self.next.saturating_add(1);
        if self.after_us().is_none() {
            self.list.channel = NONE;
        }
        // There is one: a list is not empty, and ends with its last.
        pulse.map(|pulse| pulse.stimulus())
    }

    /// How much later than that the next burst of `channel` comes, µs; none is after the
    /// train's period.
    #[inline]
    pub(super) fn next_us_on(&self, channel: u8) -> Option<NonZeroU32> {
        if self.is_on(channel) {
            self.after_us()
        } else {
            None
        }
    }

    /// The next pulse's distance from the one before, µs; none without either.
    fn after_us(&self) -> Option<NonZeroU32> {
        let pulse = self.list.pulses.get(usize::from(self.next));
        pulse.and_then(|pulse| NonZeroU32::new(pulse.after_us))
    }
}
