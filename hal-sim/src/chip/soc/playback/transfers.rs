//! Simulates the two ports of DMA2 from request to bus access, cycle by cycle.
//!
//! A request is latched at the cycle of its event. A port is granted in one cycle and computes an
//! address in a second (AN4031 tables 4 and 5), then requests the matrix; it can be granted again
//! when the access is complete. The ports work in parallel. A playing stream fetches one word when
//! enabled and again after each item; an erasing stream writes its word at once.

use super::{Access, MEMORY, PERIPHERAL, Playback};
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled};
use crate::chip::soc::dma::{EVENTS, NEVER, STREAMS, Target, bit};
use crate::chip::soc::matrix::{Master, Slave};
use crate::chip::soc::{Lanes, Ram};

/// Cycles from the grant of a port to its bus access: arbitration, address.
pub(super) const GRANT: Cycle = 2;

pub(super) const MASTERS: [Master; 2] = [Master::Dma2Peripheral, Master::Dma2Memory];

/// Next step in the simulation of DMA2. Of several steps in one cycle, requests come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    /// A TIM1 event, by its number, requests its streams.
    Request(usize),
    /// The arbiter grants a port, by its index, to a stream.
    Grant(usize),
    /// A port, by its index, accesses the bus.
    Access(usize),
}

impl Playback {
    /// Executes everything before `end`, and latches requests before `requests_end`.
    #[inline]
    pub(super) fn run(&mut self, end: Cycle, requests_end: Cycle, ram: &mut Ram) -> Modelled {
        if requests_end.max(end) > self.update {
            let update = std::mem::replace(&mut self.update, NEVER) + 1;
            self.run_linked(end.min(update), requests_end.min(update), ram)?;
            self.timers[0].advance(update - 1)?;
            self.link(update)?;
        }
        self.run_linked(end, requests_end, ram)
    }

    /// Executes everything before `end`, and latches requests before `requests_end`, like
    /// [`Self::run`], while the period of TIM1 does not change.
    #[inline]
    fn run_linked(&mut self, end: Cycle, requests_end: Cycle, ram: &mut Ram) -> Modelled {
        if requests_end.max(end) <= self.quiet_until {
            return Ok(());
        }
        loop {
            self.fast_forward(end, ram)?;
            let (at, step) = self.next_step();
            match step {
                Step::Request(event) if at < requests_end => self.request(event, at),
                Step::Grant(port) if at < end => self.grant(port, at),
                Step::Access(port) if at < end => self.serve(port, ram)?,
                _ => {
                    self.quiet_until = at;
                    return Ok(());
                }
            }
        }
    }

    #[inline]
    fn next_step(&self) -> (Cycle, Step) {
        let (due, event) = self.requests.next();
        let mut first = (due, Step::Request(event));
        for port in [PERIPHERAL, MEMORY] {
            let p = &self.ports[port];
            let next = if let Some(access) = p.access {
                (
                    self.matrix.ready_at(access.slave, access.want),
                    Step::Access(port),
                )
            } else if p.waiting != 0 {
                (self.grantable_at(port), Step::Grant(port))
            } else {
                continue;
            };
            if next.0 < first.0 || next.0 == first.0 && self.goes_before(next.1, first.1) {
                first = next;
            }
        }
        first
    }

    /// Returns whether `step` must come before `other` in the same cycle. If both ports access one
    /// slave, the port that was not the slave's last master comes first. The order of all other
    /// steps does not matter.
    fn goes_before(&self, step: Step, other: Step) -> bool {
        let (Step::Access(MEMORY), Step::Access(PERIPHERAL)) = (step, other) else {
            return false;
        };
        let slave = |port: usize| self.ports[port].access.map(|access| access.slave);
        let is_last = |slave| self.matrix.last_master(slave) == Master::Dma2Peripheral;
        slave(MEMORY) == slave(PERIPHERAL) && slave(MEMORY).is_some_and(is_last)
    }

    /// Returns the first cycle at which `port` can be granted to a waiting stream.
    fn grantable_at(&self, port: usize) -> Cycle {
        let waiting = streams(self.ports[port].waiting);
        let first = waiting.map(|n| self.usable_since(port, n)).min();
        first.map_or(NEVER, |since| since.max(self.ports[port].free))
    }

