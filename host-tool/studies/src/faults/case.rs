//! One fault and what came of it.

use firmware::safety::Fault;
use serde::{Deserialize, Serialize};

/// What was broken, and what came of it.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Case {
    /// Its number, from 0: with class and seed, what repeats it.
    pub index: u64,
    /// When, device time in µs.
    pub moment_us: u64,
    /// What, for people: its kind, and after `: ` the rest.
    pub what: String,
    /// What came of it.
    pub fate: CaseResult,
}

impl Case {
    /// Of what can be told by its kind and what was drawn of it.
    pub(super) fn new(
        kind: &str,
        drawn: &str,
        (index, moment_us): (u64, u64),
        fate: CaseResult,
    ) -> Self {
        Self {
            index,
            moment_us,
            what: format!("{kind}: {drawn}"),
            fate,
        }
    }

    /// What kind of fault of its class it is: all before the first `: ` of what it is;
    /// nothing where that has none.
    #[must_use]
    pub fn kind(&self) -> Option<&str> {
        self.what.split_once(": ").map(|(kind, _)| kind)
    }
}

/// What came of a fault.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CaseResult {
    /// The device must find it: it changes an edge, a declaration is false, an electrode
    /// broke in a way that something shows.
    pub must_find: bool,
    /// The device found it: it told a fault, keeps one for the next host, was reset, or
    /// refused by the right name.
    pub found: bool,
    /// How long after it the first edge or code differs from what would have been, µs.
    pub changed_us: Option<u64>,
    /// For how long at a stretch a line was another, up to when the outputs were isolated,
    /// µs; of flips of the tape.
    pub shown_us: Option<u64>,
    /// The fault that the device told, or keeps.
    pub fault: Option<Fault>,
    /// When the device says that it found it, µs after it; nothing where it told nobody.
    pub told_us: Option<u64>,
    /// The chip was reset.
    pub reset: bool,
    /// How long after it the outputs were isolated for good, µs; nothing where they
    /// were not, or not by a fault.
    pub isolated_us: Option<u64>,
    /// What is severe with the stages as docs/hardware.md builds them.
    pub severe: Vec<String>,
    /// What is severe without what protects, and was not before anything broke.
    pub bare: Vec<String>,
    /// Pulses that it cut off or held, and that are excused: their net charge, µC.
    pub truncated_uc: Vec<f64>,
    /// A stage isolated itself.
    pub latched: bool,
    /// Why the simulator could not go on: what it does not model.
    pub stopped: Option<String>,
    /// What broke is not modelled, and its end is assumed: whatever came, it is not known to
    /// be harmless.
    pub assumed: bool,
    /// Why it was not played to the end.
    pub ended: CaseEnd,
}

/// Why a fork was not played to the end of its time.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum CaseEnd {
    /// It was, or the class has no such end.
    #[default]
    Played,
    /// Its outputs are isolated for good.
    Isolated,
    /// It is again in the state of the board that nothing broke.
    Reconverged,
    /// What broke is written again before anything reads it: nothing was played.
    Overwritten,
    /// Nothing touches what broke until the end: nothing was played.
    Untouched,
}

impl CaseEnd {
    /// As a table and a file have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Played => "played",
            Self::Isolated => "isolated",
            Self::Reconverged => "reconverged",
            Self::Overwritten => "overwritten",
            Self::Untouched => "untouched",
        }
    }
}

impl CaseResult {
    /// Of a fault that the simulator cannot play.
    pub(super) fn stopped(why: impl ToString) -> Self {
        Self {
            stopped: Some(why.to_string()),
            ..Self::default()
        }
    }

    /// Whether it is to be looked at.
    #[must_use]
    pub fn needs_review(&self) -> bool {
        !self.severe.is_empty() || self.must_find != self.found && self.stopped.is_none()
    }

    /// Whether anything came of it that somebody could see.
    #[must_use]
    pub fn has_effect(&self) -> bool {
        let severe = !self.severe.is_empty();
        self.changed_us.is_some() || self.found || self.reset || self.latched || severe
    }

    /// Whether it is known that nothing came of it.
    #[must_use]
    pub fn is_harmless(&self) -> bool {
        !self.has_effect() && !self.must_find && self.stopped.is_none() && !self.assumed
    }
}
