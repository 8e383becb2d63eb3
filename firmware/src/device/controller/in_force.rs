//! Amplitude and rate that each channel plays now, as known from its pulses.

use crate::pulse::CHANNELS;
use crate::safety::Stimulus;
use crate::units::{Amplitude, Micros};

/// Delay of a burst after which its channel counts as silent, µs: the longest time for which an
/// amplitude waits for the next window, the window that is rendered ahead, and a control tick.
const GRACE_US: u32 = 1_500;

/// Amplitude and rate of the pulses that each channel plays.
#[derive(Clone, Debug, Default)]
pub(super) struct CurrentPulses {
    /// The latest pulse and the time of its leading edge; `None` for silence.
    latest: [Option<(Stimulus, Micros)>; CHANNELS],
    /// Time from burst start to burst start that was requested last, µs.
    periods_us: [u32; CHANNELS],
}

impl CurrentPulses {
    /// Resets all channels to silence, with the periods of their trains.
    pub(super) fn reset(&mut self, periods_us: [u32; CHANNELS]) {
        self.silence();
        self.periods_us = periods_us;
    }

    /// Marks all channels as silent.
    pub(super) fn silence(&mut self) {
        self.latest = [None; CHANNELS];
    }

    /// Records a pulse that began at `at`.
    pub(super) fn record_pulse(&mut self, channel: u8, at: Micros, stimulus: Stimulus) {
        if let Some(slot) = self.latest.get_mut(usize::from(channel)) {
            *slot = Some((stimulus, at));
        }
    }

    /// Records a requested amplitude. For amplitude 0 the channel becomes silent, because no burst
    /// will show it.
    pub(super) fn set_amplitude(&mut self, channel: u8, amplitude: Amplitude) {
        if amplitude == Amplitude::ZERO
            && let Some(slot) = self.latest.get_mut(usize::from(channel))
        {
            *slot = None;
        }
    }

    /// Records a requested time from burst start to burst start, µs.
    pub(super) fn set_period(&mut self, channel: u8, period_us: u32) {
        if let Some(slot) = self.periods_us.get_mut(usize::from(channel)) {
            *slot = period_us;
        }
    }

    /// Marks channels as silent whose next burst is overdue: amplitude 0, a train that has ended,
    /// or a triggered train that waits.
    pub(super) fn silence_overdue(&mut self, now: Micros) {
        for (slot, period_us) in self.latest.iter_mut().zip(&self.periods_us) {
            // A period is at most 2 s: the sum fits.
            let is_overdue =
                |(_, at): &mut (Stimulus, Micros)| now.elapsed_since(*at) > period_us + GRACE_US;
            slot.take_if(is_overdue);
        }
    }

    /// Returns amplitude and width of the channel's pulses; `None` while it plays nothing.
    pub(super) fn stimulus(&self, channel: u8) -> Option<Stimulus> {
        let latest = self.latest.get(usize::from(channel)).copied().flatten();
        latest.map(|(stimulus, _)| stimulus)
    }

    /// Returns the time from burst start to burst start, µs; `None` while the channel plays
    /// nothing.
    pub(super) fn period_us(&self, channel: u8) -> Option<u32> {
        self.stimulus(channel)?;
        self.periods_us.get(usize::from(channel)).copied()
    }
}