    /// Returns the cycle from which stream `index` can use `port`; `NEVER` if it has nothing to
    /// move there.
    fn usable_since(&self, port: usize, index: usize) -> Cycle {
        let stream = self.dma[1].stream(index);
        if port == MEMORY {
            stream.due
        } else if stream.is_memory_to_peripheral() == stream.word.is_some() {
            stream.asked.max(stream.turned)
        } else {
            NEVER
        }
    }

    /// Processes a request of TIM1's `event` at `at`. A stream sets FEIF if it is requested before
    /// its word has arrived from memory or, in the other direction, has left to memory (RM0090
    /// 10.3.18). A stream that is requested again before being served misses a request, without any
    /// sign.
    fn request(&mut self, event: usize, at: Cycle) {
        self.requests.pass();
        let listening = self.listeners[event];
        let seen = listening & !self.unseen;
        self.unseen &= !listening;
        if seen != 0 || listening == 0 {
            self.requested |= 1 << event;
        }
        let listeners = seen & !self.ports[PERIPHERAL].waiting;
        for index in streams(listeners) {
            let stream = self.dma[1].stream_mut(index);
            stream.asked = at;
            if !stream.is_ready_at(at) {
                self.dma[1].raise(index, bit::FEIF);
            }
            self.ports[PERIPHERAL].waiting |= 1 << index;
        }
    }

    fn grant(&mut self, port: usize, at: Cycle) {
        let candidates = streams(self.ports[port].waiting)
            .filter(|&n| self.usable_since(port, n) <= at)
            .fold(0u8, |bits, n| bits | 1 << n);
        let Some(index) = self.dma[1].arbitrate(candidates) else {
            return;
        };
        let stream = self.dma[1].stream_mut(index);
        let slave = if port == PERIPHERAL {
            stream.far_slave()
        } else {
            stream.due = NEVER;
            stream.memory
        };
        if port == PERIPHERAL {
            self.requested &= !self.events(index);
        }
        let p = &mut self.ports[port];
        p.waiting &= !(1 << index);
        p.access = Some(Access {
            stream: index,
            slave,
            want: at + GRANT,
        });
    }

    /// Executes the access for which `port` was granted.
    pub(super) fn serve(&mut self, port: usize, ram: &mut Ram) -> Modelled {
        let Some(Access {
            stream,
            slave,
            want,
        }) = self.ports[port].access.take()
        else {
            return Ok(());
        };
        self.quiet_until = 0;
        let done = self.matrix.grant(slave, MASTERS[port], want);
        self.ports[port].free = done;
        if port == PERIPHERAL {
            self.serve_peripheral(stream, done, ram)
        } else {
            self.serve_memory(stream, done, ram)
        }
    }

    fn serve_peripheral(&mut self, index: usize, done: Cycle, ram: &mut Ram) -> Modelled {
        let more = self.move_item(index, done, ram)?;
        let stream = self.dma[1].stream_mut(index);
        if stream.is_memory_to_peripheral() && (stream.stopping || !more) {
            self.dma[1].switch_off(index);
            self.rewire_streams(done);
        } else if !stream.is_memory_to_peripheral() || !stream.has_fetched_all() {
            stream.due = done;
            self.ports[MEMORY].waiting |= 1 << index;
        }
        Ok(())
    }

    /// Executes the access of the peripheral port for stream `index`, complete from `done` on.
    /// Returns whether more items follow.
    #[inline(always)]
    pub(super) fn move_item(&mut self, index: usize, done: Cycle, ram: &mut Ram) -> Modelled<bool> {
        self.transfers += 1;
        let stream = self.dma[1].stream_mut(index);
        stream.turned = done;
        let size = stream.size();
        match stream.target {
            Target::Bsrr(port) => {
                if let Some(word) = stream.word.take() {
                    self.gpio.bsrr(port, word & mask(size), done);
                }
            }
            Target::Port(port, offset) => {
                if let Some(word) = stream.word.take() {
                    // Addresses beyond the registers of a port have no effect.
                    let _ = self.gpio.write(port, offset, Lanes::whole(word), done);
                }
            }
            Target::Word(address) if stream.is_memory_to_peripheral() => {
                if let Some(word) = stream.word.take() {
                    ram.write(address, size, word).ok_or(NO_RAM)?;
                }
            }
            Target::Word(address) => {
                stream.word = Some(ram.read(address, size).ok_or(NO_RAM)?);
            }
            Target::Nowhere if stream.is_memory_to_peripheral() => stream.word = None,
            Target::Nowhere => stream.word = Some(0),
            Target::None => (), // nothing is granted before a stream is enabled
        }
        Ok(self.dma[1].count(index))
    }

