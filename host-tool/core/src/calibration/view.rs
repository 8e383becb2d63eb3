//! The operator's view of a calibration.

use super::{ElectrodeResult, Level, MovementVerdict, Step};
use serde::Serialize;

/// Phase of a presentation, in which a level is given and the muscle then pauses.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// No stimulation; a level may be given unless a question is open.
    #[default]
    Ready,
    /// A level is being given.
    On,
    /// No stimulation, because the muscle must pause after the last level.
    Rest,
    /// The calibration is over: every electrode is complete or left out.
    Done,
}

/// State of a calibration as an operator sees it. Levels are in the channel's unit.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct View {
    /// Number of the present electrode in the plan, counted from 1.
    pub electrode: usize,
    /// Number of electrodes in the plan, for "electrode 2 of 5".
    pub of: usize,
    /// Channel of the present electrode, counted from 1.
    pub channel: u8,
    /// Position of the present electrode on the body, in words.
    pub place: String,
    /// Unit of the levels, "mA" or "V".
    pub unit: &'static str,
    /// Present step of the calibration at this electrode.
    pub step: Step,
    /// Phase of the present or last presentation.
    pub phase: Phase,
    /// Time until this phase ends, s; 0 if it does not end by itself.
    pub left_s: f64,
    /// Level that was given last, or from which the step starts.
    pub level: Level,
    /// Level that is being given at this moment; 0 if there is no stimulation.
    pub given: Level,
    /// Level that the command to raise would give; `None` if it is not possible.
    pub raise: Option<Level>,
    /// Level that the command to repeat would give; `None` if it is not possible.
    pub again: Option<Level>,
    /// Highest level that may be given at this electrode at present.
    pub top: Level,
    /// Question that the operator must answer; `None` if no question is open.
    pub question: Option<&'static str>,
    /// Whether a movement was seen once, so that the same level must be given again to confirm it.
    pub confirms: bool,
    /// Results of the steps at this electrode so far.
    pub found: ElectrodeResult,
    /// Latest force reading of the instrument, N; `None` without an instrument.
    pub reading_n: Option<f64>,
    /// Whether the instrument has been read for long enough since the last stimulation; true
    /// without an instrument.
    pub is_rested: bool,
    /// The instrument's verdict on the last presentation; `None` if it has not judged it.
    pub judged: Option<MovementVerdict>,
    /// Movements of a simulated wearer that were visible in the last presentation.
    pub moving: Vec<&'static str>,
    /// Whether a simulated wearer complains at present that the level is too much.
    pub complains: bool,
    /// Time since the device was opened, in the device's time, s.
    pub t_s: f64,
}

impl View {
    /// Returns the names of the orders that are possible now, without those that always are: to
    /// lower the level, to leave the electrode out, and to end.
    #[must_use]
    pub fn allowed_orders(&self) -> Vec<&'static str> {
        let mut orders = Vec::new();
        match (self.question, self.phase) {
            (Some(_), _) if self.step == Step::Points => orders.push("moves"),
            (Some(_), _) => orders.extend(["yes", "no"]),
            (None, Phase::Ready) => {
                orders.extend(self.raise.map(|_| "raise"));
                orders.extend(self.again.map(|_| "again"));
                orders.extend((self.step == Step::Comfort).then_some("enough"));
            }
            _ => {}
        }
        orders
    }
}
