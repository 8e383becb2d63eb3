//! Models TIM1–TIM5 (RM0090 chapters 17, 18): time base, compare, filtered capture, DMA requests,
//! trigger output, external clock mode 1 and trigger mode.
//!
//! The state is evaluated lazily: `count` is valid up to and including cycle `seen`, and the counts
//! after that are an arithmetic sequence. `registers` is the register interface, `count` the
//! sequence, `capture` the filtered input; this module has the state visible to other blocks.
//! `playback` connects TIM1's edges to TIM2 and DMA2.
//!
//! Convention: an event at cycle c is the clock edge that begins c; a write that is complete from c
//! on takes effect at that edge, before its events.

mod capture;
mod count;
mod registers;
mod trigger;

use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};
use capture::{Capture, Channel4};
use count::Ticks;
pub(crate) use registers::bit;
#[cfg(test)]
pub(crate) use registers::offset;

/// Injected fault in the clock of a timer, independent of the registers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Clocking {
    /// The clock is stopped.
    Stands,
    /// Only every n-th edge arrives.
    Every(u32),
}

/// Timer clocks from a sampled trigger edge to the count it causes. RM0090 18.3.3 shows a
/// resynchronisation stage and no figure: assumed.
pub const TRIGGER_SYNCHRONISATION: u64 = 2;

/// Modelled output compare modes (CCMR OCxM, RM0090 18.4.7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Frozen,
    ActiveOnMatch,
    InactiveOnMatch,
    Toggle,
    ForceInactive,
    ForceActive,
    Pwm1,
}

/// One timer. Cycles are HCLK; a timer clock lasts `divider` of them.
#[derive(Clone, PartialEq, Debug)]
pub struct Timer {
    /// Number of the timer, 1–5.
    number: u8,
    /// HCLK cycles per timer clock.
    pub(crate) divider: u64,
    seen: Cycle,
    ticks: Ticks,
    count: u32,
    cr1: u32,
    cr2: u32,
    smcr: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 2],
    ccer: u32,
    /// Prescaler: the value written (index `WRITTEN`) and the value in force (index `IN_FORCE`).
    psc: [u32; 2],
    /// Auto-reload value: the value written and the value in force, as in `psc`.
    arr: [u32; 2],
    ccr: [u32; 4],
    /// CCR values written while OCxPE delays them until an update.
    preload: [u32; 4],
    /// Levels of OC1REF to OC4REF in the output modes that keep a level until a match or a command.
    reference: [bool; 4],
    /// Cycles at which OC3REF, selected as TRGO, rose (TIM2: the ADC's trigger).
    pub(crate) rises: Vec<Cycle>,
    input: Capture,
    /// Injected fault: number of clock or trigger edges of which one arrives; 0 if none does.
    arrives: u32,
    /// Value that a read of ARR returns, if an injected fault makes it differ from the value in
    /// force.
    shown: Option<u32>,
    channel_4: Channel4,
}

/// Index of the value written, in `Timer::psc` and `Timer::arr`.
const WRITTEN: usize = 0;
/// Index of the value in force, in `Timer::psc` and `Timer::arr`.
const IN_FORCE: usize = 1;

/// Returns the maximum count of timer `number`: 2 and 5 have 32 bits.
const fn top(number: u8) -> u32 {
    match number {
        2 | 5 => u32::MAX,
        _ => 0xFFFF,
    }
}