    fn serve_memory(&mut self, index: usize, done: Cycle, ram: &mut Ram) -> Modelled {
        self.move_word(index, done, ram)?;
        let stream = self.dma[1].stream_mut(index);
        let over = !stream.is_memory_to_peripheral() && stream.has_fetched_all();
        if stream.stopping || over {
            self.dma[1].switch_off(index);
            self.rewire_streams(done);
        }
        Ok(())
    }

    /// Executes the access of the memory port for stream `index`, complete from `done` on.
    #[inline(always)]
    pub(super) fn move_word(&mut self, index: usize, done: Cycle, ram: &mut Ram) -> Modelled {
        let stream = self.dma[1].stream_mut(index);
        let (address, size) = (stream.address(), stream.size());
        stream.step();
        stream.turned = done;
        // Only a stream with inverted bits leaves SRAM: see `Dma::upset`.
        if stream.is_memory_to_peripheral() {
            stream.word = Some(ram.read(address, size).unwrap_or(0));
        } else if let Some(word) = stream.word.take() {
            let _ = ram.write(address, size, word);
        }
        Ok(())
    }

    /// Updates the streams after some were switched on or off: ends those that stop and have no
    /// access in progress, and connects the others to their requests.
    pub(super) fn rewire_streams(&mut self, at: Cycle) {
        self.quiet_until = 0;
        self.listeners = [0; EVENTS];
        self.shared = [false; 2];
        for index in 0..STREAMS {
            let under_way = self
                .ports
                .iter()
                .any(|port| port.access.is_some_and(|access| access.stream == index));
            let stream = self.dma[1].stream(index);
            let keeps_word = !stream.is_memory_to_peripheral() && stream.word.is_some();
            if stream.is_enabled() && stream.stopping && !under_way && !keeps_word {
                self.dma[1].switch_off(index);
            }
            self.wire_stream(index, at);
        }
    }

    fn wire_stream(&mut self, index: usize, at: Cycle) {
        let events = self.events(index);
        let stream = self.dma[1].stream_mut(index);
        let mask = 1u8 << index;
        if stream.is_enabled() {
            let uses = |slave| stream.memory == slave || stream.far_slave() == slave;
            self.shared[0] |= uses(Slave::Sram1);
            self.shared[1] |= uses(Slave::Sram2);
        }
        if !stream.is_enabled() || stream.stopping {
            self.ports[PERIPHERAL].waiting &= !mask;
            if !stream.is_enabled() || stream.is_memory_to_peripheral() {
                self.ports[MEMORY].waiting &= !mask;
            }
            return;
        }
        for event in (0..EVENTS).filter(|event| events >> event & 1 != 0) {
            self.listeners[event] |= mask;
        }
        if stream.due != NEVER {
            self.ports[MEMORY].waiting |= mask;
        }
        // A request from before the stream was enabled.
        if self.requested & events != 0 && self.ports[PERIPHERAL].waiting & mask == 0 {
            stream.asked = at;
            self.ports[PERIPHERAL].waiting |= mask;
        }
    }
}

/// Returns a mask of the lowest `size` of a word.
const fn mask(size: Size) -> u32 {
    u32::MAX >> (32 - 8 * size.bytes())
}

/// Returns the numbers of the streams in `bits`.
fn streams(mut bits: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let index = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        index
    })
}

const NO_RAM: Unmodelled = Unmodelled("DMA2 memory outside the RAM that the simulator plays from");
