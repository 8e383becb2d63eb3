//! One injected fault and its result.

use firmware::safety::Fault;
use serde::{Deserialize, Serialize};

/// One injected fault and its judged effect.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Case {
    /// Number of the case, from 0. Class, seed and this number reproduce the case.
    pub index: u64,
    /// Device time at which the fault was injected, µs.
    pub moment_us: u64,
    /// Description of the fault: its kind, then `: ` and its random details.
    pub what: String,
    /// Effect of the fault on the device and at the electrode.
    pub fate: CaseResult,
}

impl Case {
    /// Creates a case; its description consists of `kind` and the random details `drawn`.
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

/// Effect of a fault on the device and at the electrode, as judged.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct CaseResult {
    /// Whether the device must detect the fault. It must if the fault changed an edge, if a setting
    /// is false, or if an electrode failed in a way that some measurement shows.
    pub must_find: bool,
    /// Whether the device detected the fault: it reported or stored a fault, was reset, or refused
    /// with the right number.
    pub found: bool,
    /// Time from the fault to the first edge or DAC code that differs from the undisturbed run, µs;
    /// `None` if the output is the same.
    pub changed_us: Option<u64>,
    /// Longest uninterrupted time for which an output line differed from the undisturbed run before
    /// the outputs were isolated, µs. Only set for bit flips of the pulse tape.
    pub shown_us: Option<u64>,
    /// Fault that the device reported, or stored across a reset.
    pub fault: Option<Fault>,
    /// Time from the injection to the detection, by the device's own time stamp of the fault, µs;
    /// `None` if the device reported no fault.
    pub told_us: Option<u64>,
    /// Whether the chip was reset.
    pub reset: bool,
    /// Time from the injection until the outputs were permanently isolated, µs; `None` if that
    /// never happened or had another cause than a fault.
    pub isolated_us: Option<u64>,
    /// Findings of the judge that are severe with the output stages of docs/reference/hardware.md.
    pub severe: Vec<String>,
    /// Findings that would be severe without protective circuits. Findings that the undisturbed run
    /// also has are left out.
    pub bare: Vec<String>,
    /// Net charge of each pulse that the fault truncated or prolonged, as far as the judge excuses
    /// it, µC.
    pub truncated_uc: Vec<f64>,
    /// Whether an output stage disconnected its outputs by its own protective circuit.
    pub latched: bool,
    /// Reason why the simulator could not continue: the chip did something that it does not model.
    pub stopped: Option<String>,
    /// Whether the effect of the fault was only assumed because the simulator does not model it.
    /// The case then never counts as harmless.
    pub assumed: bool,
    /// How the run of this case ended.
    pub ended: CaseEnd,
}

/// How the run of a case ended: at its configured time, or early because the result was certain.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub enum CaseEnd {
    /// The run lasted to its configured end.
    #[default]
    Played,
    /// The run ended early because the outputs were permanently isolated.
    Isolated,
    /// The run ended early because the board was again in the state of the undisturbed board.
    Reconverged,
    /// No run was needed: the damaged data are overwritten before anything reads them.
    Overwritten,
    /// No run was needed: nothing accesses the damaged data until the end.
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
    /// Creates the result of a case that the simulator cannot play, with the reason `why`.
    pub(super) fn stopped(why: impl ToString) -> Self {
        Self {
            stopped: Some(why.to_string()),
            ..Self::default()
        }
    }

    /// Returns whether a person should review the case: it is severe, or the device missed a fault,
    /// or it detected one that it need not detect.
    #[must_use]
    pub fn needs_review(&self) -> bool {
        !self.severe.is_empty() || self.must_find != self.found && self.stopped.is_none()
    }

    /// Returns whether the fault had any visible effect on the output or on the device.
    #[must_use]
    pub fn has_effect(&self) -> bool {
        let severe = !self.severe.is_empty();
        self.changed_us.is_some() || self.found || self.reset || self.latched || severe
    }

    /// Returns whether the fault certainly had no effect: none was visible, none was due, and the
    /// simulation was complete.
    #[must_use]
    pub fn is_harmless(&self) -> bool {
        !self.has_effect() && !self.must_find && self.stopped.is_none() && !self.assumed
    }
}
