//! The operator's view of a calibration.

use super::{ElectrodeResult, Level, MovementVerdict, Step};
use serde::Serialize;

/// Phase of the present presentation.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Silent; a level may be given.
    #[default]
    Ready,
    /// A level is being given.
    On,
    /// Silent, because the muscle rests.
    Rest,
    /// Every electrode is done.
    Done,
}

/// State that an operator sees at any time.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct View {
    /// Number of the electrode in the plan, counted from 1.
    pub electrode: usize,
    /// Number of electrodes in the plan.
    pub of: usize,
    /// Channel of the electrode, counted from 1.
    pub channel: u8,
    /// Place on the body, in words.
    pub place: String,
    /// Unit of the levels, "mA" or "V".
    pub unit: &'static str,
    /// Present step.
    pub step: Step,
    /// Phase of the present presentation.
    pub phase: Phase,
    /// Time left in this phase, s.
    pub left_s: f64,
    /// Level given last, or chosen.
    pub level: Level,
    /// Level given at this moment; 0 in silence.
    pub given: Level,
    /// Level that a raise would give; `None` if a raise is not possible.
    pub raise: Option<Level>,
    /// Level that an order to repeat would give; `None` if that is not possible.
    pub again: Option<Level>,
    /// Highest level that may be given here.
    pub top: Level,
    /// Question that awaits an answer, if any.
    pub question: Option<&'static str>,
    /// Whether something moved once, so that the same level must be given again to confirm.
    pub confirms: bool,
    /// Results at this electrode so far.
    pub found: ElectrodeResult,
    /// Reading of the instrument, N; `None` without an instrument.
    pub reading_n: Option<f64>,
    /// Whether the instrument has been read at rest for long enough; also true without an
    /// instrument.
    pub is_rested: bool,
    /// Instrument's verdict on the last presentation.
    pub judged: Option<MovementVerdict>,
    /// Movements of a simulated wearer that were visible in the last presentation.
    pub moving: Vec<&'static str>,
    /// Whether a simulated wearer complains that the level is too much.
    pub complains: bool,
    /// Time since the device was opened, s of the device's time.
    pub t_s: f64,
}
