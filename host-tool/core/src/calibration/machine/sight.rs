//! The operator's view of the procedure.

use super::Machine;
use crate::calibration::{Level, Phase, Step, View};

impl Machine {
    /// Returns the state at `t_us` as an operator sees it. The readings and verdicts of the
    /// instrument are missing; the caller adds them.
    #[must_use]
    pub fn view(&self, t_us: u64) -> View {
        let at = self
            .at
            .unwrap_or(self.plan.electrodes.len().saturating_sub(1));
        let planned = self.planned_electrode(at);
        let (phase, left_s) = match self.at {
            Some(_) => self.presentation.phase(t_us),
            None => (Phase::Done, 0.0),
        };
        let is_new = self.step == Step::Threshold && self.first.is_none();
        let can_raise = self.moved.is_none() && self.step != Step::Points;
        View {
            electrode: at + 1,
            of: self.plan.electrodes.len(),
            channel: planned.channel,
            place: planned.place.clone(),
            unit: planned.stage.symbol(),
            step: self.step,
            phase,
            left_s,
            level: self.level,
            given: if self.is_stimulating() {
                self.level
            } else {
                Level(0)
            },
            raise: self.next_level(at).filter(|_| can_raise),
            again: Some(self.level).filter(|level| *level > Level(0) && !is_new),
            top: self.highest_level(at),
            question: (self.presentation.has_question).then(|| self.step.question()),
            confirms: self.moved.is_some(),
            found: self.found[at].clone(),
            t_s: t_us as f64 / 1e6,
            ..View::default()
        }
    }
}
