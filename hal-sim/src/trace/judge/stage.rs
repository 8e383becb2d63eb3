//! A stage's logic: what it makes of two lines (docs/hardware.md, The stage's
//! logic).

use super::truth::{Hardware, StageLogic};
use crate::trace::levels::State;
use serde::Serialize;

/// Grounding this long gives the charge of one phase a way back, µs: less than
/// the 1 ms that the firmware grounds at least (hardware.md, The stage's logic).
const GIVEN_BACK_US: u64 = 900;
/// Phases of one pulse differ by less than this, µs: one of the two edges' slots.
const EQUAL_US: i64 = 2;

/// Why a stage latched: isolated, until pump and lines have rested together for 10 ms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Cause {
    /// More current than its comparator allows.
    OverCurrent,
    /// A direction was held until its one-shot ended it.
    Held,
    /// A direction was asked for before what was driven was given back.
    NotGivenBack,
}

/// The logic of one stage.
#[derive(Clone, Debug)]
pub(super) struct Logic {
    /// `None`: bare, two lines and nothing else.
    built: Option<Hardware>,
    inputs: State,
    since_us: u64,
    /// When line c, line a rose (two-bit logic).
    rose_us: [u64; 2],
    /// Anodic less cathodic time since it was last given back, µs.
    balance_us: i64,
    expired: bool,
    /// When a comparator will have tripped: the stage's, its bank's.
    trips_us: [u64; 2],
    latched: Option<Cause>,
    /// The pump's last edge, since it is off.
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

    /// What the stage does.
    pub const fn state(&self) -> State {
        if self.latched.is_some() || self.expired && self.inputs.is_driven() {
            State::Isolated
        } else {
            self.inputs
        }
    }

    /// When its lines last changed.
    pub const fn since_us(&self) -> u64 {
        self.since_us
    }

    pub const fn latched(&self) -> Option<Cause> {
        self.latched
    }

    const fn is_interlocked(&self) -> bool {
        matches!(&self.built, Some(built) if matches!(built.logic, StageLogic::Interlocked))
    }

    /// The lines change.
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
        self.expired = self.opens_us().is_some_and(|opens| opens <= t_us);
    }

    /// Closes the stretch in the present state; `false` if that was grounding
    /// too short to give anything back.
    fn leave(&mut self, t_us: u64) -> bool {
        let lasted = t_us - self.since_us;
        match self.state() {
            State::Grounded if lasted < GIVEN_BACK_US => return false,
            State::Grounded => self.balance_us = 0,
            state => self.balance_us += state.sign() * lasted.cast_signed(),
        }
        true
    }

    /// When the one-shot ends the direction that is asked for.
    fn opens_us(&self) -> Option<u64> {
        let built = self.built.as_ref()?;
        let since_us = match (built.logic, self.inputs) {
            (_, State::Isolated | State::Grounded) => return None,
            (StageLogic::Interlocked, _) => self.since_us,
            (StageLogic::TwoBit, State::Cathodic) => self.rose_us[0],
            (StageLogic::TwoBit, State::Anodic) => self.rose_us[1],
        };
        Some(since_us + built.one_shot_us)
    }

    /// When the stage next changes by itself.
    pub fn next_event(&self) -> u64 {
        let opens = self.opens_us().filter(|_| !self.expired);
        let ends = match self.latched {
            Some(_) => u64::MAX,
            None => opens.unwrap_or(u64::MAX).min(self.trip_us()),
        };
        ends.min(self.clears_us())
    }

    /// When pump and lines will have rested together for as long as a latch asks: what was
    /// held is not driven anew.
    fn clears_us(&self) -> u64 {
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

    /// Its next event comes.
    pub fn happen(&mut self, t_us: u64) {
        if self.clears_us() <= t_us {
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

    /// The current is beyond the level of the stage's comparator, of its bank's, from
    /// `t_us` on, or no longer.
    pub fn compare(&mut self, t_us: u64, is_beyond: [bool; 2]) {
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

    /// The pump rests since its last edge at `since_us`, or runs again.
    pub fn pump(&mut self, since_us: Option<u64>) {
        self.pumped_us = since_us;
    }
}
