//! Where a record comes from: program, plan and host.

use crate::clock::Moment;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The program that recorded.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Program {
    /// Its version.
    pub version: String,
    /// The commit it was built from; `None` if that was no checkout.
    pub git: Option<String>,
    /// Whether the checkout had changes beyond that commit.
    pub modified: Option<bool>,
}

impl Program {
    /// This one.
    #[must_use]
    pub fn this() -> Self {
        let known = |text: &'static str| (!text.is_empty()).then_some(text);
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git: known(env!("FLEXOR_GIT")).map(str::to_owned),
            modified: known(env!("FLEXOR_MODIFIED")).map(|text| text == "true"),
        }
    }

    /// "0.1.0 (1a2b3c4d, modified)".
    #[must_use]
    pub fn words(&self) -> String {
        let git = self.git.as_ref().map(|git| {
            let short: String = git.chars().take(12).collect();
            let also = if self.modified == Some(true) {
                ", modified"
            } else {
                ""
            };
            format!(" ({short}{also})")
        });
        format!("{}{}", self.version, git.unwrap_or_default())
    }
}

/// What was ordered: everything that decides a simulated run, but for the
/// session files, which lie in the trials' folders.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Plan {
    /// "run", "demo", "experiment harris-wall".
    pub command: String,
    /// The device as `--device` named it, in words if it is of this program.
    pub device: String,
    /// The control law instead of the file's.
    pub law: Option<String>,
    /// Whether a latched fault was acknowledged first.
    pub acknowledge: bool,
    /// Whether the outputs were written as VCD.
    pub vcd: bool,
    /// Whether another image than the board's own was flashed: `image.elf`.
    pub image: bool,
    /// Wearers that an experiment drew; `arms` in older records.
    #[serde(alias = "arms")]
    pub draws: Option<u64>,
    /// What an experiment was made of: its declaration, then each session that names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub declared: Vec<Declared>,
}

/// A file that an experiment was made of; the record keeps it.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Declared {
    /// Its name, for a session as the declaration gives it.
    pub file: String,
    /// Its SHA-256, 64 hexadecimal digits.
    pub sha256: String,
}

/// Where a record keeps the sessions of its declaration.
pub(super) const DECLARED: &str = "declared";

impl Declared {
    /// Where the record keeps it, relative to its folder: `place` in the plan, from 0.
    #[must_use]
    pub fn kept_as(&self, place: usize) -> String {
        let name = Path::new(&self.file).file_name().unwrap_or_default();
        match place {
            0 => "declaration.toml".to_owned(),
            _ => format!("{DECLARED}/{place:02}-{}", name.to_string_lossy()),
        }
    }
}

impl Plan {
    /// A command without options.
    #[must_use]
    pub fn of(command: &str, device: &str) -> Self {
        Self {
            command: command.to_owned(),
            device: device.to_owned(),
            law: None,
            acknowledge: false,
            vcd: false,
            image: false,
            draws: None,
            declared: Vec::new(),
        }
    }
}

/// What the host knows of a run; a rerun differs in this block alone.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct HostFacts {
    /// When the record was begun, by the host's clock: UTC, RFC 3339.
    pub started_utc: String,
    /// The command line as it was given.
    pub arguments: Vec<String>,
    /// "linux x86_64".
    pub system: String,
    /// Simulated seconds per second of this computer, where that was measured.
    pub speed_factor: Option<f64>,
    /// Of which record this is a rerun.
    pub rerun_of: Option<String>,
}

impl HostFacts {
    /// Of this program and a record that is begun at `start`.
    #[must_use]
    pub fn at(start: Moment) -> Self {
        let arguments = std::env::args_os().map(|text| text.to_string_lossy().into_owned());
        Self {
            started_utc: start.utc(),
            arguments: arguments.collect(),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            speed_factor: None,
            rerun_of: None,
        }
    }
}

/// The device's clock against the host's, fitted to the answers of a trial.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ClockFit {
    /// Exchanges fitted.
    pub exchanges: u64,
    /// The shortest round trip, µs: half of it is how wrong the offset may be.
    pub round_trip_us: u64,
    /// Device time less host time at the first exchange, µs, modulo 2^32; host
    /// time counts from the opening of the port.
    pub offset_us: u32,
    /// How much faster the device's clock runs, parts per million; `None` for
    /// exchanges within less than a second.
    pub drift_ppm: Option<f64>,
    /// Root mean square of what the line leaves, µs.
    pub residual_us: f64,
}