impl Timer {
    /// Creates timer `number`, 1–5, in its reset state, clocked by HCLK.
    pub fn new(number: u8) -> Self {
        let top = top(number);
        Self {
            number,
            divider: 1,
            seen: 0,
            ticks: Ticks::default(),
            count: 0,
            cr1: 0,
            cr2: 0,
            smcr: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 2],
            ccer: 0,
            psc: [0; 2],
            arr: [top; 2],
            ccr: [0; 4],
            preload: [0; 4],
            reference: [false; 4],
            rises: Vec::new(),
            input: Capture::default(),
            arrives: 1,
            shown: None,
            channel_4: Channel4::default(),
        }
    }

    /// Resets the registers (RCC_APBxRSTR) at `done`. The input level, the LSI and the clock stay.
    pub fn reset(&mut self, done: Cycle) {
        *self = Self {
            divider: self.divider,
            seen: done.saturating_sub(1).max(self.seen),
            input: self.input.clone(),
            arrives: self.arrives,
            channel_4: self.channel_4.reset(),
            ..Self::new(self.number)
        };
    }

    /// Sets the HCLK cycles per timer clock, at least 1 (RCC_CFGR PPRE), from `done` on.
    pub fn set_divider(&mut self, divider: u32, done: Cycle) -> Modelled {
        let divider = u64::from(divider.max(1));
        if divider != self.divider {
            self.advance(done.saturating_sub(1))?;
            self.divider = divider;
            self.ticks.stop(done);
            self.restart(done);
        }
        Ok(())
    }

    /// Returns the levels of TIM1's interrupt lines: update, then capture/compare.
    pub const fn interrupt_parts(&self) -> [bool; 2] {
        let active = self.sr & self.dier & bit::INTERRUPTS;
        [active & bit::UIE != 0, active & !bit::UIE != 0]
    }

    /// Returns the level of the interrupt line of TIM2–5.
    #[inline]
    pub fn interrupt(&self) -> bool {
        // In a slave that counts edges, each edge sets TIF.
        let triggered = self.dier & bit::TIE != 0 && self.is_slave() && self.ticks.are_running();
        self.sr & self.dier & bit::INTERRUPTS != 0 || triggered
    }

    /// Returns the earliest cycle at which the interrupt line or an enabled trigger output may rise
    /// if no register changes.
    pub fn next_event(&self) -> Cycle {
        let mut next = Cycle::MAX;
        let waiting = self.dier & !self.sr & bit::INTERRUPTS;
        let armed = self.has_armed_trigger();
        if waiting == 0 && !armed {
            return next;
        }
        if !self.is_steady() {
            next = self.next_update(); // later events are not known yet
        }
        if waiting & bit::UIE != 0 {
            next = next.min(self.next_update());
        }
        for channel in 0..4 {
            if waiting & bit::CC1IE << channel != 0 {
                next = next.min(if channel == 0 && self.captures_trigger() {
                    self.ticks.at(1)
                } else if self.is_input(channel) {
                    self.input.due()
                } else {
                    self.next_match(channel)
                });
            }
        }
        if armed {
            next = next.min(self.next_match(2));
        }
        next
    }

    /// Returns the next cycle after `seen` at which the counter overflows.
    pub fn next_update(&self) -> Cycle {
        self.ticks.at(self.counts_to_update())
    }

    /// Returns the next cycle after `seen` at which the counter becomes CCR of `channel` (0–3),
    /// whether or not an interrupt or request is enabled; MAX if the channel is an input.
    pub fn next_match(&self, channel: usize) -> Cycle {
        match self.counts_until(self.ccr[channel]) {
            Some(distance) if !self.is_input(channel) => self.ticks.at(distance),
            _ => Cycle::MAX,
        }
    }

    /// Returns the HCLK cycles from one overflow to the next.
    pub fn lap(&self) -> u64 {
        self.ticks.period * (u64::from(self.arr[IN_FORCE]) + 1)
    }

    /// Returns whether the counter counts edges of its clock or, as a slave, of its trigger.
    pub const fn is_running(&self) -> bool {
        self.ticks.are_running()
    }

    /// Returns whether prescaler and period stay as they are until a register is written: neither
    /// waits for an update, and one-pulse mode is off.
    pub fn is_steady(&self) -> bool {
        self.psc[WRITTEN] == self.psc[IN_FORCE]
            && self.arr[WRITTEN] == self.arr[IN_FORCE]
            && self.cr1 & bit::OPM == 0
    }

    /// Returns the enabled DMA requests: bit 0 update, bits 1–4 the channels.
    pub const fn requests_enabled(&self) -> u32 {
        self.dier >> 8 & 0x1F
    }

    /// Returns whether CMS selects counting up and down (RM0090 17.4.1).
    pub const fn is_centre_aligned(&self) -> bool {
        self.cr1 & bit::CMS != 0
    }

    /// Returns CCDS: whether channels request DMA at updates instead of matches.
    pub const fn requests_at_updates(&self) -> bool {
        self.cr2 & bit::CCDS != 0
    }

    /// Returns whether this timer counts edges of ITR0, which is TIM1 for TIM2 (external clock mode
    /// 1, table 95).
    pub const fn is_slave(&self) -> bool {
        self.number == 2 && self.smcr & 0x77 == 0b111 && self.smcr & bit::ECE == 0
    }

    /// Returns whether edges of TIM1's trigger set CEN of this timer (trigger mode), which then
    /// counts its own clock.
    pub const fn is_started(&self) -> bool {
        self.number == 2 && self.smcr & 0x77 == 0b110 && self.smcr & bit::ECE == 0
    }

    /// Returns whether the timer waits for a signal that never comes in this model: inputs of
    /// encoder modes, ETR, or a trigger other than TIM1's, as a clock or as a gate.
    pub const fn is_halted(&self) -> bool {
        let mode = self.smcr & 0b111;
        !self.is_slave() && (self.smcr & bit::ECE != 0 || matches!(mode, 1..=3 | 5 | 7))
    }

    /// Counts an edge of the trigger that rose at `edge` outside the sequence passed to
    /// [`Self::follow`], if the timer is a counting slave.
    pub fn trigger(&mut self, edge: Cycle) {
        if self.is_slave() && self.cr1 & bit::CEN != 0 {
            let tick = self.synchronised(edge);
            self.ticks.add(tick);
        }
    }

    /// Sets the future edges of a slave's trigger to `edges`: cycle of the first edge, and cycles
    /// from one edge to the next. Edges before `now` that are not counted yet are kept.
    ///
    /// # Errors
    /// Fails if the slave has a prescaler.
    pub fn follow(&mut self, edges: Option<(Cycle, u64)>, now: Cycle) -> Modelled {
        if !self.is_slave() {
            return Ok(());
        }
        if self.psc[IN_FORCE] != 0 {
            return Err(Unmodelled(
                "a prescaler of a timer that counts trigger edges",
            ));
        }
        self.ticks.keep_risen_before(now);
        if let Some((first, distance)) = edges
            && self.cr1 & bit::CEN != 0
            && self.arrives != 0
        {
            let distance = distance * u64::from(self.arrives);
            let delay = TRIGGER_SYNCHRONISATION * self.divider;
            self.ticks.set_delayed(first, distance, self.divider, delay);
        }
        Ok(())
    }

    /// Returns the cycle at which an edge at `edge` is counted.
    fn synchronised(&self, edge: Cycle) -> Cycle {
        edge.next_multiple_of(self.divider) + TRIGGER_SYNCHRONISATION * self.divider
    }

    /// Injects a fault into the timer's clock, or its trigger if it is a slave, from `at` on. The
    /// caller must update the connections of the timer.
    ///
    /// # Errors
    /// Fails like [`Self::advance`].
    pub fn misclock(&mut self, clocking: Clocking, at: Cycle) -> Modelled {
        self.advance(at.saturating_sub(1))?;
        self.arrives = match clocking {
            Clocking::Stands => 0,
            Clocking::Every(n) => n.max(1),
        };
        if !self.is_slave() {
            self.ticks.stop(at);
            self.restart(at);
        }
        Ok(())
    }

    /// Makes the timer overflow every `counts` counts, at least 2, regardless of ARR, until ARR is
    /// written.
    ///
    /// # Errors
    /// Fails if the timer has already counted further.
    pub fn misreload(&mut self, counts: u32) -> Modelled {
        let last = counts.max(2) - 1;
        refuse_if(
            self.count > last,
            "an injected reload value below the present count of the timer",
        )?;
        self.shown = Some(self.shown.unwrap_or(self.arr[WRITTEN]));
        self.arr = [last; 2];
        Ok(())
    }

    /// Processes a change of the input of channel 1 to `high` at `at`.
    pub fn set_input(&mut self, high: bool, at: Cycle) -> Modelled {
        self.advance(at.saturating_sub(1))?;
        let filter = self.filter_clocks();
        self.input.set(high, at, self.divider, filter);
        Ok(())
    }

    fn has_armed_trigger(&self) -> bool {
        let rises = matches!(self.mode(2), Ok(Mode::ActiveOnMatch | Mode::Toggle));
        self.cr2 >> 4 & 0b111 == 6 && rises && !self.reference[2]
    }

    const fn top(&self) -> u32 {
        top(self.number)
    }

    /// Returns whether writes to CCR of `channel` wait for an update.
    fn is_preloaded(&self, channel: usize) -> bool {
        let field = self.ccmr[channel / 2] >> (8 * (channel % 2));
        field & (0b11 | bit::OCPE) == bit::OCPE
    }

    fn is_input(&self, channel: usize) -> bool {
        self.ccmr[channel / 2] >> (8 * (channel % 2)) & 0b11 != 0
    }

    fn mode(&self, channel: usize) -> Modelled<Mode> {
        match self.ccmr[channel / 2] >> (8 * (channel % 2) + 4) & 0b111 {
            0 => Ok(Mode::Frozen),
            1 => Ok(Mode::ActiveOnMatch),
            2 => Ok(Mode::InactiveOnMatch),
            3 => Ok(Mode::Toggle),
            4 => Ok(Mode::ForceInactive),
            5 => Ok(Mode::ForceActive),
            6 => Ok(Mode::Pwm1),
            _ => Err(Unmodelled("an output compare mode (CCMR.OCM)")),
        }
    }

    fn level(&self, channel: usize) -> bool {
        match self.mode(channel) {
            Ok(Mode::Pwm1) if self.counts_down() => self.count <= self.ccr[channel],
            Ok(Mode::Pwm1) => self.count < self.ccr[channel],
            _ => self.reference[channel],
        }
    }
}

#[cfg(test)]
mod tests;
