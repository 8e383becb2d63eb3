//! The calibration procedure as a state machine: it takes orders and time, and returns actions. It
//! knows no device and no clock.

mod replay;
mod sight;

use super::found::Value;
use super::journal::Entry;
use super::presentation::Presentation;
use super::{ElectrodeResult, Level, Order, Plan, PlannedElectrode, Refusal, Step};

/// Action for the caller to carry out, in the order given.
#[derive(Clone, PartialEq, Debug)]
pub enum Action {
    /// Configure and arm this electrode (index into the plan) at amplitude 0.
    Arm(usize),
    /// Give this channel, counted from 1, this level from now on; level 0 is silence.
    Give(u8, Level),
    /// Add an entry to the journal.
    Record(Entry),
    /// Write the wearer file, because an electrode is done.
    Write,
    /// Show the operator a refusal that does not answer an order.
    Tell(Refusal),
    /// Silence the device at once and end, because the operator aborted.
    Abort,
}

/// State of the procedure, which calibrates the plan's electrodes one after the other.
#[derive(Clone, PartialEq, Debug)]
pub struct Machine {
    plan: Plan,
    found: Vec<ElectrodeResult>,
    /// Highest level allowed at each electrode, below the levels that were too much.
    caps: Vec<Level>,
    /// Index of the present electrode; `None` when all are done.
    at: Option<usize>,
    step: Step,
    /// Level given last, or chosen.
    level: Level,
    presentation: Presentation,
    /// In the threshold step: level that moved something once.
    moved: Option<Level>,
    /// In the threshold step: first level of this climb.
    first: Option<Level>,
    /// Values of `level` and `first` before the latest presentation.
    before: (Level, Option<Level>),
    /// In the comfort step: highest level that the wearer accepted.
    accepted: Option<Level>,
}

impl Machine {
    /// Creates the procedure after the entries of a journal, at the first electrode that is not
    /// done.
    #[must_use]
    pub fn new(plan: Plan, entries: &[Entry]) -> Self {
        let mut machine = Self {
            found: vec![ElectrodeResult::default(); plan.electrodes.len()],
            caps: plan.electrodes.iter().map(|plan| plan.ceiling).collect(),
            presentation: Presentation::new(&plan),
            plan,
            at: None,
            step: Step::Placement,
            level: Level(0),
            moved: None,
            first: None,
            before: (Level(0), None),
            accepted: None,
        };
        for entry in entries {
            machine.replay(entry);
        }
        machine
    }

    /// Returns the first actions.
    pub fn begin(&mut self) -> Vec<Action> {
        // An earlier course may have found results that it could no longer write.
        let is_owed = self.found.iter().any(ElectrodeResult::is_complete);
        let mut actions = match is_owed {
            true => vec![Action::Write],
            false => Vec::new(),
        };
        actions.extend(self.go_to_next());
        actions
    }

