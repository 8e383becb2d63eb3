//! One injected fault and its result.

use firmware::safety::Fault;
use serde::{Deserialize, Serialize};

/// One injected fault and its result.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Case {
    /// Number of the case, from 0; class, seed and number reproduce it.
    pub index: u64,
    /// Device time of the fault, µs.
    pub moment_us: u64,
    /// Description: kind, then `: ` and details.
    pub what: String,
    /// Effect of the fault.
    pub fate: CaseResult,
}

impl Case {
    /// Creates a case from its kind, its random details, its index and moment, and its result.
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

    /// Returns the kind of fault: the text before the first `: `, or `None` if there is none.
    #[must_use]
    pub fn kind(&self) -> Option<&str> {
        self.what.split_once(": ").map(|(kind, _)| kind)
    }
}

/// Effect of a fault on the device and at the electrode.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CaseResult {
    /// Whether the device must detect the fault: it changes an edge, a setting is false, or an
    /// electrode failed in a way that some measurement shows.
    pub must_find: bool,
    /// Whether the device detected the fault: it reported or stored a fault, was reset, or refused
    /// with the right number.
    pub found: bool,
    /// Time from the fault to the first edge or DAC code that differs from the undisturbed run, µs.
    pub changed_us: Option<u64>,
    /// Longest uninterrupted time for which a line differed, until the outputs were isolated, µs;
    /// only for bit flips of the pulse tape.
    pub shown_us: Option<u64>,
    /// Fault that the device reported or stored.
    pub fault: Option<Fault>,
    /// Time from the injection to the detection, as the device reports it, µs; `None` without a
    /// report.
    pub told_us: Option<u64>,
    /// Whether the chip was reset.
    pub reset: bool,
    /// Time from the injection until the outputs were permanently isolated, µs; `None` if that
    /// never happened or had another cause than a fault.
    pub isolated_us: Option<u64>,
    /// Severe findings with the output stages of docs/hardware.md.
    pub severe: Vec<String>,
    /// Severe findings without protective circuits, unless they existed before the injection.
    pub bare: Vec<String>,
    /// Net charge of the pulses that the fault truncated or held and that are excused, µC.
    pub truncated_uc: Vec<f64>,
    /// Whether an output stage isolated itself.
    pub latched: bool,
    /// Reason why the simulator could not continue: behaviour that it does not model.
    pub stopped: Option<String>,
    /// Whether the effect is assumed because the simulator does not model it; then no outcome
    /// counts as harmless.
    pub assumed: bool,
    /// Reason why the fork ended early.
    pub ended: CaseEnd,
}

/// Reason why a fork ended before its configured time.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum CaseEnd {
    /// The fork ran to its end, or the class never ends early.
    #[default]
    Played,
    /// The outputs are permanently isolated.
    Isolated,
    /// The state is again that of the undisturbed board.
    Reconverged,
    /// The damaged data are overwritten before any read; no fork was needed.
    Overwritten,
    /// Nothing accesses the damaged data until the end; no fork was needed.
    Untouched,
}

impl CaseEnd {
    /// Returns the name that tables and files use.
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
    /// Creates the result of a fault that the simulator cannot play.
    pub(super) fn stopped(why: impl ToString) -> Self {
        Self {
            stopped: Some(why.to_string()),
            ..Self::default()
        }
    }

    /// Returns whether the case needs manual review.
    #[must_use]
    pub fn needs_review(&self) -> bool {
        !self.severe.is_empty() || self.must_find != self.found && self.stopped.is_none()
    }

    /// Returns whether the fault had any visible effect.
    #[must_use]
    pub fn has_effect(&self) -> bool {
        let severe = !self.severe.is_empty();
        self.changed_us.is_some() || self.found || self.reset || self.latched || severe
    }

    /// Returns whether the fault certainly had no effect.
    #[must_use]
    pub fn is_harmless(&self) -> bool {
        !self.has_effect() && !self.must_find && self.stopped.is_none() && !self.assumed
    }
}
