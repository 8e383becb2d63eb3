//! Lists of pulses, which a channel plays once in place of its train's pulses.

use super::Stimulus;
use crate::pulse::TrainSpec;
use crate::range::Range;
use crate::units::Amplitude;
use core::num::NonZeroU32;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Largest number of pulses in a list.
pub const MAX_LISTED: usize = 16;

/// One pulse of a list, with its delay, amplitude and width.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub struct ListedPulse {
    /// Delay after the start of the previous pulse, µs. For the first pulse, delay after the time
    /// at which the channel's next burst would begin.
    pub after_us: u32,
    /// Amplitude in the stage's thousandths (µA or mV).
    pub amplitude: Amplitude,
    /// Width of each phase, µs.
    pub width_us: u16,
}

impl ListedPulse {
    /// Range of [`Self::after_us`]. After the first pulse, the minimum is the channel's shortest
    /// period.
    pub const AFTER_US: Range = Range::new("after_us", 0, TrainSpec::PERIOD_US.max);
    /// Range of [`Self::amplitude`]. A list is silent between pulses, so a pulse of amplitude 0 is
    /// not allowed.
    pub const AMPLITUDE: Range = Range::new("amplitude", 1, i32::MAX);

    /// Returns amplitude and width of the pulse.
    #[must_use]
    pub const fn stimulus(&self) -> Stimulus {
        Stimulus {
            amplitude: self.amplitude,
            width_us: self.width_us,
        }
    }
}

/// A list of pulses for one channel.
#[derive(Clone, PartialEq, Eq, Debug, Hash)]
pub struct PulseList {
    /// Channel that plays the list, from 0.
    pub channel: u8,
    /// The pulses in the order in which they play.
    pub pulses: Vec<ListedPulse, MAX_LISTED>,
}

impl PulseList {
    /// Range of the number of pulses in a list.
    pub const COUNT: Range = Range::new("pulses", 1, MAX_LISTED as i32);
}

/// Channel number that stands for no list in progress.
const NONE: u8 = u8::MAX;

/// The list in progress and the position in it.
#[derive(Clone, Debug, Hash)]
pub(super) struct Playing {
    list: PulseList,
    /// Index of the next pulse.
    next: u8,
    /// Whether the wait before the first pulse has begun or is over.
    waits: bool,
}

impl Playing {
    /// The state without a list in progress.
    pub(super) const NOTHING: Self = Self {
        list: PulseList {
            channel: NONE,
            pulses: Vec::new(),
        },
        next: 0,
        waits: false,
    };

    /// Returns the state before the first pulse of `list`, which begins with the channel's next
    /// burst.
    pub(super) fn new(list: &PulseList) -> Self {
        Self {
            list: list.clone(),
            ..Self::NOTHING
        }
    }

    /// Returns whether a list is in progress.
    pub(super) const fn is_playing(&self) -> bool {
        self.list.channel != NONE
    }

    /// Returns whether a list is in progress on `channel`.
    #[inline]
    pub(super) const fn is_on(&self, channel: u8) -> bool {
        self.list.channel == channel
    }

    /// Advances to the channel's next burst and returns its stimulus; `None` leaves the burst out.
    /// After the last pulse no list is in progress.
    pub(super) fn next_stimulus(&mut self) -> Option<Stimulus> {
        if self.next == 0 && !self.waits && self.after_us().is_some() {
            self.waits = true;
            return None;
        }
        let pulse = self.list.pulses.get(usize::from(self.next)).copied();
        self.next = self.next.saturating_add(1);
        if self.after_us().is_none() {
            self.list.channel = NONE;
        }
        // `pulse` is present: a list is not empty, and ends with its last pulse.
        pulse.map(|pulse| pulse.stimulus())
    }

    /// Returns the time from the present burst of `channel` to the next, µs; `None` means the
    /// train's period.
    #[inline]
    pub(super) fn next_us_on(&self, channel: u8) -> Option<NonZeroU32> {
        if self.is_on(channel) {
            self.after_us()
        } else {
            None
        }
    }

    /// Returns the delay of the next pulse after the previous one, µs; `None` if there is no next
    /// pulse or its delay is 0.
    fn after_us(&self) -> Option<NonZeroU32> {
        let pulse = self.list.pulses.get(usize::from(self.next));
        pulse.and_then(|pulse| NonZeroU32::new(pulse.after_us))
    }
}
