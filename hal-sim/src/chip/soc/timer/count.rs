//! Computes the cycles at which the counter counts, and the effects of counting.

use super::{IN_FORCE, Mode, Timer, WRITTEN, bit};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, refuse_if};

/// Cycles at which the counter will count: first single cycles, then an arithmetic sequence.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Ticks {
    /// Cycles of the counts whose edges are already in the synchroniser, in ascending order.
    single: Vec<Cycle>,
    /// Cycle of the next edge of the sequence that causes counts.
    next: Cycle,
    /// Cycles from one edge of the sequence to the next; 0 if there is no sequence.
    pub(crate) period: u64,
    /// Number of cycles to whose next multiple each edge is delayed; 0 for no delay.
    align: u64,
    /// Cycles from the aligned edge to its count.
    delay: u64,
    /// Cycles left until the next count when the counter was stopped.
    left: Option<u64>,
}

impl Ticks {
    /// Returns the cycle of the `n`th count from now, n ≥ 1; MAX if it never comes.
    #[inline]
    pub(super) fn at(&self, n: u64) -> Cycle {
        let index = n.saturating_sub(1);
        let singles = self.single.len() as u64;
        if index < singles {
            return self.single[index as usize];
        }
        if self.period == 0 {
            return Cycle::MAX;
        }
        let steps = (index - singles).checked_mul(self.period);
        steps
            .and_then(|s| s.checked_add(self.next))
            .map_or(Cycle::MAX, |edge| self.count_of(edge))
    }

    /// Returns the cycle at which the counter counts `edge`, after alignment and delay.
    #[inline]
    const fn count_of(&self, edge: Cycle) -> Cycle {
        let seen = match self.align {
            0 | 1 => edge,
            align => edge.next_multiple_of(align),
        };
        seen.saturating_add(self.delay)
    }

    /// Removes the counts at cycles up to `to`, and returns their number.
    #[inline]
    fn pop(&mut self, to: Cycle) -> u64 {
        let singles = self.single.iter().take_while(|&&c| c <= to).count();
        self.single.drain(..singles);
        if self.period == 0 || self.count_of(self.next) > to {
            return singles as u64;
        }
        let seen = to - self.delay;
        let edge = match self.align {
            0 | 1 => seen,
            align => seen - seen % align,
        };
        let n = (edge - self.next) / self.period + 1;
        self.next += n * self.period;
        singles as u64 + n
    }

    pub(super) const fn are_running(&self) -> bool {
        self.period != 0
    }

    pub(super) fn set(&mut self, first: Cycle, period: u64) {
        self.set_delayed(first, period, 0, 0);
    }

    /// Sets the sequence of edges from `first` on, each delayed to the next multiple of `align` and
    /// counted `delay` after that.
    pub(super) fn set_delayed(&mut self, first: Cycle, period: u64, align: u64, delay: u64) {
        (self.next, self.period) = (first, period);
        (self.align, self.delay) = (align, delay);
    }

    pub(super) fn add(&mut self, at: Cycle) {
        self.single.push(at);
    }

    /// Ends the sequence, but keeps counts whose edge came before `now`.
    pub(super) fn keep_risen_before(&mut self, now: Cycle) {
        while self.period != 0 && self.next < now {
            self.single.push(self.count_of(self.next));
            self.next += self.period;
        }
        self.period = 0;
    }

    /// Stops the clock at `done`, and stores the position of the prescaler.
    pub(super) fn stop(&mut self, done: Cycle) {
        if self.period != 0 {
            let next = self.count_of(self.next);
            self.left = Some(next.saturating_sub(done).clamp(1, self.period));
        }
        self.period = 0;
        self.single.clear();
    }

    pub(super) fn forget_place(&mut self) {
        self.left = None;
    }
}

impl Timer {
    /// Advances the counter to cycle `to`, with the flags and captures on the way.
    ///
    /// # Errors
    /// Fails at the turning point of a centre-aligned mode.
    #[inline]
    pub fn advance(&mut self, to: Cycle) -> Modelled {
        if to <= self.seen {
            return Ok(());
        }
        while let Some((at, rising)) = self.input.pop(to) {
            self.count_to(at)?;
            self.capture(rising);
        }
        if self.number == 5 {
            self.capture_lsi(to)?;
        }
        self.count_to(to)?;
        self.seen = to;
        Ok(())
    }

    pub(super) fn count_to(&mut self, to: Cycle) -> Modelled {
        if !self.is_steady() {
            let update = self.next_update();
            if update <= to {
                self.count_by(update)?;
                self.load_preloads(update);
            }
        }
        self.count_by(to)
    }

