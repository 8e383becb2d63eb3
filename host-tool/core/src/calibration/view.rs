//! What an operator sees.

use super::{Found, Judged, Level, Step};
use serde::Serialize;

/// Where the presentation stands.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Silent, and may be raised.
    #[default]
    Ready,
    /// A level is being given.
    On,
    /// Silent; the muscle rests.
    Rest,
    /// Every electrode is done.
    Done,
}

/// What there is to be seen, at any time.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct View {
    /// The electrode, from 1.
    pub electrode: usize,
    /// How many there are.
    pub of: usize,
    /// Its channel, from 1.
    pub channel: u8,
    /// Where it is, in words.
    pub place: String,
    /// "mA" or "V".
    pub unit: &'static str,
    /// The step under way.
    pub step: Step,
    /// Where the presentation stands.
    pub phase: Phase,
    /// How much of it is left, s.
    pub left_s: f64,
    /// Given last, or chosen.
    pub level: Level,
    /// Given at this moment.
    pub given: Level,
    /// What a raise would give.
    pub raise: Option<Level>,
    /// What giving it again would give.
    pub again: Option<Level>,
    /// No level here is above it.
    pub top: Level,
    /// What is asked.
    pub question: Option<&'static str>,
    /// It moved once, and the same level is to be given again.
    pub confirms: bool,
    /// What was found here so far.
    pub found: Found,
    /// What the instrument reads, N; nothing without one.
    pub reading_n: Option<f64>,
    /// Whether it has been read at rest for long enough; also where there is none.
    pub is_rested: bool,
    /// What it says of the last presentation.
    pub judged: Option<Judged>,
    /// What a simulated wearer's onlooker saw moving in the last presentation.
    pub moving: Vec<&'static str>,
    /// Whether a simulated wearer says that it is too much.
    pub complains: bool,
    /// Since the device was opened, s of its time.
    pub t_s: f64,
}
