//! Logic of an output stage: converts two lines into the state of the stage (docs/reference/hardware.md, The
//! stage's logic).

use super::truth::{Hardware, StageLogic};
use crate::trace::levels::State;
use serde::Serialize;

/// Grounding that gives the charge of one phase back, µs: less than the 1 ms for which the firmware
/// always grounds (hardware.md, The stage's logic).
const GIVEN_BACK_US: u64 = 900;
/// Maximum difference between the phases of one pulse, µs: the slots of the two edges.
const EQUAL_US: i64 = 2;

/// Reason why a stage latched. It stays isolated until pump and lines have rested together for 10
/// ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Cause {
    /// The current exceeded the level of a comparator.
    OverCurrent,
    /// A line requested a direction for so long that the one-shot ended it.
    Held,
    /// A direction was requested again before the charge of the previous one was given back.
    NotGivenBack,
}

/// Logic of one stage.
#[derive(Clone, Debug)]
pub(super) struct Logic {
    /// Hardware of the stage; `None` is a bare stage that only follows its two lines.
    built: Option<Hardware>,
    inputs: State,
    since_us: u64,
    /// Times at which lines c and a rose, µs (two-bit logic).
    rose_us: [u64; 2],
    /// Anodic minus cathodic time since the charge was last given back, µs.
    balance_us: i64,
    expired: bool,
    /// Times at which the stage's and the bank's comparator will trip, µs.
    trips_us: [u64; 2],
    latched: Option<Cause>,
    /// Time of the pump's last edge, µs, while the pump is off.
    pumped_us: Option<u64>,
}

impl Logic {
    pub const fn new(built: Option<Hardware>) -> Self {
        Self {
            built,
            inputs: State::Isolated,
            since_us: 0,
            rose_us: [0; 2],
            balance_us: 0,
            expired: false,
            trips_us: [u64::MAX; 2],
            latched: None,
            pumped_us: None,
        }
    }

    /// Returns the state that the stage applies to the electrode.
    pub const fn state(&self) -> State {
        if self.latched.is_some() || self.expired && self.inputs.is_driven() {
            State::Isolated
        } else {
            self.inputs
        }
    }

    /// Returns the time of the last change of its lines, µs.
    pub const fn since_us(&self) -> u64 {
        self.since_us
    }

    pub const fn latched(&self) -> Option<Cause> {
        self.latched
    }

    const fn is_interlocked(&self) -> bool {
        matches!(&self.built, Some(built) if matches!(built.logic, StageLogic::Interlocked))
    }

    /// Processes a change of the lines to `to` at `t_us`.
    pub fn enter(&mut self, t_us: u64, to: State) {
        let given_back = self.leave(t_us);
        let rises = to as u8 & !(self.inputs as u8);
        for (line, rose_us) in self.rose_us.iter_mut().enumerate() {
            if rises & 1 << line != 0 {
                *rose_us = t_us;
            }
        }
        (self.inputs, self.since_us, self.expired) = (to, t_us, false);
        let owes = to.sign() * self.balance_us > EQUAL_US
            || !given_back && self.balance_us.abs() > EQUAL_US;
        if self.is_interlocked() && to.is_driven() && owes {
            self.latch(Cause::NotGivenBack);
        }
        self.expired = self.one_shot_end_us().is_some_and(|opens| opens <= t_us);
    }

    /// Ends the interval in the present state; returns `false` if that was a grounding too short to
    /// give any charge back.
    fn leave(&mut self, t_us: u64) -> bool {
        let lasted = t_us - self.since_us;
        match self.state() {
            State::Grounded if lasted < GIVEN_BACK_US => return false,
            State::Grounded => self.balance_us = 0,
            state => self.balance_us += state.sign() * lasted.cast_signed(),
        }
        true
    }

    /// Returns the time at which the one-shot ends the requested direction.
    fn one_shot_end_us(&self) -> Option<u64> {
        let built = self.built.as_ref()?;
        let since_us = match (built.logic, self.inputs) {
            (_, State::Isolated | State::Grounded) => return None,
            (StageLogic::Interlocked, _) => self.since_us,
            (StageLogic::TwoBit, State::Cathodic) => self.rose_us[0],
            (StageLogic::TwoBit, State::Anodic) => self.rose_us[1],
        };
        Some(since_us + built.one_shot_us)
    }

    /// Returns the time of the next change that the stage makes by itself.
    pub fn next_event(&self) -> u64 {
        let opens = self.one_shot_end_us().filter(|_| !self.expired);
        let ends = match self.latched {
            Some(_) => u64::MAX,
            None => opens.unwrap_or(u64::MAX).min(self.trip_us()),
        };
        ends.min(self.latch_clear_time_us())
    }

    /// Returns the time at which pump and lines will have rested together long enough to clear a
    /// latch and the balance. The lines must rest too, so that a held direction is not driven
    /// again.
    fn latch_clear_time_us(&self) -> u64 {
        let keeps = self.latched.is_some() || self.balance_us != 0;
        match (&self.built, self.pumped_us, self.inputs) {
            (Some(built), Some(pumped_us), State::Isolated) if keeps => {
                pumped_us.max(self.since_us) + built.latch_clear_us
            }
            _ => u64::MAX,
        }
    }

