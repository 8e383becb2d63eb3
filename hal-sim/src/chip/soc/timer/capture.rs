//! Models input capture (RM0090 18.3.5): synchroniser, filter and edge detector of channel 1; on
//! TIM5's channel 4, the LSI as connected by TIM5_OR (18.4.21), and its prescaler.

use super::{Timer, bit};
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use crate::chip::soc::clock::Oscillator;

/// Timer clocks from a sampled edge to filter and edge detector. RM0090 18.3.5 says that up to five
/// may pass while an input settles and gives no exact figure: two flip-flops are assumed.
const SYNCHRONISATION: u64 = 2;

/// Input of channel 1: the path from the level of the pin through the filter to the edge detector.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Capture {
    /// Level after the filter.
    filtered: bool,
    /// Cycle at which the filter will have seen enough equal samples of the other level.
    change: Option<Cycle>,
    /// Number of edges since the last capture.
    edges: u32,
}

impl Capture {
    /// Processes a change of the pin to `high` at `at`, where a timer clock lasts `clock` cycles.
    /// The level must stay for `filter` samples, one per timer clock (0: no filter); a shorter
    /// pulse is lost.
    pub(super) fn set(&mut self, high: bool, at: Cycle, clock: u64, filter: u64) {
        let clocks = SYNCHRONISATION + filter;
        self.change = (high != self.filtered).then(|| at.next_multiple_of(clock) + clocks * clock);
    }

    /// Removes and returns a filtered edge at or before `to`: its cycle, and whether it is rising.
    #[inline]
    pub(super) fn pop(&mut self, to: Cycle) -> Option<(Cycle, bool)> {
        let at = self.change.filter(|&at| at <= to)?;
        self.change = None;
        self.filtered = !self.filtered;
        Some((at, self.filtered))
    }

    /// Restarts the prescaler, which counts edges towards the next capture.
    pub(super) fn begin(&mut self) {
        self.edges = 0;
    }

    /// Returns the cycle of the next filtered edge.
    pub(super) fn due(&self) -> Cycle {
        self.change.unwrap_or(Cycle::MAX)
    }
}

/// Channel 4 of TIM5, with the LSI that TIM5_OR may connect to it.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Channel4 {
    /// TIM5_OR: TI4_RMP is 01 if the LSI is connected.
    pub(super) option: u32,
    /// The LSI, while it oscillates, and the number of its first unprocessed edge.
    lsi: Option<(Oscillator, u64)>,
    /// Number of edges since the last capture.
    edges: u32,
}

impl Channel4 {
    /// Returns the state after a reset of the timer: the LSI is no longer connected, but still
    /// oscillates.
    pub(super) fn reset(&self) -> Self {
        Self {
            lsi: self.lsi.clone(),
            ..Self::default()
        }
    }
}

/// TIM5_OR value that connects the LSI to channel 4.
const LSI: u32 = 0b01 << 6;

impl Timer {
    /// Sets the LSI of TIM5's channel 4; `None` if it does not oscillate.
    pub fn set_lsi(&mut self, lsi: Option<Oscillator>) {
        self.channel_4.lsi = lsi.map(|lsi| (lsi, 0));
    }

    /// Sets the frequency of the LSI at TIM5's channel 4 to `hz` from cycle `at` on.
    pub fn set_lsi_hz(&mut self, hz: u32, at: Cycle) {
        if let Some((lsi, _)) = &mut self.channel_4.lsi {
            lsi.set_hz(hz, at);
        }
    }

    /// Sets the core clock, in whose cycles the edges of the LSI are measured, to `hz` from cycle
    /// `at` on.
    pub fn set_core_hz(&mut self, hz: u32, at: Cycle) {
        if let Some((lsi, _)) = &mut self.channel_4.lsi {
            lsi.set_core_hz(hz, at);
        }
    }

    /// Captures the edges of the LSI up to `to`.
    pub(super) fn capture_lsi(&mut self, to: Cycle) -> Modelled {
        let prescaler = 1 << (self.ccmr[1] >> 10 & 0b11);
        let enabled = self.is_input(3) && self.ccer & bit::CC4E != 0;
        let is_connected = self.channel_4.option == LSI;
        let delay = SYNCHRONISATION * self.divider;
        while let Some((lsi, next)) = &mut self.channel_4.lsi {
            let seen = lsi.cycle_of(*next).next_multiple_of(self.divider) + delay;
            if seen > to {
                break;
            }
            *next += 1;
            if !enabled || !is_connected {
                // Without a capture, skip to the edges that may still be captured.
                *next = (*next).max(lsi.ticks(to.saturating_sub(2 * delay)));
                self.channel_4.edges = 0; // RM0090 18.4.7: reset while CC4E is 0
                continue;
            }
            self.channel_4.edges += 1;
            if self.channel_4.edges < prescaler {
                continue;
            }
            self.channel_4.edges = 0;
            self.count_to(seen)?;
            self.ccr[3] = self.count;
            if self.sr & bit::CC4IF != 0 {
                self.sr |= bit::CC4OF;
            }
            self.sr |= bit::CC4IF;
        }
        Ok(())
    }

    /// Returns the timer clocks that the filter of channel 1 requires (IC1F, RM0090 18.4.7). CKD is
    /// assumed to be 0; settings up to 3 do not depend on it.
    pub(super) fn filter_clocks(&self) -> u64 {
        const CLOCKS: [u64; 16] = [
            0, 2, 4, 8, 12, 16, 24, 32, 48, 64, 80, 96, 128, 160, 192, 256,
        ];
        CLOCKS[(self.ccmr[0] >> 4 & 0xF) as usize]
    }

    /// Processes a filtered edge of channel 1: captures the counter if this edge is selected.
    pub(super) fn capture(&mut self, rising: bool) {
        if self.ccmr[0] & 0b11 == 1 && rising == (self.ccer & bit::CC1P == 0) {
            self.capture_edges(1);
        }
    }

    /// Returns whether channel 1 captures at the edges of its trigger, TRC, which the timer also
    /// counts.
    pub(super) const fn captures_trigger(&self) -> bool {
        self.ccmr[0] & 0b11 == 3 && self.is_slave() && self.ccer & bit::CC1E != 0
    }

    /// Captures after a slave has counted `n` edges of its trigger. Assumed: an edge captures the
    /// counter after it, and only TI1 is filtered.
    pub(super) fn capture_trigger(&mut self, n: u64) {
        if self.captures_trigger() && n > 0 {
            self.capture_edges(n);
        }
    }

    /// Processes `n` edges of channel 1's input, the last one now. One in 1, 2, 4 or 8 is captured
    /// (IC1PSC).
    fn capture_edges(&mut self, n: u64) {
        if self.ccer & bit::CC1E == 0 {
            return;
        }
        let prescaler = 1 << (self.ccmr[0] >> 2 & 0b11);
        let edges = u64::from(self.input.edges) + n;
        let (captures, since) = (edges / prescaler, edges % prescaler);
        self.input.edges = since as u32; // below 8
        if captures == 0 {
            return;
        }
        // If it counts these edges, the counter has advanced since the captured one.
        let counted = if self.captures_trigger() { since } else { 0 };
        self.ccr[0] = self.count.wrapping_sub(counted as u32);
        if self.sr & bit::CC1IF != 0 || captures > 1 {
            self.sr |= bit::CC1OF;
        }
        self.sr |= bit::CC1IF;
    }
}
