//! Presentation of one level: the level is given for a set time, a question about it is asked,
//! and the muscle rests.

use super::{Phase, Plan, Refusal};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    Ready,
    On { until_us: u64 },
    Rest { until_us: u64 },
}

/// Presentation of one level, which consists of stimulation, a question to the operator, and a
/// pause for the muscle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Presentation {
    state: State,
    on_us: u64,
    off_us: u64,
    /// Whether the operator has not yet answered the question about the last level.
    pub has_question: bool,
}

impl Presentation {
    /// Creates a presentation that can be started, with the times of the plan.
    pub fn new(plan: &Plan) -> Self {
        Self {
            state: State::Ready,
            on_us: plan.on_us(),
            off_us: plan.off_us(),
            has_question: false,
        }
    }

    /// Prepares the presentation for another electrode, without pause and without question.
    pub const fn reset(&mut self) {
        (self.state, self.has_question) = (State::Ready, false);
    }

    /// Returns whether a level is being given at present.
    pub const fn is_stimulating(&self) -> bool {
        matches!(self.state, State::On { .. })
    }

    /// Begins to give a level at `t_us`.
    pub const fn start(&mut self, t_us: u64) {
        let until_us = t_us.saturating_add(self.on_us);
        self.state = State::On { until_us };
    }

    /// Ends the presentation early, at `t_us`, without a question about its level. If a level was
    /// being given, the pause for the muscle begins at `t_us`.
    pub const fn end(&mut self, t_us: u64) {
        if self.is_stimulating() {
            self.start_rest(t_us);
        }
        self.has_question = false;
    }

    /// Begins the pause for the muscle at `t_us`.
    const fn start_rest(&mut self, t_us: u64) {
        let until_us = t_us.saturating_add(self.off_us);
        self.state = State::Rest { until_us };
    }

    /// Advances the time to `t_us`. Returns `true` if the time of the level has just ended. The
    /// pause then begins, and the operator must answer a question.
    pub const fn advance_to(&mut self, t_us: u64) -> bool {
        match self.state {
            State::On { until_us } if t_us >= until_us => {
                self.start_rest(t_us);
                self.has_question = true;
                true
            }
            State::Rest { until_us } if t_us >= until_us => {
                self.state = State::Ready;
                false
            }
            _ => false,
        }
    }

    /// Checks whether a level may be given at `t_us`.
    ///
    /// # Errors
    /// A [`Refusal`] with the reason: a question is open, a level is being given, or the pause for
    /// the muscle has not ended.
    pub fn check_ready(&self, t_us: u64) -> Result<(), Refusal> {
        match self.state {
            _ if self.has_question => Err(Refusal::not_now("answer the question first")),
            State::On { .. } => Err(Refusal::not_now("a level is being given")),
            State::Rest { until_us } if t_us < until_us => {
                let rest_s = (until_us - t_us) as f64 / 1e6;
                Err(Refusal::NotNow(format!(
                    "the muscle rests for {rest_s:.1} s more"
                )))
            }
            _ => Ok(()),
        }
    }

    /// Returns the phase of the presentation at `t_us`, and the time until it ends, s; 0 when a
    /// level may be given.
    pub fn phase(&self, t_us: u64) -> (Phase, f64) {
        let remaining_s = |until_us: u64| until_us.saturating_sub(t_us) as f64 / 1e6;
        match self.state {
            State::Ready => (Phase::Ready, 0.0),
            State::On { until_us } => (Phase::On, remaining_s(until_us)),
            State::Rest { until_us } => (Phase::Rest, remaining_s(until_us)),
        }
    }
}
