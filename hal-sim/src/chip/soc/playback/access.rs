//! Accesses of the core, and the connections that a register write changes.

use super::requests::Requests;
use super::{MEMORY, PERIPHERAL, Playback};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, ReadResult, refuse_if};
use crate::chip::soc::dma::{NEVER, STREAMS, tim1_events};
use crate::chip::soc::matrix::{Bridge, Master, Slave};
use crate::chip::soc::{Lanes, Ram};

/// A block of registers that belongs to `Playback`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// TIM1–TIM5, by number.
    Timer(u8),
    /// DMA controller 1.
    Dma1,
    /// DMA controller 2.
    Dma2,
    /// A port; 0 is A.
    Gpio(usize),
}

impl Block {
    /// Returns the index of timer `number`; a number outside 1–5 counts as the nearest.
    pub(super) fn timer_index(number: u8) -> usize {
        usize::from(number.clamp(1, 5)) - 1
    }

    const fn bridge(self) -> Bridge {
        match self {
            Self::Timer(1) => Bridge::Apb2,
            Self::Timer(_) => Bridge::Apb1,
            _ => Bridge::None,
        }
    }
}

impl Playback {
    /// Reads the register at `offset` of `block`, a multiple of 4, for the core, whose data phase
    /// begins at `at`.
    pub fn read(
        &mut self,
        block: Block,
        offset: u32,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled<ReadResult> {
        let wait = self.access_slave(Slave::Ahb1, block.bridge(), at, ram)?;
        let done = at + Cycle::from(wait) + 1;
        let value = match block {
            Block::Timer(n) => {
                let timer = &mut self.timers[Block::timer_index(n)];
                let before = timer.next_event();
                let value = timer.read(offset, done)?;
                if timer.next_event() != before {
                    self.update_timer_event();
                }
                value
            }
            Block::Dma1 => self.dma[0].read(offset)?,
            Block::Dma2 => self.dma[1].read(offset)?,
            Block::Gpio(port) => self.gpio.read(port, offset)?,
        };
        Ok(ReadResult { value, wait })
    }

    /// Writes the register at `offset` for the core, and returns the wait states. Only ports accept
    /// parts of a word.
    pub fn write(
        &mut self,
        block: Block,
        offset: u32,
        written: Lanes,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled<u32> {
        let wait = self.access_slave(Slave::Ahb1, block.bridge(), at, ram)?;
        let done = at + Cycle::from(wait) + 1;
        let value = written.value;
        match block {
            Block::Timer(1) => {
                self.timers[0].advance(done - 1)?;
                let before = self.timers[0].trigger_level();
                self.timers[0].write(offset, value, done)?;
                if !before && self.timers[0].trigger_level() {
                    self.timers[1].advance(done - 1)?;
                    self.timers[1].trigger(done);
                }
                self.link(done)?;
            }
            Block::Timer(n) => {
                self.timers[Block::timer_index(n)].write(offset, value, done)?;
                if n == 2 {
                    self.link_trigger(done)?;
                }
                self.update_timer_event();
            }
            Block::Dma1 => self.dma[0].write(offset, value, done)?,
            Block::Dma2 => {
                self.dma[1].write(offset, value, done)?;
                self.rewire_streams(done);
            }
            Block::Gpio(port) => {
                self.gpio.write(port, offset, written, done)?;
                if port == 0 {
                    self.feed_capture(done)?;
                }
            }
        }
        Ok(wait)
    }

    /// Performs the core's access to any block that shares a slave with this module: SRAM1 or SRAM2
    /// while [`Self::is_shared`] returns true, and everything on AHB1, APB1, APB2. The data phase
    /// begins at `at`. Executes everything before its end, then returns its wait states.
    pub fn access_slave(
        &mut self,
        slave: Slave,
        bridge: Bridge,
        at: Cycle,
        ram: &mut Ram,
    ) -> Modelled<u32> {
        self.run(at, at, ram)?;
        // Both request in the same cycle: the core waits if it was the slave's last master.
        if self.matrix.last_master(slave) == Master::Core {
            for port in [PERIPHERAL, MEMORY] {
                if let Some(access) = self.ports[port].access
                    && access.slave == slave
                    && self.matrix.ready_at(slave, access.want) <= self.matrix.ready_at(slave, at)
                {
                    self.serve(port, ram)?;
                    break;
                }
            }
        }
        let done = self.matrix.grant_core(slave, bridge, at);
        self.run(done, done, ram)?;
        Ok((done - at - 1) as u32) // some tens at most
    }

    /// Returns whether an enabled stream uses `slave`, so that the core must use
    /// [`Self::access_slave`] for its accesses. This varies for SRAM only; AHB1 is always shared.
    #[inline]
    pub const fn is_shared(&self, slave: Slave) -> bool {
        match slave {
            Slave::Sram1 => self.shared[0],
            Slave::Sram2 => self.shared[1],
            Slave::Ahb1 => true,
        }
    }

    /// Updates everything that depends on a timer that changed at `done`: the connection from TIM1
    /// to TIM2, TIM1's requests, and the predicted events.
    pub(super) fn link(&mut self, done: Cycle) -> Modelled {
        self.link_trigger(done)?;
        self.update_timer_event();
        self.link_requests()
    }

    fn link_trigger(&mut self, done: Cycle) -> Modelled {
        let [tim1, tim2, ..] = &mut self.timers;
        tim1.advance(done.saturating_sub(1))?;
        // Nothing changes until a preload takes effect, which happens with an edge of the trigger.
        if tim2.is_slave() && (tim1.is_steady() || !tim1.is_running()) {
            tim2.advance(done.saturating_sub(1))?;
            let edges = tim1.trigger_edges(tim2.divider)?;
            tim2.follow(edges, done)?;
        }
        Ok(())
    }

    /// Updates the times of TIM1's DMA requests. TIM1 must have been advanced before.
    fn link_requests(&mut self) -> Modelled {
        let tim1 = &self.timers[0];
        let is_steady = tim1.is_steady() || !tim1.is_running();
        self.update = if is_steady { NEVER } else { tim1.next_update() };
        let enabled = tim1.requests_enabled();
        self.quiet_until = 0;
        self.requests = Requests::NONE;
        self.requested &= enabled as u8; // five bits
        self.drop_unrequested();
        if enabled == 0 {
            return Ok(());
        }
        let tim1 = &self.timers[0];
        refuse_if(
            tim1.is_centre_aligned() && tim1.is_running(),
            "DMA requests of a centre-aligned TIM1",
        )?;
        let due = std::array::from_fn(|event| match event {
            _ if enabled >> event & 1 == 0 => NEVER,
            0 => tim1.next_update(),
            _ if tim1.requests_at_updates() => tim1.next_update(),
            channel => tim1.next_match(channel - 1),
        });
        self.requests = Requests::new(due, tim1.lap());
        Ok(())
    }

    /// Removes streams without a request from those that wait for the peripheral port.
    fn drop_unrequested(&mut self) {
        for stream in 0..STREAMS {
            if self.events(stream) & self.requested == 0 {
                self.ports[PERIPHERAL].waiting &= !(1 << stream);
            }
        }
    }

    pub(super) fn events(&self, stream: usize) -> u8 {
        tim1_events(stream, self.dma[1].stream(stream).channel()).unwrap_or(0)
    }

    /// Updates the input of TIM2's channel 1 from PA0, PA5 or PA15, whichever has AF1 (DS8626 table
    /// 9).
    pub(super) fn feed_capture(&mut self, at: Cycle) -> Modelled {
        let high = [0, 5, 15]
            .into_iter()
            .any(|pin| self.gpio.has_function(0, pin, 1) && self.gpio.level(0, pin));
        if high != self.capture_input {
            self.capture_input = high;
            self.timers[1].set_input(high, at)?;
            self.update_timer_event();
        }
        Ok(())
    }
}