    /// Returns whether every electrode is done or left out.
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        self.at.is_none()
    }

    /// Returns the plan that the procedure follows.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the results by electrode of the plan.
    #[must_use]
    pub fn results(&self) -> &[ElectrodeResult] {
        &self.found
    }

    /// Returns whether a level is being given.
    #[must_use]
    pub const fn is_stimulating(&self) -> bool {
        self.presentation.is_stimulating()
    }

    /// Lets time pass until `t_us`, and returns the actions that follow from it.
    pub fn advance_to(&mut self, t_us: u64) -> Vec<Action> {
        match self.presentation.advance_to(t_us) {
            true => vec![Action::Give(self.channel(), Level(0))],
            false => Vec::new(),
        }
    }

    /// Discards the level that was given at `t_us`, or has just ended, because it was cut short.
    /// The next raise gives the same level.
    pub fn discard_level(&mut self, t_us: u64) {
        if self.is_stimulating() || self.presentation.has_question {
            (self.level, self.first) = self.before;
            self.presentation.end(t_us);
        }
    }

    /// Carries out an order at `t_us` completely, or refuses it and changes nothing. Lowering, "too
    /// much" and abort are always carried out.
    ///
    /// # Errors
    /// Returns a [`Refusal`] with the reason.
    pub fn execute_order(&mut self, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal> {
        if *order == Order::Abort {
            return Ok(vec![Action::Abort]);
        }
        let Some(at) = self.at else {
            return Err(Refusal::not_now("every electrode is done"));
        };
        match order {
            Order::Lower => Ok(self.lower(at)),
            Order::TooMuch => Ok(self.reject_level(at, t_us)),
            Order::Skip => Ok(self.skip(at)),
            Order::Raise => self.raise(at, t_us),
            Order::Again => self.repeat_level(t_us),
            Order::Enough => self.accept_comfort_limit(at),
            Order::Yes | Order::No | Order::Moves { .. } => self.answer(at, t_us, order),
            Order::Abort => Ok(Vec::new()), // above
        }
    }

    fn planned_electrode(&self, at: usize) -> &PlannedElectrode {
        &self.plan.electrodes[at]
    }

    /// Returns the difference between two levels of this step.
    fn level_step(&self, at: usize) -> Level {
        match self.step {
            Step::Placement => self.planned_electrode(at).coarse,
            _ => self.planned_electrode(at).step,
        }
    }

    /// Returns the highest level that this electrode may be given now.
    fn highest_level(&self, at: usize) -> Level {
        let limit = self.found[at].limit.unwrap_or(self.caps[at]);
        self.caps[at].min(limit)
    }

    /// Returns the level that a raise would give; `None` if there is no higher level.
    fn next_level(&self, at: usize) -> Option<Level> {
        let next = self
            .level
            .saturating_add(self.level_step(at))
            .min(self.highest_level(at));
        (next > self.level).then_some(next)
    }

    fn present_level(&mut self, t_us: u64, level: Level) -> Vec<Action> {
        self.before = (self.level, self.first);
        self.level = level;
        if self.step == Step::Threshold {
            self.first.get_or_insert(level);
        }
        self.presentation.start(t_us);
        let entry = Entry::Given {
            channel: self.channel(),
            step: self.step,
            level,
        };
        vec![Action::Give(self.channel(), level), Action::Record(entry)]
    }

    fn channel(&self) -> u8 {
        self.at.map_or(0, |at| self.planned_electrode(at).channel)
    }

    fn raise(&mut self, at: usize, t_us: u64) -> Result<Vec<Action>, Refusal> {
        self.presentation.check_ready(t_us)?;
        if self.moved.is_some() {
            return Err(Refusal::not_now(
                "a movement was seen: give the same level again to confirm it",
            ));
        }
        if self.step == Step::Points {
            return Err(Refusal::not_now(
                "this step uses the maximum level only: give it again",
            ));
        }
        match self.next_level(at) {
            Some(level) => Ok(self.present_level(t_us, level)),
            None => Err(Refusal::NotNow(format!(
                "{} is the highest level allowed here; {}",
                self.level,
                match self.step {
                    Step::Placement | Step::Threshold =>
                        "move the electrode and start lower, or leave the electrode out",
                    _ => "answer, lower the level, or leave the electrode out",
                }
            ))),
        }
    }

    fn repeat_level(&mut self, t_us: u64) -> Result<Vec<Action>, Refusal> {
        self.presentation.check_ready(t_us)?;
        let is_new = self.step == Step::Threshold && self.first.is_none();
        if self.level == Level(0) || is_new {
            return Err(Refusal::not_now("no level was given yet: raise first"));
        }
        Ok(self.present_level(t_us, self.level))
    }

    fn lower(&mut self, at: usize) -> Vec<Action> {
        self.level = self.level.saturating_sub(self.level_step(at));
        (self.moved, self.first) = (None, None);
        self.before = (self.level, None);
        self.presentation.has_question = false;
        match self.is_stimulating() {
            true => vec![Action::Give(self.channel(), self.level)],
            false => Vec::new(),
        }
    }

    /// Ensures that `level` is not given again at this electrode, and removes results above the new
    /// maximum.
    fn cap(&mut self, at: usize, level: Level) {
        let cap = level
            .saturating_sub(self.planned_electrode(at).step)
            .min(self.caps[at]);
        self.caps[at] = cap;
        let found = &mut self.found[at];
        if found.limit.is_some_and(|limit| limit > cap) {
            found.limit = Some(cap).filter(|cap| Some(*cap) > found.threshold);
        }
        let limit = found.limit;
        if limit.is_none() || found.minimum >= limit {
            found.minimum = None;
        }
        if found.minimum.is_none() || found.maximum > limit {
            found.maximum = None;
        }
    }

    fn reject_level(&mut self, at: usize, t_us: u64) -> Vec<Action> {
        let mut actions = vec![Action::Give(self.channel(), Level(0))];
        if self.level == Level(0) {
            return actions;
        }
        self.presentation.end(t_us);
        let (channel, level) = (self.channel(), self.level);
        actions.push(Action::Record(Entry::TooMuch { channel, level }));
        self.cap(at, level);
        (self.moved, self.first) = (None, None);
        self.level = self.caps[at];
        if self.step == Step::Comfort {
            let limit = self.accepted.unwrap_or_default();
            match self.store_result(at, Value::Level(limit)) {
                Ok(more) => actions.extend(more),
                Err(refusal) => actions.push(Action::Tell(refusal)),
            }
        } else if let Some(step) = self.found[at].next_step().filter(|step| *step < self.step) {
            self.enter(at, step);
        }
        actions
    }

    fn skip(&mut self, at: usize) -> Vec<Action> {
        self.found[at].is_skipped = true;
        let channel = self.channel();
        let mut actions = vec![
            Action::Give(channel, Level(0)),
            Action::Record(Entry::Skipped { channel }),
            Action::Write,
        ];
        actions.extend(self.go_to_next());
        actions
    }

    fn accept_comfort_limit(&mut self, at: usize) -> Result<Vec<Action>, Refusal> {
        if self.is_stimulating() || self.presentation.has_question {
            return Err(Refusal::not_now("answer the question first"));
        }
        match (self.step, self.accepted) {
            (Step::Comfort, Some(level)) => self.store_result(at, Value::Level(level)),
            (Step::Comfort, None) => Err(Refusal::not_now("the wearer accepted no level yet")),
            _ => Err(Refusal::not_now(
                "`enough` applies to the comfort step only",
            )),
        }
    }

    fn answer(&mut self, at: usize, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal> {
        if !self.presentation.has_question {
            return Err(Refusal::not_now("no question is open"));
        }
        match (self.step, order) {
            (Step::Points, Order::Moves { moves }) => {
                let named = moves.iter().map(|name| name.trim().to_owned());
                self.store_result(at, Value::Moves(named.collect()))
            }
            (Step::Points, _) => Err(Refusal::not_now("answer with the names of what moved")),
            (_, Order::Moves { .. }) => Err(Refusal::not_now(
                "names are asked for in the points step only",
            )),
            (Step::Comfort, Order::No) => Ok(self.reject_level(at, t_us)),
            (_, Order::Yes) => self.answer_yes(at),
            _ => {
                (self.presentation.has_question, self.moved) = (false, None);
                Ok(Vec::new())
            }
        }
    }

    fn answer_yes(&mut self, at: usize) -> Result<Vec<Action>, Refusal> {
        let level = self.level;
        match self.step {
            Step::Threshold if self.moved != Some(level) => self.moved = Some(level),
            Step::Threshold
                if self.first == Some(level) && level > self.planned_electrode(at).start =>
            {
                // Something moved at the very first level of the climb, so the climb begins again
                // from a lower level.
                let below = level.saturating_sub(self.planned_electrode(at).coarse);
                self.climb_from(at, below.max(self.planned_electrode(at).start));
            }
            Step::Comfort if level < self.highest_level(at) => self.accepted = Some(level),
            _ => return self.store_result(at, Value::Level(level)),
        }
        self.presentation.has_question = false;
        Ok(Vec::new())
    }

    /// Sets the level so that the next raise of the threshold's climb gives `first`.
    fn climb_from(&mut self, at: usize, first: Level) {
        self.level = first.saturating_sub(self.planned_electrode(at).step);
        (self.moved, self.first) = (None, None);
    }

    /// Stores the step's result, and goes on to the next step or electrode.
    fn store_result(&mut self, at: usize, value: Value) -> Result<Vec<Action>, Refusal> {
        self.found[at].store(self.step, &value)?;
        let (channel, step) = (self.channel(), self.step);
        let mut actions = vec![Action::Record(Entry::Found {
            channel,
            step,
            value,
        })];
        match self.found[at].next_step() {
            Some(step) => self.enter(at, step),
            None => {
                actions.push(Action::Write);
                actions.extend(self.go_to_next());
            }
        }
        Ok(actions)
    }

    fn go_to_next(&mut self) -> Vec<Action> {
        self.level = Level(0);
        self.presentation.reset();
        self.at = self
            .found
            .iter()
            .position(|found| found.next_step().is_some());
        let Some(at) = self.at else {
            return Vec::new();
        };
        if let Some(step) = self.found[at].next_step() {
            self.enter(at, step);
        }
        vec![Action::Arm(at)]
    }

    fn enter(&mut self, at: usize, step: Step) {
        let found = self.found[at].clone();
        self.step = step;
        self.presentation.has_question = false;
        (self.moved, self.first, self.accepted) = (None, None, None);
        match step {
            Step::Placement => self.level = Level(0),
            Step::Threshold => {
                let planned = self.planned_electrode(at);
                let below = found
                    .placement
                    .unwrap_or_default()
                    .saturating_sub(planned.coarse);
                let first = below.max(planned.start).min(self.highest_level(at));
                self.climb_from(at, first);
            }
            Step::Comfort | Step::Minimum => self.level = found.threshold.unwrap_or_default(),
            Step::Maximum => self.level = found.limit.unwrap_or_default(),
            Step::Points => self.level = found.maximum.unwrap_or_default(),
        }
        // A level that has been too much since then must not be given again either.
        self.level = self.level.min(self.highest_level(at));
    }
}
