//! Trigger output TRGO of TIM1, which TIM2 counts (RM0090 17.4.2, MMS).

use super::{IN_FORCE, Mode, Timer};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled};

impl Timer {
    /// Returns the level of TRGO for a slave that counts it: OCxREF, or low for other sources.
    pub fn trigger_level(&self) -> bool {
        match self.cr2 >> 4 & 0b111 {
            mms @ 4..=7 => self.level(mms as usize - 4),
            _ => false,
        }
    }

    /// Returns TRGO's rising edges that a slave counts: the first after `seen` and their distance;
    /// `None` if there are none.
    ///
    /// # Errors
    /// Fails if the slave, with a clock of `slave_clock` cycles, may miss edges, or if the output
    /// is not modelled.
    pub fn trigger_edges(&self, slave_clock: u64) -> Modelled<Option<(Cycle, u64)>> {
        if !self.ticks.are_running() || self.number != 1 {
            return Ok(None);
        }
        let channel = match self.cr2 >> 4 & 0b111 {
            0 | 1 => return Ok(None),
            // A pulse when CC1IF is set; assumed to be long enough for the slave.
            3 if !self.is_input(0) => return Ok(self.each_lap(self.next_match(0))),
            mms @ 4..=7 => mms as usize - 4,
            _ => return Err(Unmodelled("TIM1_TRGO on updates or captures")),
        };
        let (ccr, arr) = (self.ccr[channel], self.arr[IN_FORCE]);
        // When counting down the output is high up to and including CCR (RM0090 17.3.10).
        let (is_pulse, high) = match self.counts_down() {
            true => (ccr < arr, u64::from(ccr) + 1),
            false => (ccr != 0 && ccr <= arr, u64::from(ccr)),
        };
        match self.mode(channel)? {
            Mode::Pwm1 if is_pulse => (),
            Mode::Pwm1 | Mode::Frozen | Mode::ForceInactive => return Ok(None),
            _ => return Err(Unmodelled("TIM1_TRGO on updates or captures")),
        }
        if high * self.ticks.period < slave_clock {
            return Err(Unmodelled("a TIM1_TRGO pulse shorter than TIM2's clock"));
        }
        if !self.is_steady() {
            return Err(Unmodelled(
                "TIM2 counting a TIM1_TRGO without a constant period",
            ));
        }
        Ok(self.each_lap(match self.counts_down() {
            true => self.next_match(channel),
            false => self.next_update(),
        }))
    }

    /// Returns edges at `first` and once per lap after it; `None` if `first` never comes.
    fn each_lap(&self, first: Cycle) -> Option<(Cycle, u64)> {
        (first != Cycle::MAX).then(|| (first, self.lap()))
    }
}
