//! What the trigger input does to trains that wait for it.

use super::{Lane, Scheduler};
use crate::pulse::{Partner, TRIGGER_DELAY_US, Trigger, WINDOW_US};
use crate::units::{Micros, us};

/// The trigger input as a gate, held or released: bit i while the train of channel i
/// waits, held, for its last period to be over; above them what is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub(super) struct Gate(u16);

impl Gate {
    /// No train is gated.
    pub(super) const NONE: Self = Self(0);
    /// Some train is.
    const SOME: u16 = 1 << 13;
    /// It was seen released since the trains were prepared.
    const SEEN: u16 = 1 << 14;
    /// It is held, and was seen to come to it.
    const HELD: u16 = 1 << 15;
    const WAITING: u16 = Self::SOME - 1;

    /// Of trains on `channels`, bit i for channel i, before anything was seen of the input.
    pub(super) const fn over(channels: u16) -> Self {
        Self(if channels == 0 { 0 } else { Self::SOME })
    }

    const fn has(self, bit: u16) -> bool {
        self.0 & bit != 0
    }

    const fn held(waiting: u16) -> Self {
        Self(Self::SOME | Self::SEEN | Self::HELD | waiting & Self::WAITING)
    }

    const RELEASED: Self = Self(Self::SOME | Self::SEEN);
}

impl Scheduler {
    /// A trigger edge captured at `at`: prepared trains start
    /// [`TRIGGER_DELAY_US`] later, plus their offset; of those that play, the ones that a
    /// trigger toggles begin no burst from then on. Returns how many of both; trains whose
    /// last period is not over are left alone, and so is an isolated group with such a
    /// train, whose distances hold from one trigger. Not for gated trains: [`Self::gate`].
    pub fn trigger(&mut self, at: Micros) -> usize {
        if !self.seal.holds(&self.shared()) {
            return 0; // found by the next window
        }
        let epoch = at + us(TRIGGER_DELAY_US);
        let ended = self.end(Trigger::Toggle, epoch);
        let started = self.begin(self.waiting(false) & !ended, epoch);
        self.refresh_next();
        (ended | started).count_ones() as usize
    }

    /// Whether the trigger input, `held` or not and without an edge, changes nothing for
    /// gated trains.
    #[inline(always)]
    #[must_use]
    pub const fn is_gate_still(&self, held: bool) -> bool {
        let gate = self.gate;
        if gate.0 == Gate::NONE.0 {
            true
        } else if gate.has(Gate::HELD) {
            held && !gate.has(Gate::WAITING)
        } else {
            held || gate.has(Gate::SEEN)
        }
    }

    /// The trigger input before the window at `start` is rendered, for gated trains:
    /// whether it is `held` now, and its latest edge. Once it was seen released, an edge
    /// that is still held lets them start [`TRIGGER_DELAY_US`] after it, as [`Self::trigger`]
    /// does; one whose last period is not over, as soon as it is. Released, none begins a
    /// burst from that delay after this window's refill on. Returns whether the edge
    /// counts for one.
    pub fn gate(&mut self, held: bool, edge: Option<Micros>, start: Micros) -> bool {
        if self.gate == Gate::NONE || !self.seal.holds(&self.shared()) {
            return false; // none is gated, or found by this window
        }
        // As long after the refill as trains start after an edge.
        let now = start + us(TRIGGER_DELAY_US - WINDOW_US);
        let counts = if self.gate.has(Gate::HELD) {
            if held {
                let waiting = self.gate.0 & Gate::WAITING;
                self.gate = Gate::held(waiting & !self.begin(waiting, now));
            } else {
                self.end(Trigger::Gated, now);
                self.gate = Gate::RELEASED;
            }
            edge.is_some() && held
        } else if let Some(at) = edge
            && held
            && self.gate.has(Gate::SEEN)
        {
            let waiting = self.waiting(true);
            let begun = self.begin(waiting, at + us(TRIGGER_DELAY_US));
            self.gate = Gate::held(waiting & !begun);
            true
        } else {
            if !held {
                self.gate = Gate::RELEASED;
            }
            false
        };
        self.refresh_next();
        counts
    }

    /// Channels whose trains wait for the input, gated or the others.
    pub(super) fn waiting(&self, gated: bool) -> u16 {
        self.channels(|lane| {
            let trigger = lane.train.spec().trigger;
            trigger.is_some_and(|trigger| (trigger == Trigger::Gated) == gated)
        })
    }

    /// Lets trains that play by `trigger` begin no burst from `end` on; returns which.
    fn end(&mut self, trigger: Trigger, end: Micros) -> u16 {
        let mut ended = 0u16;
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            if let Some(lane) = lane
                && lane.train.spec().trigger == Some(trigger)
                && lane.is_sealed() // an unsealed one is found with its next edge
                && lane.end_at(end)
            {
                lane.seal();
                ended |= 1 << channel; // below 16
            }
        }
        ended
    }

    /// Begins trains of `channels` at `epoch`, but for those whose last period is not over
    /// then, and for isolated groups with such a train; returns which.
    fn begin(&mut self, channels: u16, epoch: Micros) -> u16 {
        let mut busy = self.channels(|lane| !lane.is_free(epoch));
        for group in &self.groups {
            // What stays behind of a group keeps it back as a whole.
            let stays = busy | !channels & self.channels(|_| true);
            if group.partner() == Partner::Isolated && group.members() & stays != 0 {
                busy |= group.members();
            }
        }
        let begun = channels & !busy;
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            if let Some(lane) = lane
                && begun & 1 << channel != 0
            {
                lane.begin(epoch);
                lane.seal();
            }
        }
        begun
    }

    /// Channels with a train of which `is` holds, bit i for channel i.
    fn channels(&self, is: impl Fn(&Lane) -> bool) -> u16 {
        let mut channels = 0u16;
        for (channel, lane) in self.lanes.iter().enumerate() {
            let is = lane.as_ref().is_some_and(&is);
            channels |= u16::from(is) << channel; // below 16
        }
        channels
    }
}
