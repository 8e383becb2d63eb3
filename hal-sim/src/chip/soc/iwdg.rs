//! Models the independent watchdog (RM0090 chapter 21).
//!
//! Assumed: the prescaler runs freely, so that the first count after a reload may be shorter; a new
//! prescaler or reload value takes effect five LSI cycles after its write.

use super::clock::{Oscillator, cycles_in};
use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

/// LSI start-up, 15 µs typical (DS8626, LSI oscillator characteristics).
const LSI_START_NS: u64 = 15_000;
/// LSI cycles until PVU or RVU clears (section 21.4.4).
const UPDATE_TICKS: u64 = 5;
const RESET_RELOAD: u32 = 0xFFF;

/// A register whose new value is being transferred into the LSI's clock domain.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Synchronized {
    value: u32,
    pending: Option<(u32, u64)>,
}

impl Synchronized {
    const fn new(value: u32) -> Self {
        Self {
            value,
            pending: None,
        }
    }

    /// Returns the value that software reads: the one written last.
    fn last_written(&self) -> u32 {
        self.pending.map_or(self.value, |(value, _)| value)
    }

    /// Applies a pending value that is due at `tick`, and returns whether the value changed.
    fn arrive(&mut self, tick: u64) -> bool {
        match self.pending {
            Some((value, due)) if due <= tick => {
                self.value = value;
                self.pending = None;
                true
            }
            _ => false,
        }
    }
}

/// Running counter: `count` at tick `since`, decremented at each tick that is a multiple of the
/// prescaler.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Counter {
    count: u64,
    since: u64,
}

/// Independent watchdog, which requests a reset of the chip if its counter is not reloaded in time.
#[derive(Clone, PartialEq, Debug)]
pub struct Iwdg {
    lsi_hz: u32,
    core_hz: u32,
    unlocked: bool,
    prescaler: Synchronized,
    reload: Synchronized,
    /// LSI and counter, which run once the watchdog was started.
    running: Option<(Oscillator, Counter)>,
    /// LSI tick at which a debugger stopped the counter; `None` while the counter runs.
    held_at: Option<u64>,
    /// Whether the watchdog requests a reset of the chip.
    pub(crate) bitten: bool,
}

impl Iwdg {
    /// Creates a watchdog in its reset state with an LSI of `lsi_hz`: 32 kHz typical, 17–47 kHz
    /// (DS8626).
    pub const fn new(lsi_hz: u32) -> Self {
        Self {
            lsi_hz,
            core_hz: super::rcc::HSI_HZ,
            unlocked: false,
            prescaler: Synchronized::new(0),
            reload: Synchronized::new(RESET_RELOAD),
            running: None,
            held_at: None,
            bitten: false,
        }
    }

    /// Stops the watchdog until it is started again, as a system reset does.
    pub fn reset(&mut self) {
        *self = Self {
            core_hz: self.core_hz,
            ..Self::new(self.lsi_hz)
        };
    }

    /// Sets the core clock to `hz` from cycle `at` on.
    pub fn set_hz(&mut self, hz: u32, at: Cycle) {
        self.core_hz = hz;
        if let Some((lsi, _)) = &mut self.running {
            lsi.set_core_hz(hz, at);
        }
    }

    /// Sets the frequency of the LSI oscillator to `hz` from cycle `at` on.
    pub fn set_lsi_hz(&mut self, hz: u32, at: Cycle) {
        self.lsi_hz = hz;
        if let Some((lsi, _)) = &mut self.running {
            lsi.set_hz(hz, at);
        }
    }

    /// Halts or resumes the counter at `at` (DBGMCU_APB1_FZ while the core is halted).
    pub fn hold(&mut self, held: bool, at: Cycle) {
        let Some((lsi, counter)) = &mut self.running else {
            return;
        };
        let tick = lsi.ticks(at);
        match (held, self.held_at.take()) {
            (true, None) => self.held_at = Some(tick),
            (true, since) => self.held_at = since,
            (false, Some(since)) => counter.since += tick - since,
            (false, None) => {}
        }
    }

    /// Returns the cycle of the reset if the counter is not reloaded; `Cycle::MAX` before the
    /// watchdog is started and while the counter is halted.
    pub fn reset_cycle(&self) -> Cycle {
        let running = self.running.as_ref().filter(|_| self.held_at.is_none());
        running.map_or(Cycle::MAX, |(lsi, counter)| {
            let divider = self.divider();
            // The counter passes 0 at the next multiple of the divider.
            let last = counter.since / divider + counter.count + 1;
            lsi.cycle_of(last * divider)
        })
    }

    /// Returns the LSI cycles per count: 4, 8, …, 256.
    fn divider(&self) -> u64 {
        4 << self.prescaler.value.min(6)
    }

