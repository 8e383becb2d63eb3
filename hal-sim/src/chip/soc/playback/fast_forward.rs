//! Faster simulation of the same transfers, while DMA2 has the bus to itself and each transfer ends
//! before the next request.
//!
//! First, single transfers are executed without searching for the next step each time; then whole
//! laps that only repeat the last one; laps in which no pin changes are executed all at once
//! (`idle`).

use super::transfers::{GRANT, MASTERS};
use super::{MEMORY, PERIPHERAL, Playback, Port};
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use crate::chip::soc::Ram;
use crate::chip::soc::dma::EVENTS;
use crate::chip::soc::matrix::Slave;

/// Maximum cycles from a request to the end of an undisturbed transfer: grant, address, change of
/// master and access, on either port.
const SPAN: Cycle = 8;

/// A DMA transfer of one item that overlaps no other: `stream` is the index of its stream.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Transfer {
    pub stream: usize,
    /// Cycle from which the access of the peripheral port is complete.
    pub item: Cycle,
    /// Cycle from which the access of the memory port is complete.
    pub word: Cycle,
}

impl Port {
    #[inline]
    fn is_idle_at(&self, at: Cycle) -> bool {
        self.access.is_none() && self.waiting == 0 && self.free <= at
    }
}

impl Playback {
    /// Executes transfers that end before `end` as long as they do not overlap.
    #[inline]
    pub(super) fn fast_forward(&mut self, end: Cycle, ram: &mut Ram) -> Modelled {
        let (at, _) = self.requests.next();
        if self.unseen != 0 || at.saturating_add(SPAN) > end || !self.is_quiet_at(at) {
            return Ok(());
        }
        let (asking, lap) = self.requests.lap();
        if at.saturating_add(3 * lap) <= end && !self.repeat_laps(asking, lap, end, ram)? {
            return Ok(());
        }
        while self.transfer_alone(end, ram)?.is_some() {}
        Ok(())
    }

    /// Returns whether no transfer is in progress and every slave is free.
    fn is_quiet_at(&self, at: Cycle) -> bool {
        self.ports.iter().all(|port| port.is_idle_at(at))
            && [Slave::Sram1, Slave::Sram2, Slave::Ahb1]
                .into_iter()
                .all(|slave| self.matrix.ready_at(slave, at) == at)
    }

    /// Executes the next transfer, if it ends before `end` and before the following request;
    /// otherwise returns `None`. No transfer may be in progress at its request, and none is
    /// afterwards.
    #[inline(always)]
    fn transfer_alone(&mut self, end: Cycle, ram: &mut Ram) -> Modelled<Option<Transfer>> {
        let (at, event) = self.requests.next();
        let listeners = self.listeners[event];
        let over = at.saturating_add(SPAN);
        if over > end || over > self.requests.following() || !listeners.is_power_of_two() {
            return Ok(None);
        }
        let index = listeners.trailing_zeros() as usize;
        let stream = self.dma[1].stream(index);
        let (far, near) = (stream.far_slave(), stream.memory);
        if !stream.is_circular() || !stream.is_ready_at(at) {
            return Ok(None);
        }
        self.requests.pass();
        let item = self.matrix.grant(far, MASTERS[PERIPHERAL], at + GRANT);
        self.ports[PERIPHERAL].free = item;
        self.move_item(index, item, ram)?;
        let word = self.matrix.grant(near, MASTERS[MEMORY], item + GRANT);
        self.ports[MEMORY].free = word;
        self.move_word(index, word, ram)?;
        Ok(Some(Transfer {
            stream: index,
            item,
            word,
        }))
    }

    /// Executes transfers for the laps up to `end`, where a lap is the period of TIM1. Simulates
    /// two laps, then repeats the second, `lap` cycles later each time: from the end of the first
    /// lap on, every lap ends with the same master at every slave. Returns `false` if a transfer
    /// overlapped another. The times at which slaves and ports became free are not updated: all are
    /// free before the next request and before `end`.
    fn repeat_laps(
        &mut self,
        asking: usize,
        lap: u64,
        end: Cycle,
        ram: &mut Ram,
    ) -> Modelled<bool> {
        let mut transfers = [Transfer::default(); EVENTS];
        let transfers = &mut transfers[..asking];
        for _ in 0..2 {
            for transfer in transfers.iter_mut() {
                let Some(done) = self.transfer_alone(end, ram)? else {
                    return Ok(false);
                };
                *transfer = done;
            }
        }
        let laps = end.saturating_sub(self.requests.next().0) / lap;
        let mut left = laps;
        while left > 0 {
            let idle = self.pass_idle(transfers, lap, left, ram);
            if idle > 0 {
                left -= idle;
                continue;
            }
            left -= 1;
            for transfer in transfers.iter_mut() {
                transfer.item += lap;
                transfer.word += lap;
                self.move_item(transfer.stream, transfer.item, ram)?;
                self.move_word(transfer.stream, transfer.word, ram)?;
            }
        }
        self.requests.skip(laps);
        Ok(true)
    }
}
