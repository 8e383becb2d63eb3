//! The drift check: tests whether thresholds still agree with a wearer file.
//!
//! Each electrode is given at most four levels, from twice the tolerance below its threshold to
//! once above it, rising until something moves. The lowest level that moved is the threshold found;
//! it is accepted from one tolerance below the filed threshold on.

use super::conduct::{OperatorStation, Procedure, ProcedureCost, conduct};
use super::presentation::Presentation;
use super::{
    Action, CalibrationError, ElectrodeResult, Entry, Head, Journal, Level, Order, Phase, Plan,
    Refusal, Step, View,
};
use crate::link::Port;
use crate::session::Unit;
use crate::wearer::{DriftCheck, Wearer, append};
use std::path::Path;

/// Parameters of a drift check, which tests whether thresholds still agree with a wearer file.
pub struct CheckOrder<'a> {
    /// Path of the wearer file. The check reads it and appends its results.
    pub file: &'a Path,
    /// Largest fall of a threshold below its value in the file that is accepted, in the channel's
    /// unit.
    pub tolerance: Level,
    /// Head with the date, the operator and the device of the check.
    pub head: &'a Head,
}

/// Result of the drift check of one electrode.
pub type Drift = DriftCheck;

/// State of a drift check that is in progress.
struct Checking<'a> {
    plan: Plan,
    expected: Vec<Level>,
    checked: &'a CheckOrder<'a>,
    drifts: Vec<Drift>,
    /// Level that was given last at the present electrode; 0 if none was.
    level: Level,
    /// Number of levels that were given so far at the present electrode.
    tried: u32,
    /// Value of `level` before the latest presentation, which is restored if the presentation is
    /// discarded.
    before: Level,
    presentation: Presentation,
}

impl Checking<'_> {
    fn electrode_index(&self) -> usize {
        self.drifts.len()
    }

    fn channel(&self) -> u8 {
        self.plan
            .electrodes
            .get(self.electrode_index())
            .map_or(0, |plan| plan.channel)
    }

    fn next(&self) -> Option<Level> {
        let expected = *self.expected.get(self.electrode_index())?;
        let tolerance = self.checked.tolerance;
        let levels = [
            expected.saturating_sub(tolerance).saturating_sub(tolerance),
            expected.saturating_sub(tolerance),
            expected,
            expected.saturating_add(tolerance),
        ];
        let limit = self.plan.electrodes[self.electrode_index()].ceiling;
        let next = levels.into_iter().skip(self.tried as usize);
        next.map(|level| level.min(limit))
            .find(|level| *level > self.level)
    }

    /// Stores the result of the present electrode: the lowest level at which something moved, or
    /// `None` if nothing did. Returns the actions that end this electrode and begin the next.
    fn conclude(&mut self, found: Option<Level>) -> Vec<Action> {
        let at = self.electrode_index();
        let (planned, expected) = (&self.plan.electrodes[at], self.expected[at]);
        let tolerance = self.checked.tolerance;
        let accepted = found.is_some_and(|found| found >= expected.saturating_sub(tolerance));
        let channel = planned.channel;
        self.drifts.push(Drift {
            at: self.checked.head.at.clone(),
            channel,
            expected: expected.amplitude(),
            found: found.map(Level::amplitude),
            unit: planned.stage,
            accepted,
            by: Some(self.checked.head.operator.clone()),
            device: Some(self.checked.head.device.clone()),
            seed: self.checked.head.seed,
        });
        (self.level, self.tried) = (Level(0), 0);
        self.presentation.reset();
        let mut actions = vec![Action::Give(channel, Level(0)), Action::Write];
        if !self.is_finished() {
            actions.push(Action::Arm(self.electrode_index()));
        }
        actions
    }
}

