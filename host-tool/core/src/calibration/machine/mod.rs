//! The calibration procedure as a state machine: it takes orders and time, and returns actions. It
//! knows no device and no clock.

mod replay;
mod sight;

use super::found::Value;
use super::journal::Entry;
use super::presentation::Presentation;
use super::{ElectrodeResult, Level, Order, Plan, PlannedElectrode, Refusal, Step};

/// Action that the caller carries out on the device, the journal or the wearer file. Several
/// actions are carried out in the sequence in which they are returned.
#[derive(Clone, PartialEq, Debug)]
pub enum Action {
    /// Configure and arm the electrode with this index in the plan, at amplitude 0.
    Arm(usize),
    /// Set the channel (counted from 1) to this level from now on; level 0 ends the stimulation.
    Give(u8, Level),
    /// Add an entry to the journal.
    Record(Entry),
    /// Write the wearer file, because an electrode is complete or left out.
    Write,
    /// Show the operator that a result was refused, although the command that led to it was carried
    /// out.
    Tell(Refusal),
    /// End stimulation at once, and the calibration, because the operator aborted it.
    Abort,
}

/// State machine of the calibration, which takes the electrodes of the plan one after the other
/// through all steps.
#[derive(Clone, PartialEq, Debug)]
pub struct Machine {
    plan: Plan,
    found: Vec<ElectrodeResult>,
    /// Highest level that may still be given at each electrode: below every level that was too
    /// much.
    caps: Vec<Level>,
    /// Index of the present electrode in the plan; `None` when all electrodes are done.
    at: Option<usize>,
    step: Step,
    /// Level that was given last, or from which the step starts.
    level: Level,
    presentation: Presentation,
    /// In the threshold step: the level at which a movement was seen once and must be confirmed.
    moved: Option<Level>,
    /// In the threshold step: the first level that was given since the search last began from
    /// below.
    first: Option<Level>,
    /// Values of `level` and `first` before the latest presentation, which are restored if it is
    /// discarded.
    before: (Level, Option<Level>),
    /// In the comfort step: the highest level that the wearer has accepted so far.
    accepted: Option<Level>,
}

impl Machine {
    /// Creates the state after the given entries of a journal. It begins with the first electrode
    /// that is neither complete nor left out.
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

    /// Starts the procedure, and returns its first actions.
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

    /// Returns whether every electrode is complete or left out.
    #[must_use]
    pub const fn is_finished(&self) -> bool {
        self.at.is_none()
    }

    /// Returns the plan with the electrodes that are calibrated.
    #[must_use]
    pub const fn plan(&self) -> &Plan {
        &self.plan
    }

    /// Returns the results of each electrode, in the order of the plan.
    #[must_use]
    pub fn results(&self) -> &[ElectrodeResult] {
        &self.found
    }

    /// Returns whether a level is being given at present.
    #[must_use]
    pub const fn is_stimulating(&self) -> bool {
        self.presentation.is_stimulating()
    }

    /// Advances the time to `t_us`, and returns the actions that are due, such as the end of a
    /// level.
    pub fn advance_to(&mut self, t_us: u64) -> Vec<Action> {
        match self.presentation.advance_to(t_us) {
            true => vec![Action::Give(self.channel(), Level(0))],
            false => Vec::new(),
        }
    }

    /// Discards the level that is being given at `t_us`, or about which a question is open, because
    /// the stimulation was interrupted. The next raise gives the same level again.
    pub fn discard_level(&mut self, t_us: u64) {
        if self.is_stimulating() || self.presentation.has_question {
            (self.level, self.first) = self.before;
            self.presentation.end(t_us);
        }
    }

    /// Carries out a command at `t_us` completely and returns its actions, or refuses it and
    /// changes nothing. The commands to lower, "too much" and abort are carried out in every state.
    ///
    /// # Errors
    /// A [`Refusal`] with the reason.
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

    /// Returns the difference between successive levels in the present step: coarse for placement,
    /// otherwise fine.
    fn level_step(&self, at: usize) -> Level {
        match self.step {
            Step::Placement => self.planned_electrode(at).coarse,
            _ => self.planned_electrode(at).step,
        }
    }

    /// Returns the highest level that may be given at this electrode at present: the wearer's limit
    /// once it is known, but below every level that was too much.
    fn highest_level(&self, at: usize) -> Level {
        let limit = self.found[at].limit.unwrap_or(self.caps[at]);
        self.caps[at].min(limit)
    }

    /// Returns the level that the command to raise would give; `None` if the present level is the
    /// highest.
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

    /// Lowers the highest level of an electrode, so that `level` is not given again. Removes
    /// results of this electrode that are above the new highest level.
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

    /// Restarts the search for the threshold from below, so that the next raise gives the level
    /// `first`.
    fn climb_from(&mut self, at: usize, first: Level) {
        self.level = first.saturating_sub(self.planned_electrode(at).step);
        (self.moved, self.first) = (None, None);
    }

    /// Stores the result of the present step, and goes on to the next step or the next electrode.
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
