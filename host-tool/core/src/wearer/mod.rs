//! Wearer files: the thresholds and limits of the person who is stimulated.
//!
//! This module has the format of `host-tool/wearers/*.toml`, its reader, which uses the field
//! declarations of session files, its writer, and the entries that are appended to such a file. How
//! a session uses a wearer file is in `session`, and `flexor calibrate` finds the values.
//!
//! Input: a file, or measured values. Output: a checked [`Wearer`], or a file that reads as the
//! same wearer.

mod electrode;
mod fields;
mod judge;
mod limb;
mod limits;
mod read;
mod shipped;
mod store;
mod tiring;
mod unit;
mod write;

pub use electrode::{Electrode, Interval, Muscle, StrengthDuration, WidthError};
pub use fields::{INTERVALS_OF, manual, schema};
pub(crate) use limb::read_triple;
pub use limb::{Limb, Line};
pub(crate) use limits::{channel_limit_problem, limits, read_limits};
pub use read::is_wearer_file;
pub use shipped::{SHIPPED, builtin_wearer};
pub use store::{StoreError, append};
pub(crate) use tiring::{fatigue, read_fatigue};
pub use unit::Unit;

use crate::fields::SessionError;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use std::path::Path;

/// Schema version of the wearer files that this program reads and writes.
pub const SCHEMA: u16 = 1;

/// A person, or a simulated wearer, with the properties that stimulation depends on: the content of
/// a wearer file.
#[derive(Clone, PartialEq, Debug)]
pub struct Wearer {
    /// Pseudonym: 1 to 64 letters, digits and hyphens.
    pub name: String,
    /// Source of the wearer's numbers.
    pub evidence: Evidence,
    /// Paper and table, procedure, or assumption behind the numbers; 1 to 200 characters.
    pub source: String,
    /// Further remarks, at most 4000 characters.
    pub note: Option<String>,
    /// Limits on what the device may do to the wearer, such as current, charge and duration.
    pub limits: WearerSpec,
    /// Electrodes, at most ten, sorted by channel.
    pub electrodes: Vec<Electrode>,
    /// Dimensions of the forearm, from which a simulated forearm of this wearer is built.
    pub forearm: Option<Forearm>,
    /// Electrodes and strength of the muscles that move the elbow.
    pub elbow: Option<Elbow>,
    /// Model of the right arm, which sessions with forces at the hand need.
    pub limb: Option<Limb>,
    /// Changes of the wearer file, oldest first. Entries are appended and never removed.
    pub history: Vec<History>,
    /// Checks of whether thresholds have drifted, oldest first. Entries are appended and never
    /// removed.
    pub checks: Vec<DriftCheck>,
}

/// Source of a wearer's numbers, which says how far they can be trusted.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Evidence {
    /// The numbers are printed in a paper.
    Printed,
    /// The numbers were found on a simulated wearer, so they are no evidence about people.
    Simulated,
    /// The numbers were found on a person, with a board.
    Measured,
    /// The numbers are assumed; no measurement or simulation gave them.
    Assumed,
}

impl Evidence {
    /// Returns the word for this source in wearer files: "printed", "simulated", "measured" or
    /// "assumed".
    #[must_use]
    pub fn word(self) -> &'static str {
        let found = fields::EVIDENCE
            .iter()
            .find(|(_, evidence)| *evidence == self);
        found.map_or("", |(word, _)| word) // all are there
    }
}

/// Dimensions of a forearm, with the thresholds and positions of the finger's three electrodes on
/// it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Forearm {
    /// Distance from the elbow to the tip of the hand, m: 0.30–0.60.
    pub reach_m: f64,
    /// Circumference of the forearm, m: 0.15–0.45.
    pub around_m: f64,
    /// Thresholds of electrode A, electrode B and the extensor's electrode, V. If this is `None`,
    /// the motor thresholds of channels 1 to 3 are used, provided that they are voltages.
    pub thresholds_v: Option<[f64; 3]>,
    /// Centres of electrode A, electrode B and the extensor's electrode, mm. The first number is
    /// the distance along the forearm from the elbow. The second is the distance around it from the
    /// palmar midline, positive towards the thumb. `None` if they are to be searched.
    pub pads_mm: Option<[[f64; 2]; 3]>,
}

