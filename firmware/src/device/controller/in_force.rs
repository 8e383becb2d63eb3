//! What each channel plays now, as far as its pulses tell.

use crate::pulse::CHANNELS;
use crate::safety::Stimulus;
use crate::units::{Amplitude, Micros};

/// How late a burst may be before its channel counts as silent, µs: a window's
/// wait for an order, a window ahead, and a control tick.
const GRACE_US: u32 = 1_500;

/// Amplitude and rate of the pulses that each channel plays.
#[derive(Debug, Default)]
pub(super) struct InForce {
    /// The latest pulse and its leading edge; `None` for silence.
    latest: [Option<(Stimulus, Micros)>; CHANNELS],
    /// Burst start to burst start as last ordered, µs.
    periods_us: [u32; CHANNELS],
}

impl InForce {
    /// Nothing is played yet; the trains have these periods.
    pub(super) fn rest(&mut self, periods_us: [u32; CHANNELS]) {
        self.silence();
        self.periods_us = periods_us;
    }

    /// Nothing is played any more.
    pub(super) fn silence(&mut self) {
        self.latest = [None; CHANNELS];
    }

    /// A pulse began.
    pub(super) fn pulse(&mut self, channel: u8, at: Micros, stimulus: Stimulus) {
        if let Some(slot) = self.latest.get_mut(usize::from(channel)) {
            *slot = Some((stimulus, at));
        }
    }

    /// The channel is ordered to play this amplitude: no burst will come to say
    /// that it is nothing.
    pub(super) fn set_amplitude(&mut self, channel: u8, amplitude: Amplitude) {
        if amplitude == Amplitude::ZERO
            && let Some(slot) = self.latest.get_mut(usize::from(channel))
        {
            *slot = None;
        }
    }

    /// The channel is ordered another period.
    pub(super) fn set_period(&mut self, channel: u8, period_us: u32) {
        if let Some(slot) = self.periods_us.get_mut(usize::from(channel)) {
            *slot = period_us;
        }
    }

    /// Forgets what is overdue: amplitude 0, a train that has played, a
    /// triggered one that waits.
    pub(super) fn advance(&mut self, now: Micros) {
        for (slot, period_us) in self.latest.iter_mut().zip(&self.periods_us) {
            // A period is at most 2 s: the sum fits.
            let is_overdue =
                |(_, at): &mut (Stimulus, Micros)| now.elapsed_since(*at) > period_us + GRACE_US;
            slot.take_if(is_overdue);
        }
    }

    /// What the channel's pulses are made of; `None` while it plays nothing.
    pub(super) fn stimulus(&self, channel: u8) -> Option<Stimulus> {
        let latest = self.latest.get(usize::from(channel)).copied().flatten();
        latest.map(|(stimulus, _)| stimulus)
    }

    /// Burst start to burst start, µs; `None` while the channel plays nothing.
    pub(super) fn period_us(&self, channel: u8) -> Option<u32> {
        self.stimulus(channel)?;
        self.periods_us.get(usize::from(channel)).copied()
    }
}