    fn trip_us(&self) -> u64 {
        self.trips_us[0].min(self.trips_us[1])
    }

    /// Executes the next event of the stage, which is due at `t_us`.
    pub fn run_next_event(&mut self, t_us: u64) {
        if self.latch_clear_time_us() <= t_us {
            (self.latched, self.balance_us) = (None, 0);
        } else if self.trip_us() <= t_us {
            self.leave(t_us);
            self.latch(Cause::OverCurrent);
        } else if self.is_interlocked() {
            self.leave(t_us);
            self.latch(Cause::Held);
        } else {
            self.expired = true;
        }
    }

    /// Starts or stops the delays of the stage's and the bank's comparator: `is_beyond` gives
    /// whether the current exceeds their levels from `t_us` on.
    pub fn update_comparators(&mut self, t_us: u64, is_beyond: [bool; 2]) {
        let Some(built) = &self.built else { return };
        let delays_us = [built.comparator_us, built.bank_comparator_us];
        for ((trip_us, is_beyond), delay_us) in
            self.trips_us.iter_mut().zip(is_beyond).zip(delays_us)
        {
            *trip_us = match is_beyond {
                true => (*trip_us).min(t_us + delay_us),
                false => u64::MAX,
            };
        }
    }

    fn latch(&mut self, cause: Cause) {
        self.latched.get_or_insert(cause);
        self.trips_us = [u64::MAX; 2];
    }

    /// Sets the time of the last edge of a pump at rest, or `None` when the pump runs again.
    pub fn set_pump_rest(&mut self, since_us: Option<u64>) {
        self.pumped_us = since_us;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::word;

    /// Implementation of the table of docs/reference/hardware.md ("The stage's logic") row by row, clocked at
    /// 1 MHz. The balance is compared once, at entry.
    #[derive(Default)]
    struct Table {
        lines: State,
        since_us: u64,
        balance_us: i64,
        latch: bool,
        pump_is_off: bool,
        rested_us: u64,
    }

    impl Table {
        /// Advances one microsecond with these lines.
        fn clock(&mut self, lines: State) {
            let from = (self.lines, self.since_us);
            if self.rested_us == 10_000 {
                (self.latch, self.balance_us) = (false, 0);
            }
            self.latch |= self.lines.is_driven() && self.since_us == 600;
            if lines != self.lines {
                (self.lines, self.since_us) = (lines, 0);
                let is_short = matches!(from, (State::Grounded, ..900));
                let toward = self.balance_us * lines.sign();
                let owes = toward > 2 || is_short && self.balance_us.abs() > 2;
                self.latch |= lines.is_driven() && owes;
            }
            self.since_us += 1;
            if !self.latch {
                self.balance_us += lines.sign();
                if lines == State::Grounded && self.since_us == 900 {
                    self.balance_us = 0;
                }
            }
            let rests = self.pump_is_off && lines == State::Isolated;
            self.rested_us = if rests { self.rested_us + 1 } else { 0 };
        }

        const fn state(&self) -> State {
            if self.latch {
                State::Isolated
            } else {
                self.lines
            }
        }
    }

    /// Compares the judge's stage with the table: random lines, held for times around every bound,
    /// with the pump on or off.
    #[test]
    fn it_is_what_the_table_says() {
        const LINES: [State; 4] = [
            State::Isolated,
            State::Cathodic,
            State::Anodic,
            State::Grounded,
        ];
        const HELD_US: [u64; 16] = [
            1, 2, 3, 4, 50, 200, 201, 203, 204, 599, 600, 601, 899, 900, 901, 10_001,
        ];
        let (mut latched, mut driven_us) = (0, 0);
        for seed in 0..400 {
            let mut logic = Logic::new(Some(Hardware::REFERENCE));
            let mut table = Table::default();
            let mut t_us = 0;
            for step in 0..60 {
                let random = word(seed, step);
                if random.is_multiple_of(5) {
                    table.pump_is_off = random & 1 << 20 != 0;
                    let since_us = table.pump_is_off.then_some(t_us);
                    logic.set_pump_rest(since_us);
                    table.rested_us = 0;
                }
                let lines = LINES[(random >> 8) as usize % 4];
                if lines != table.lines {
                    logic.enter(t_us, lines);
                }
                for _ in 0..HELD_US[(random >> 32) as usize % 16] {
                    let before = table.latch;
                    table.clock(lines);
                    assert_eq!(logic.state(), table.state(), "{seed}, {step}, {t_us} us");
                    latched += u32::from(!before && table.latch);
                    driven_us += u64::from(table.state().is_driven());
                    t_us += 1;
                    while logic.next_event() <= t_us {
                        logic.run_next_event(logic.next_event());
                    }
                }
            }
        }
        println!("latched {latched} times, driven for {driven_us} us");
        assert!(latched > 500 && driven_us > 250_000);
    }

    /// If the table compared the balance all the time, it would end each phase after 3 µs.
    #[test]
    fn a_phase_is_not_ended_by_its_own_count() {
        let mut table = Table::default();
        for _ in 0..500 {
            table.clock(State::Anodic);
        }
        assert_eq!((table.state(), table.balance_us), (State::Anodic, 500));
    }
}