/// Electrodes that move the elbow, and the strength of its muscles.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Elbow {
    /// Channel of the electrode on the triceps, 1–10.
    pub triceps: u8,
    /// Channel of the electrode on the biceps, 1–10.
    pub biceps: u8,
    /// Torque of the fully recruited triceps at 50 Hz, N·m; `None` if unknown.
    pub triceps_nm: Option<f64>,
    /// Torque of the fully recruited biceps at 50 Hz, N·m; `None` if unknown.
    pub biceps_nm: Option<f64>,
}

/// Entry of the history: one change of a wearer file. Each text has 1 to 200 characters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct History {
    /// Time of the change: RFC 3339, or the time of a simulated device.
    pub at: String,
    /// Person (by pseudonym) or program that made the change.
    pub by: String,
    /// Description of the change.
    pub what: String,
    /// Name of the device with which the new values were found, if any.
    pub device: Option<String>,
    /// Firmware version of that device.
    pub firmware: Option<String>,
    /// Seed of the device, if it was simulated.
    pub seed: Option<u64>,
}

/// Drift check: a new search for a threshold, to see whether it has changed since it was found.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DriftCheck {
    /// Time of the check: RFC 3339, or the time of a simulated device; 1 to 200 characters.
    pub at: String,
    /// Channel whose threshold was checked, 1–10.
    pub channel: u8,
    /// Threshold in the wearer file, thousandths of `unit`.
    pub expected: Amplitude,
    /// Threshold that the check found, thousandths of `unit`; `None` if nothing moved.
    pub found: Option<Amplitude>,
    /// Unit of both thresholds.
    pub unit: Unit,
    /// Whether the found threshold was close enough to the expected one.
    pub accepted: bool,
    /// Person (by pseudonym) or program that carried out the check.
    pub by: Option<String>,
    /// Name of the device with which the threshold was searched, if any.
    pub device: Option<String>,
    /// Seed of the device, if it was simulated.
    pub seed: Option<u64>,
}

impl Wearer {
    /// Returns a wearer without electrodes, history or checks, with the device's own limits.
    #[must_use]
    pub fn new(name: &str, evidence: Evidence, source: &str) -> Self {
        Self {
            name: name.to_owned(),
            evidence,
            source: source.to_owned(),
            note: None,
            limits: WearerSpec::default(),
            electrodes: Vec::new(),
            forearm: None,
            elbow: None,
            limb: None,
            history: Vec::new(),
            checks: Vec::new(),
        }
    }

    /// Reads and checks the wearer file at `path`.
    ///
    /// # Errors
    /// E650 if the file cannot be read; E651 if it has another schema; E665 if it is no wearer
    /// file; otherwise all errors in it, each with line and field.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SessionError> {
        let path = path.as_ref();
        Self::parse(&path.display().to_string(), &Self::text(path)?)
    }

    /// Reads and checks the text of a wearer file. `name` is the file name in error messages.
    ///
    /// # Errors
    /// As [`Wearer::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        read::parse(name, text)
    }

    /// Reads the text of a wearer file without checking it.
    ///
    /// # Errors
    /// E650 if the file cannot be read.
    pub fn text(path: &Path) -> Result<String, SessionError> {
        read::text(path)
    }

    /// Returns the text of a complete wearer file, from which [`Wearer::parse`] returns an equal
    /// wearer.
    #[must_use]
    pub fn to_toml(&self) -> String {
        write::to_toml(self)
    }

    /// Returns the electrode on a channel (1–10), or `None` if the wearer file has none there.
    #[must_use]
    pub fn electrode(&self, channel: u8) -> Option<&Electrode> {
        self.electrodes
            .iter()
            .find(|electrode| electrode.channel == channel)
    }

    /// Returns the thresholds of electrode A, electrode B and the extensor's electrode on the
    /// forearm, V: those of `[forearm]`, or else the motor thresholds of channels 1 to 3. Returns
    /// `None` if one of these is missing or a current.
    #[must_use]
    pub fn forearm_thresholds_v(&self) -> Option<[f64; 3]> {
        let volts = |channel| {
            let electrode = self
                .electrode(channel)
                .filter(|electrode| electrode.unit == Unit::Volt);
            electrode.map(|electrode| f64::from(electrode.motor_threshold.get()) / 1e3)
        };
        let thresholds = self.forearm.and_then(|forearm| forearm.thresholds_v);
        thresholds.or_else(|| Some([volts(1)?, volts(2)?, volts(3)?]))
    }
}