    fn count_by(&mut self, to: Cycle) -> Modelled {
        if self.ticks.at(1) > to {
            return Ok(());
        }
        let (trigger, armed) = (self.next_match(2), self.has_armed_trigger());
        let n = self.ticks.pop(to);
        let rises = self.raises_flags(n)?;
        for channel in 0..4 {
            let distance = self.counts_until(self.ccr[channel]);
            if self.is_input(channel) || distance.is_none_or(|distance| distance > n) {
                continue;
            }
            self.sr |= if rises { bit::CC1IF << channel } else { 0 };
            self.reference[channel] = match self.mode(channel) {
                Ok(Mode::ActiveOnMatch) => true,
                Ok(Mode::InactiveOnMatch) => false,
                Ok(Mode::Toggle) => !self.reference[channel],
                _ => self.reference[channel],
            };
            if channel == 2 && armed {
                self.rises.push(trigger);
            }
        }
        if n >= self.counts_to_update() && self.cr1 & bit::UDIS == 0 {
            self.sr |= bit::UIF;
            for channel in 0..4 {
                if self.is_preloaded(channel) {
                    self.ccr[channel] = self.preload[channel];
                }
            }
        }
        self.count = self.counter_after(n);
        self.capture_trigger(n);
        Ok(())
    }

    /// Loads the written prescaler and auto-reload value, as an update does.
    fn load_preloads(&mut self, update: Cycle) {
        if self.cr1 & bit::OPM != 0 {
            self.cr1 &= !bit::CEN;
            self.ticks.stop(update);
            self.ticks.forget_place();
        }
        if self.cr1 & bit::UDIS != 0 {
            return;
        }
        self.arr[IN_FORCE] = self.arr[WRITTEN];
        if self.psc[IN_FORCE] != self.psc[WRITTEN] {
            self.psc[IN_FORCE] = self.psc[WRITTEN];
            if self.ticks.are_running() && !self.is_slave() && !self.is_halted() {
                let period = self.tick_period();
                self.ticks.set(update + period, period);
            }
        }
    }

    /// Returns the number of counts until the counter becomes `value`, at least 1; `None` if never.
    #[inline]
    pub(super) fn counts_until(&self, value: u32) -> Option<u64> {
        let arr = self.arr[IN_FORCE];
        if value > arr {
            return None;
        }
        let (from, to) = (u64::from(self.count), u64::from(value));
        Some(match self.counts_down() {
            true if to < from => from - to,
            true => self.counts_to_update() + u64::from(arr - value),
            false if to > from => to - from,
            false => self.counts_to_update() + to,
        })
    }

    /// Returns the number of counts until an overflow or underflow. An up-counter restarts after it
    /// equals the auto-reload value; a counter already beyond that value counts to its own maximum.
    #[inline]
    pub(super) fn counts_to_update(&self) -> u64 {
        let (arr, count) = (self.arr[IN_FORCE], self.count);
        if self.counts_down() {
            return u64::from(count) + 1;
        }
        let end = if count > arr { self.top() } else { arr };
        u64::from(end - count) + 1
    }

    /// Returns the counter after `n` counts.
    #[inline]
    fn counter_after(&self, n: u64) -> u32 {
        let (arr, update) = (u64::from(self.arr[IN_FORCE]), self.counts_to_update());
        let lap = arr + 1;
        // All below 2^32: a count, or the remainder of a division by lap.
        match (self.counts_down(), n < update) {
            (false, true) => self.count + n as u32,
            (false, false) => ((n - update) % lap) as u32,
            (true, true) => self.count - n as u32,
            (true, false) => (arr - (n - update) % lap) as u32,
        }
    }

    /// Returns whether matches in the next `n` counts set flags; in a centre-aligned mode, that
    /// depends on the direction (RM0090 17.4.1).
    ///
    /// # Errors
    /// Fails if the counter reaches the turning point of a centre-aligned mode.
    fn raises_flags(&self, n: u64) -> Modelled<bool> {
        let mode = (self.cr1 & bit::CMS) >> 5;
        refuse_if(
            mode != 0 && n + 1 >= self.counts_to_update(),
            "a direction change of a centre-aligned timer",
        )?;
        Ok(match mode {
            1 => self.counts_down(),
            2 => !self.counts_down(),
            _ => true,
        })
    }

    /// Returns DIR: whether the counter runs from the auto-reload value to 0 (RM0090 17.4.1).
    #[inline]
    pub(super) const fn counts_down(&self) -> bool {
        self.cr1 & bit::DIR != 0
    }

    pub(super) fn tick_period(&self) -> u64 {
        self.divider * (u64::from(self.psc[IN_FORCE]) + 1) * u64::from(self.arrives.max(1))
    }

    /// Starts the internal clock if the counter is enabled and not a slave. The counter enable
    /// follows CEN by one timer clock (RM0090 18.3.1), and the first count comes one count period
    /// after that.
    pub(super) fn restart(&mut self, done: Cycle) {
        let is_blocked = self.arr[IN_FORCE] == 0; // RM0090 18.4.12
        let stands = self.is_slave() || self.is_halted() || self.arrives == 0;
        if self.cr1 & bit::CEN == 0 || stands || is_blocked {
            return;
        }
        let period = self.tick_period();
        let left = self.ticks.left.take().unwrap_or(period).min(period);
        let enabled = done.next_multiple_of(self.divider) + self.divider;
        self.ticks
            .set((enabled + left).next_multiple_of(self.divider), period);
    }
}
