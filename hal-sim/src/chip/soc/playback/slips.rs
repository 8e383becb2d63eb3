//! Injected faults that no register shows: missed or additional requests, and wrong timer clocks.

use super::{Block, PERIPHERAL, Playback};
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use crate::chip::soc::Ram;
use crate::chip::soc::dma::{STREAMS, bit};
use crate::chip::soc::timer::Clocking;

/// Error in the number of requests that a stream serves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Slip {
    /// The stream misses the next request.
    Unseen,
    /// The stream serves a request that was not made.
    Unasked,
}

impl Playback {
    /// Makes stream `index` of DMA2 miss a request, or serve a request that was not made, as `slip`
    /// selects, at cycle `at`. Has no effect on a stream that is off.
    ///
    /// # Errors
    /// Fails if an event before `at` is not modelled.
    pub fn slip(&mut self, index: usize, slip: Slip, at: Cycle, ram: &mut Ram) -> Modelled {
        self.run(at, at, ram)?;
        self.quiet_until = 0;
        let mask = 1u8 << (index % STREAMS);
        let stream = self.dma[1].stream_mut(index % STREAMS);
        if !stream.is_enabled() || stream.stopping {
            return Ok(());
        }
        match slip {
            Slip::Unseen => self.unseen |= mask,
            Slip::Unasked if self.ports[PERIPHERAL].waiting & mask == 0 => {
                stream.asked = at;
                if !stream.is_ready_at(at) {
                    self.dma[1].raise(index % STREAMS, bit::FEIF);
                }
                self.ports[PERIPHERAL].waiting |= mask;
            }
            Slip::Unasked => {}
        }
        Ok(())
    }

    /// Changes the clock of timer `number` from `at` on.
    ///
    /// # Errors
    /// Fails if the timer's present mode is not modelled.
    pub fn misclock(
        &mut self,
        number: u8,
        clocking: Clocking,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled {
        self.run(at, at, ram)?;
        self.timers[Block::timer_index(number)].misclock(clocking, at)?;
        self.link(at)
    }

    /// Makes TIM1 restart after `cycles` of its clock, regardless of ARR, until ARR is written
    /// again.
    ///
    /// # Errors
    /// Fails if TIM1 has already counted further.
    pub fn misreload(&mut self, cycles: u32, at: Cycle, ram: &mut Ram) -> Modelled {
        self.run(at, at, ram)?;
        self.timers[0].advance(at.saturating_sub(1))?;
        self.timers[0].misreload(cycles)?;
        self.link(at)
    }

    /// Returns the cycle at which TIM1 next restarts after `at`.
    pub fn next_lap(&self, at: Cycle) -> Cycle {
        let (next, lap) = (self.timers[0].next_update(), self.timers[0].lap());
        match at.checked_sub(next) {
            Some(since) if lap > 0 => next + (since / lap + 1) * lap,
            _ => next,
        }
    }
}
