//! Wearer files: who is stimulated, with what thresholds, within what limits.
//!
//! Lives here: the format of `host-tool/wearers/*.toml`, its reader with the field
//! machinery of session files, its writer, what is appended to it.
//! Not here: how a session is played on a wearer (`session`), how one is found
//! (`flexor calibrate`).
//! In: a file, or what was measured. Out: a checked [`Wearer`]; a file that reads back to
//! the same.

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

pub use electrode::{Electrode, Interval, Muscle, StrengthDuration, Unfit};
pub use fields::{INTERVALS_OF, manual, schema};
pub(crate) use limb::triple;
pub use limb::{Limb, Line};
pub(crate) use limits::{beyond, limits, limits_of};
pub use read::is_one;
pub use shipped::{SHIPPED, shipped};
pub use store::{StoreError, append};
pub(crate) use tiring::{fatigue, read_fatigue};
pub use unit::Unit;

use crate::fields::SessionError;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use std::path::Path;

/// The schema of the wearer files that this program reads and writes.
pub const SCHEMA: u16 = 1;

/// A person, or a simulated body, as far as stimulation needs to know.
#[derive(Clone, PartialEq, Debug)]
pub struct Wearer {
    /// Pseudonym: 1 to 64 letters, digits and hyphens.
    pub name: String,
    /// Where its numbers are from.
    pub evidence: Evidence,
    /// The paper and table, the procedure, or what is assumed; 1 to 200 characters.
    pub source: String,
    /// Anything worth knowing, up to 4000 characters.
    pub note: Option<String>,
    /// What the device may do to them: as a session's `[wearer]`.
    pub limits: WearerSpec,
    /// At most ten, by rising channel.
    pub electrodes: Vec<Electrode>,
    /// The forearm, for simulated ones of its size.
    pub forearm: Option<Forearm>,
    /// The elbow's muscles.
    pub elbow: Option<Elbow>,
    /// The arm, for forces at the hand.
    pub limb: Option<Limb>,
    /// What was done to this file, oldest first; only ever appended.
    pub history: Vec<History>,
    /// Drift checks, oldest first; only ever appended.
    pub checks: Vec<DriftCheck>,
}

/// Where a wearer's numbers are from.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Evidence {
    /// A paper prints them.
    Printed,
    /// Found on a simulated body: no evidence about people.
    Simulated,
    /// Found on a person, by a board.
    Measured,
    /// Nobody found them.
    Assumed,
}

impl Evidence {
    /// Its word in files: "printed", "simulated", "measured", "assumed".
    #[must_use]
    pub fn word(self) -> &'static str {
        let found = fields::EVIDENCE
            .iter()
            .find(|(_, evidence)| *evidence == self);
        found.map_or("", |(word, _)| word) // all are there
    }
}

/// A forearm's size, and where the finger's electrodes are on it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Forearm {
    /// Elbow to tip of the hand, m: 0.30–0.60.
    pub reach_m: f64,
    /// Around the forearm, m: 0.15–0.45.
    pub around_m: f64,
    /// Thresholds of A, B and the extensor's point, V; of a file that does not say them
    /// here, the motor thresholds of its channels 1 to 3 where these are voltages.
    pub thresholds_v: Option<[f64; 3]>,
    /// Where the middles of their electrodes lie, mm: along from the elbow, around from
    /// the palmar midline, positive to the thumb.
    pub pads_mm: Option<[[f64; 2]; 3]>,
}

/// Which electrodes are the elbow's, and how strong its muscles are.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Elbow {
    /// The triceps' channel, 1–10.
    pub triceps: u8,
    /// The biceps' channel, 1–10.
    pub biceps: u8,
    /// Torque of all of the triceps at 50 Hz, N·m.
    pub triceps_nm: Option<f64>,
    /// Torque of all of the biceps at 50 Hz, N·m.
    pub biceps_nm: Option<f64>,
}

/// One thing that was done to a wearer's file. Texts are of 1 to 200 characters.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct History {
    /// When: RFC 3339, or a device's time.
    pub at: String,
    /// Who did it; a pseudonym, or a program.
    pub by: String,
    /// What was done.
    pub what: String,
    /// On which device.
    pub device: Option<String>,
    /// Its firmware's version.
    pub firmware: Option<String>,
    /// Of a simulated one.
    pub seed: Option<u64>,
}

/// A threshold looked for again.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct DriftCheck {
    /// When: RFC 3339, or a device's time; 1 to 200 characters.
    pub at: String,
    /// The channel, 1–10.
    pub channel: u8,
    /// The threshold that the file has, thousandths of the unit.
    pub expected: Amplitude,
    /// What was found; nothing if nothing moved.
    pub found: Option<Amplitude>,
    /// What both are in.
    pub unit: Unit,
    /// Whether that was near enough.
    pub accepted: bool,
    /// Who looked: a pseudonym, or a program.
    pub by: Option<String>,
    /// On which device.
    pub device: Option<String>,
    /// Of a simulated one.
    pub seed: Option<u64>,
}

impl Wearer {
    /// A wearer of whom nothing is known but this, within the device's own limits.
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

    /// Reads and checks a wearer file.
    ///
    /// # Errors
    /// E650: it cannot be read; E651: it is of another schema; else everything that is
    /// wrong with it, with line and field.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SessionError> {
        let path = path.as_ref();
        Self::parse(&path.display().to_string(), &Self::text(path)?)
    }

    /// Reads and checks the text of a wearer file called `name`.
    ///
    /// # Errors
    /// As [`Wearer::read`].
    pub fn parse(name: &str, text: &str) -> Result<Self, SessionError> {
        read::parse(name, text)
    }

    /// Reads the text of a wearer file.
    ///
    /// # Errors
    /// E650.
    pub fn text(path: &Path) -> Result<String, SessionError> {
        read::text(path)
    }

    /// The whole file: what [`Wearer::parse`] makes this of again.
    #[must_use]
    pub fn to_toml(&self) -> String {
        write::to_toml(self)
    }

    /// The electrode of a channel, 1–10.
    #[must_use]
    pub fn electrode(&self, channel: u8) -> Option<&Electrode> {
        self.electrodes
            .iter()
            .find(|electrode| electrode.channel == channel)
    }

    /// Thresholds of A, B and the extensor's point on the forearm, V: as it says them, or
    /// those of channels 1 to 3.
    #[must_use]
    pub fn forearm_thresholds_v(&self) -> Option<[f64; 3]> {
        let volts = |channel| {
            let electrode = self
                .electrode(channel)
                .filter(|electrode| electrode.unit == Unit::Volt);
            electrode.map(|electrode| f64::from(electrode.motor_threshold.get()) / 1e3)
        };
        let said = self.forearm.and_then(|forearm| forearm.thresholds_v);
        said.or_else(|| Some([volts(1)?, volts(2)?, volts(3)?]))
    }
}