impl Procedure for Checking<'_> {
    fn begin(&mut self) -> Vec<Action> {
        match self.is_finished() {
            true => Vec::new(),
            false => vec![Action::Arm(0)],
        }
    }

    fn advance_to(&mut self, t_us: u64) -> Vec<Action> {
        match self.presentation.advance_to(t_us) {
            true => vec![Action::Give(self.channel(), Level(0))],
            false => Vec::new(),
        }
    }

    fn execute_order(&mut self, t_us: u64, order: &Order) -> Result<Vec<Action>, Refusal> {
        match order {
            Order::Abort => Ok(vec![Action::Abort]),
            // A level that is too much now ends the check of this electrode.
            Order::TooMuch | Order::Skip => Ok(self.conclude(None)),
            Order::Lower => {
                self.presentation.end(t_us);
                Ok(vec![Action::Give(self.channel(), Level(0))])
            }
            Order::Raise => {
                self.presentation.check_ready(t_us)?;
                let level = self.next();
                let level = level.ok_or_else(|| Refusal::not_now("there is no higher level"))?;
                (self.before, self.level) = (self.level, level);
                self.tried += 1;
                self.presentation.start(t_us);
                let channel = self.channel();
                let step = Step::Threshold;
                let given = Entry::Given {
                    channel,
                    step,
                    level,
                };
                Ok(vec![Action::Give(channel, level), Action::Record(given)])
            }
            Order::Yes | Order::No if !self.presentation.has_question => {
                Err(Refusal::not_now("no question is open"))
            }
            Order::Yes => Ok(self.conclude(Some(self.level))),
            Order::No => {
                self.presentation.has_question = false;
                match self.next() {
                    Some(_) => Ok(Vec::new()),
                    None => Ok(self.conclude(None)),
                }
            }
            _ => Err(Refusal::not_now(
                "a check accepts raise, yes, no, lower and abort only",
            )),
        }
    }

    fn discard_level(&mut self, t_us: u64) {
        if self.is_stimulating() || self.presentation.has_question {
            self.level = self.before;
            self.tried = self.tried.saturating_sub(1);
            self.presentation.end(t_us);
        }
    }

    fn view(&self, t_us: u64) -> View {
        let at = self
            .electrode_index()
            .min(self.plan.electrodes.len().saturating_sub(1));
        let planned = &self.plan.electrodes[at];
        let (phase, left_s) = match self.is_finished() {
            true => (Phase::Done, 0.0),
            false => self.presentation.phase(t_us),
        };
        View {
            electrode: at + 1,
            of: self.plan.electrodes.len(),
            channel: planned.channel,
            place: planned.place.clone(),
            unit: planned.stage.symbol(),
            step: Step::Threshold,
            phase,
            left_s,
            level: self.level,
            given: if self.is_stimulating() {
                self.level
            } else {
                Level(0)
            },
            raise: self.next(),
            top: planned.ceiling,
            question: (self.presentation.has_question).then(|| Step::Threshold.question()),
            found: ElectrodeResult {
                threshold: self.expected.get(at).copied(),
                ..ElectrodeResult::default()
            },
            t_s: t_us as f64 / 1e6,
            ..View::default()
        }
    }

    fn is_stimulating(&self) -> bool {
        self.presentation.is_stimulating()
    }

    fn is_finished(&self) -> bool {
        self.electrode_index() >= self.plan.electrodes.len()
    }

    fn write_wearer_file(&mut self) -> Result<Option<usize>, CalibrationError> {
        if let Some(drift) = self.drifts.last() {
            let added = append(self.checked.file, &[], std::slice::from_ref(drift));
            added.map_err(|why| CalibrationError::Store(why.to_string()))?;
        }
        Ok(Some(self.drifts.len()))
    }
}

/// Checks the thresholds of a wearer file on the device behind `port`, with the plan
/// [`Plan::from_wearer`]. Appends the result of each electrode to the file.
///
/// # Errors
/// The reason why the check ended early; [`CalibrationError::Drifted`] if a threshold is lower than
/// the tolerance allows, or was not found.
pub fn check<P: Port>(
    port: P,
    wearer: &Wearer,
    checked: &CheckOrder<'_>,
    journal: &mut Journal,
    desk: &mut OperatorStation<'_>,
) -> (Result<(), CalibrationError>, Vec<Drift>, ProcedureCost) {
    let plan = match Plan::from_wearer(wearer) {
        Ok(plan) => plan,
        Err(error) => return (Err(error), Vec::new(), ProcedureCost::default()),
    };
    let mut checking = Checking {
        expected: (wearer.electrodes.iter())
            .map(|electrode| Level(electrode.motor_threshold.get()))
            .collect(),
        plan: plan.clone(),
        checked,
        drifts: Vec::new(),
        level: Level(0),
        tried: 0,
        before: Level(0),
        presentation: Presentation::new(&plan),
    };
    let (result, spent, _) = conduct(port, &plan, &mut checking, journal, desk, checked.head);
    let result = result.and_then(|()| check_drifts(&checking.drifts));
    (result, checking.drifts, spent)
}

fn check_drifts(drifts: &[Drift]) -> Result<(), CalibrationError> {
    let milli = |value: u32| f64::from(value) / 1e3;
    let messages: Vec<String> = (drifts.iter())
        .filter(|drift| !drift.accepted)
        .map(|drift| {
            let unit: Unit = drift.unit;
            let (channel, expected) = (drift.channel, milli(drift.expected.get()));
            let symbol = unit.symbol();
            match drift.found {
                Some(found) => format!(
                    "channel {channel}: threshold {} {symbol}, but {expected} {symbol} in the file",
                    milli(found.get())
                ),
                None => format!("channel {channel}: no movement near {expected} {symbol}"),
            }
        })
        .collect();
    match messages.is_empty() {
        true => Ok(()),
        false => Err(CalibrationError::Drifted(messages.join("; "))),
    }
}
