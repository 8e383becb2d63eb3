//! One level given for a while, rest, and the question that is asked of it.

use super::{Phase, Plan, Refusal};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Clock {
    Ready,
    On { until_us: u64 },
    Rest { until_us: u64 },
}

/// Where the presentation stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Presentation {
    clock: Clock,
    on_us: u64,
    off_us: u64,
    /// An answer is owed.
    pub has_question: bool,
}

impl Presentation {
    /// Ready, as long as the plan's.
    pub fn new(plan: &Plan) -> Self {
        Self {
            clock: Clock::Ready,
            on_us: plan.on_us(),
            off_us: plan.off_us(),
            has_question: false,
        }
    }

    /// Ready for another electrode, nothing asked.
    pub const fn renew(&mut self) {
        (self.clock, self.has_question) = (Clock::Ready, false);
    }

    /// Whether a level is being given.
    pub const fn is_on(&self) -> bool {
        matches!(self.clock, Clock::On { .. })
    }

    /// A level is given from `t_us` on.
    pub const fn give(&mut self, t_us: u64) {
        let until_us = t_us.saturating_add(self.on_us);
        self.clock = Clock::On { until_us };
    }

    /// It has ended before its time, if it was given, and nothing is asked of it.
    pub const fn end(&mut self, t_us: u64) {
        if self.is_on() {
            self.rest(t_us);
        }
        self.has_question = false;
    }

    const fn rest(&mut self, t_us: u64) {
        let until_us = t_us.saturating_add(self.off_us);
        self.clock = Clock::Rest { until_us };
    }

    /// Lets time pass until `t_us`; whether a level has just ended, of which is asked now.
    pub const fn pass(&mut self, t_us: u64) -> bool {
        match self.clock {
            Clock::On { until_us } if t_us >= until_us => {
                self.rest(t_us);
                self.has_question = true;
                true
            }
            Clock::Rest { until_us } if t_us >= until_us => {
                self.clock = Clock::Ready;
                false
            }
            _ => false,
        }
    }

    /// # Errors
    /// Why nothing may be given at `t_us`.
    pub fn may_give(&self, t_us: u64) -> Result<(), Refusal> {
        match self.clock {
            _ if self.has_question => Err(Refusal::beyond("answer the question first")),
            Clock::On { .. } => Err(Refusal::beyond("a level is being given")),
            Clock::Rest { until_us } if t_us < until_us => {
                let rest_s = (until_us - t_us) as f64 / 1e6;
                Err(Refusal::NotNow(format!(
                    "the muscle rests for {rest_s:.1} s more"
                )))
            }
            _ => Ok(()),
        }
    }

    /// Where it stands, and how much of that is left, s.
    pub fn phase(&self, t_us: u64) -> (Phase, f64) {
        let left = |until_us: u64| until_us.saturating_sub(t_us) as f64 / 1e6;
        match self.clock {
            Clock::Ready => (Phase::Ready, 0.0),
            Clock::On { until_us } => (Phase::On, left(until_us)),
            Clock::Rest { until_us } => (Phase::Rest, left(until_us)),
        }
    }
}