    /// Starts the counter from 0xFFF, regardless of the reload value (section 21.3).
    fn start(&mut self, at: Cycle) {
        if self.running.is_none() {
            let first = at.saturating_add(cycles_in(LSI_START_NS, self.core_hz));
            let counter = Counter {
                count: u64::from(RESET_RELOAD),
                since: 0,
            };
            let lsi = Oscillator::new(self.lsi_hz, self.core_hz, first);
            self.running = Some((lsi, counter));
        }
    }

    fn refresh(&mut self, at: Cycle) {
        if let Some((lsi, counter)) = &mut self.running {
            *counter = Counter {
                count: u64::from(self.reload.value),
                since: lsi.ticks(at),
            };
        }
    }

    fn schedule(&mut self, value: u32, at: Cycle, reload: bool) -> Modelled {
        if !self.unlocked {
            return Ok(());
        }
        let Some((lsi, _)) = &self.running else {
            return Err(Unmodelled(
                "IWDG: a setting written before the watchdog is started",
            ));
        };
        let due = lsi.ticks(at) + UPDATE_TICKS;
        let register = if reload {
            &mut self.reload
        } else {
            &mut self.prescaler
        };
        refuse_if(
            register.pending.is_some(),
            "IWDG: written while PVU or RVU is set",
        )?;
        register.pending = Some((value, due));
        Ok(())
    }

    /// Applies the pending values that are due at LSI tick `tick`. With a new prescaler the counter
    /// continues from its present count.
    fn arrive(&mut self, tick: u64) {
        let old = self.divider();
        let due = self.prescaler.pending.map_or(tick, |(_, due)| due);
        if self.prescaler.arrive(tick)
            && let Some((_, counter)) = &mut self.running
        {
            let counted = due / old - counter.since / old;
            *counter = Counter {
                count: counter.count.saturating_sub(counted),
                since: due,
            };
        }
        self.reload.arrive(tick);
    }
}

