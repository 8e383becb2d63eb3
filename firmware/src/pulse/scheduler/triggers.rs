//! Effects of the trigger input on trains that wait for it.

use super::{Lane, Scheduler};
use crate::pulse::{Partner, TRIGGER_DELAY_US, Trigger, WINDOW_US};
use crate::units::{Micros, us};

/// State of the trigger input for gated trains: bit i while the train of channel i waits, with the
/// input active, for the end of its last period; above these bits the flags below.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
pub(super) struct Gate(u16);

impl Gate {
    /// The state without a gated train.
    pub(super) const NONE: Self = Self(0);
    /// Flag: there is at least one gated train.
    const SOME: u16 = 1 << 13;
    /// Flag: the input was sampled as released since the trains were prepared.
    const SEEN: u16 = 1 << 14;
    /// Flag: the input is active, and the change to active was observed.
    const HELD: u16 = 1 << 15;
    const WAITING: u16 = Self::SOME - 1;

    /// Returns the state for gated trains on `channels`, bit i for channel i, before the input was
    /// sampled.
    pub(super) const fn for_channels(channels: u16) -> Self {
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
    /// Handles a trigger edge captured at `at`: prepared trains start [`TRIGGER_DELAY_US`] later,
    /// plus their offset; playing trains that a trigger toggles begin no burst from then on.
    /// Returns the number of trains started and ended.
    ///
    /// A train whose last period is not over is not started, and neither is an isolated group with
    /// such a train, because the distances within a group hold only from one common trigger. Gated
    /// trains use [`Self::update_gate`] instead.
    pub fn trigger(&mut self, at: Micros) -> usize {
        if !self.seal.matches(&self.shared_memory()) {
            return 0; // found by the next window
        }
        let epoch = at + us(TRIGGER_DELAY_US);
        let ended = self.end_trains(Trigger::Toggle, epoch);
        let started = self.begin_trains(self.waiting_channels(false) & !ended, epoch);
        self.refresh_next();
        (ended | started).count_ones() as usize
    }

    /// Returns whether the trigger input, active if `held` and without an edge, changes nothing
    /// for gated trains.
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

    /// Updates gated trains from the trigger input before the window at `start` is rendered:
    /// `held` is its present level, `edge` its latest edge. Once the input was sampled as
    /// released, an edge after which it is still active starts them [`TRIGGER_DELAY_US`] later, as
    /// [`Self::trigger`] does; a train whose last period is not over starts as soon as it is.
    /// After a release, no train begins a burst later than that delay after this window's refill.
    /// Returns whether the edge counted for a gated train.
    pub fn update_gate(&mut self, held: bool, edge: Option<Micros>, start: Micros) -> bool {
        if self.gate == Gate::NONE || !self.seal.matches(&self.shared_memory()) {
            return false; // none is gated, or found by this window
        }
        // Same delay after the refill as trains have after an edge.
        let now = start + us(TRIGGER_DELAY_US - WINDOW_US);
        let counts = if self.gate.has(Gate::HELD) {
            if held {
                let waiting = self.gate.0 & Gate::WAITING;
                self.gate = Gate::held(waiting & !self.begin_trains(waiting, now));
            } else {
                self.end_trains(Trigger::Gated, now);
                self.gate = Gate::RELEASED;
            }
            edge.is_some() && held
        } else if let Some(at) = edge
            && held
            && self.gate.has(Gate::SEEN)
        {
            let waiting = self.waiting_channels(true);
            let begun = self.begin_trains(waiting, at + us(TRIGGER_DELAY_US));
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

    /// Returns the channels whose trains wait for the trigger input: gated ones if `gated`, else
    /// all others.
    pub(super) fn waiting_channels(&self, gated: bool) -> u16 {
        self.channels_where(|lane| {
            let trigger = lane.train.spec().trigger;
            trigger.is_some_and(|trigger| (trigger == Trigger::Gated) == gated)
        })
    }

    /// Ends trains with this kind of trigger, so that they begin no burst from `end` on; returns
    /// their channels.
    fn end_trains(&mut self, trigger: Trigger, end: Micros) -> u16 {
        let mut ended = 0u16;
        for (channel, lane) in self.lanes.iter_mut().enumerate() {
            if let Some(lane) = lane
                && lane.train.spec().trigger == Some(trigger)
                && lane.is_state_intact() // an unsealed one is found with its next edge
                && lane.end_at(end)
            {
                lane.renew_checksum();
                ended |= 1 << channel; // below 16
            }
        }
        ended
    }

    /// Starts the trains of `channels` at `epoch`, except those whose last period is not over then,
    /// and isolated groups with such a train; returns the channels started.
    fn begin_trains(&mut self, channels: u16, epoch: Micros) -> u16 {
        let mut busy = self.channels_where(|lane| !lane.is_free(epoch));
        for group in &self.groups {
            // A member that cannot start keeps its whole group from starting.
            let stays = busy | !channels & self.channels_where(|_| true);
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
                lane.renew_checksum();
            }
        }
        begun
    }

    /// Returns the channels with a train for which `is` holds, bit i for channel i.
    fn channels_where(&self, is: impl Fn(&Lane) -> bool) -> u16 {
        let mut channels = 0u16;
        for (channel, lane) in self.lanes.iter().enumerate() {
            let is = lane.as_ref().is_some_and(&is);
            channels |= u16::from(is) << channel; // below 16
        }
        channels
    }
}
