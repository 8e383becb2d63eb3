//! What breaks in the clockwork although every register holds what was written: requests
//! and timers' clocks.

use super::{Block, PERIPHERAL, Playback};
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use crate::chip::soc::Ram;
use crate::chip::soc::dma::{STREAMS, bit};
use crate::chip::soc::timer::Clocking;

/// How many requests too many or too few a stream serves.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Slip {
    /// It does not see the next.
    Unseen,
    /// It serves one that nobody made.
    Unasked,
}

impl Playback {
    /// Stream `index` of DMA2 slips at `at`. One that is off does not.
    ///
    /// # Errors
    /// What came before `at` is not modelled.
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

    /// The clock of timer `number` is no longer what it was, from `at` on.
    ///
    /// # Errors
    /// A count that the timer does not model.
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

    /// TIM1 begins anew after `cycles` of its clock, though its ARR says otherwise, until
    /// that is written again.
    ///
    /// # Errors
    /// It has counted further already.
    pub fn misreload(&mut self, cycles: u32, at: Cycle, ram: &mut Ram) -> Modelled {
        self.run(at, at, ram)?;
        self.timers[0].advance(at.saturating_sub(1))?;
        self.timers[0].misreload(cycles)?;
        self.link(at)
    }

    /// When TIM1 next begins anew after `at`.
    pub fn next_lap(&self, at: Cycle) -> Cycle {
        let (next, lap) = (self.timers[0].next_update(), self.timers[0].lap());
        match at.checked_sub(next) {
            Some(since) if lap > 0 => next + (since / lap + 1) * lap,
            _ => next,
        }
    }
}