impl Peripheral for Iwdg {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        let word = match offset {
            0x0 => 0,
            0x4 => self.prescaler.last_written(),
            0x8 => self.reload.last_written(),
            0xC => {
                let busy = |register: &Synchronized| u32::from(register.pending.is_some());
                busy(&self.prescaler) | busy(&self.reload) << 1
            }
            _ => return Err(Unmodelled("IWDG register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        match offset {
            0x0 => {
                let key = value & 0xFFFF;
                self.unlocked = key == 0x5555;
                match key {
                    0xAAAA => self.refresh(at),
                    0xCCCC => self.start(at),
                    _ => {}
                }
            }
            0x4 => self.schedule(value & 7, at, false)?,
            0x8 => self.schedule(value & 0xFFF, at, true)?,
            0xC => {}
            _ => return Err(Unmodelled("IWDG register")),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        if let Some((lsi, _)) = &self.running {
            let tick = lsi.ticks(to);
            if self.prescaler.pending.is_some() || self.reload.pending.is_some() {
                self.arrive(tick);
            }
            self.bitten |= self.reset_cycle() <= to;
        }
        Ok(())
    }

    /// Returns the cycle of the reset, or of the arrival of a new prescaler, which changes that
    /// cycle.
    fn next_event(&self) -> Cycle {
        if self.bitten {
            return Cycle::MAX; // until the requested reset
        }
        let arrival = match (&self.running, self.prescaler.pending) {
            (Some((lsi, _)), Some((_, due))) => lsi.cycle_of(due),
            _ => Cycle::MAX,
        };
        self.reset_cycle().min(arrival)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    const KR: u32 = 0;
    const PR: u32 = 4;
    const RLR: u32 = 8;
    const SR: u32 = 0xC;
    /// Core cycles of one LSI cycle at 32 kHz and 16 MHz.
    const TICK: Cycle = 500;
    /// Cycle of LSI tick 0: 15 µs.
    const FIRST: Cycle = 240;

    /// Settings of the board: start, unlock, divide by 4, 49 counts.
    fn board(lsi_hz: u32) -> Iwdg {
        let mut iwdg = Iwdg::new(lsi_hz);
        iwdg.set(KR, 0xCCCC, 0);
        iwdg.set(KR, 0x5555, 10);
        iwdg.set(PR, 0, 20);
        iwdg.set(RLR, 48, 30);
        iwdg
    }

    #[test]
    fn it_stands_until_started_and_bites_after_the_longest_time() {
        let mut iwdg = Iwdg::new(32_000);
        assert_eq!(iwdg.next_event(), Cycle::MAX);
        iwdg.set(KR, 0xCCCC, 0);
        // Table: 512 ms at /4 and RL 0xFFF.
        let bite = FIRST + 4096 * 4 * TICK;
        assert_eq!(iwdg.next_event(), bite);
        iwdg.advance(bite - 1).unwrap();
        assert!(!iwdg.bitten);
        iwdg.advance(bite).unwrap();
        assert!(iwdg.bitten);
        iwdg.reset();
        assert!(!iwdg.bitten);
        assert_eq!(iwdg.next_event(), Cycle::MAX);
    }

    #[test]
    fn new_values_arrive_after_five_lsi_cycles() {
        let mut iwdg = board(32_000);
        assert_eq!(iwdg.get(SR, 40), 3);
        assert_eq!(iwdg.get(RLR, 40), 48);
        let arrival = FIRST + 5 * TICK;
        assert_eq!(iwdg.get(SR, arrival - 1), 3);
        assert_eq!(iwdg.get(SR, arrival), 0);
        assert!(iwdg.reset_cycle() > 500_000, "not reloaded yet");
        iwdg.set(KR, 0xAAAA, arrival + 10);
        // Tick 5 lies in count 1, so 49 counts end with tick 4 * 50.
        assert_eq!(iwdg.reset_cycle(), FIRST + 200 * TICK);
    }

    #[test]
    fn feeding_moves_the_bite() {
        let mut iwdg = board(32_000);
        let mut at = 10_000;
        for _ in 0..100 {
            iwdg.set(KR, 0xAAAA, at);
            let wait = iwdg.reset_cycle() - at;
            assert!((48 * 4 * TICK..=49 * 4 * TICK).contains(&wait), "{wait}");
            at += 50_001;
        }
        assert!(!iwdg.bitten);
    }

    #[test]
    fn it_bites_within_4_and_12_ms_over_the_tolerance_of_the_lsi() {
        for lsi_hz in [17_000, 32_000, 47_000] {
            let mut iwdg = board(lsi_hz);
            for n in 0..50 {
                let at = 20_000 + n * 1234;
                iwdg.set(KR, 0xAAAA, at);
                let us = (iwdg.reset_cycle() - at) / 16;
                assert!((4_000..12_000).contains(&us), "{lsi_hz} Hz: {us} us");
            }
        }
    }

    #[test]
    fn registers_are_locked_but_for_the_key() {
        let mut iwdg = Iwdg::new(32_000);
        iwdg.set(KR, 0xCCCC, 0);
        iwdg.set(RLR, 1, 0);
        assert_eq!(iwdg.get(RLR, 1), 0xFFF);
        iwdg.set(KR, 0x5555, 2);
        iwdg.set(KR, 0xAAAA, 3);
        iwdg.set(PR, 1, 4);
        assert_eq!(iwdg.get(PR, 5), 0);
    }

    #[test]
    fn the_prescaler_slows_what_is_left() {
        let mut iwdg = board(32_000);
        iwdg.set(KR, 0xAAAA, 10_000);
        iwdg.set(KR, 0x5555, 10_000);
        let tick = (10_000 - FIRST) / TICK; // 19: count 4 of the prescaler
        iwdg.set(PR, 2, 10_000);
        let due = FIRST + (tick + 5) * TICK; // tick 24: two counts later
        assert_eq!(iwdg.next_event(), due);
        iwdg.advance(due).unwrap();
        // 46 counts of 16 are left, and the current one (ticks 16-31).
        assert_eq!(iwdg.reset_cycle(), FIRST + (1 + 46 + 1) * 16 * TICK);
    }

    #[test]
    fn a_faster_core_changes_no_time() {
        let mut iwdg = board(32_000);
        iwdg.set(KR, 0xAAAA, 10_000);
        let left = iwdg.reset_cycle() - 10_000;
        iwdg.set_hz(160_000_000, 10_000);
        assert_eq!(iwdg.reset_cycle() - 10_000, left * 10);
    }

    #[test]
    fn an_lsi_that_drifts_moves_the_bite() {
        let mut iwdg = board(32_000);
        iwdg.set(KR, 0xAAAA, 10_000);
        let left = iwdg.reset_cycle() - 10_000;
        iwdg.set_lsi_hz(16_000, 10_000);
        assert!((iwdg.reset_cycle() - 10_000).abs_diff(2 * left) <= 1);
    }

    #[test]
    fn held_it_does_not_bite() {
        let mut iwdg = board(32_000);
        iwdg.set(KR, 0xAAAA, 10_000);
        let bite = iwdg.reset_cycle();
        iwdg.hold(true, 20_000);
        iwdg.hold(true, 30_000);
        assert_eq!(iwdg.reset_cycle(), Cycle::MAX);
        iwdg.hold(false, 20_000 + 1_000 * TICK);
        assert_eq!(iwdg.reset_cycle(), bite + 1_000 * TICK);
    }
}
