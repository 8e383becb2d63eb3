//! Origin of a record: program, plan and host.

use crate::clock::Moment;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Program that recorded a run.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Program {
    /// Version number of the program.
    pub version: String,
    /// Commit from which the program was built; `None` if it was not built in a checkout.
    pub git: Option<String>,
    /// Whether the checkout had changes beyond that commit.
    pub modified: Option<bool>,
}

impl Program {
    /// Returns the description of the running program.
    #[must_use]
    pub fn current() -> Self {
        let known = |text: &'static str| (!text.is_empty()).then_some(text);
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git: known(env!("FLEXOR_GIT")).map(str::to_owned),
            modified: known(env!("FLEXOR_MODIFIED")).map(|text| text == "true"),
        }
    }

    /// Formats the program for people, for example "0.1.0 (1a2b3c4d, modified)".
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

/// Everything that determines a simulated run, except for the session files, which are in the
/// trials' folders.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Plan {
    /// Command, for example "run", "demo" or "experiment harris-wall".
    pub command: String,
    /// Device as given by `--device`; in words if it is part of this program.
    pub device: String,
    /// Control law that replaces the one of the session file.
    pub law: Option<String>,
    /// Whether a latched fault was acknowledged first.
    pub acknowledge: bool,
    /// Whether the outputs were written as VCD.
    pub vcd: bool,
    /// Whether an image other than the board's own was flashed; the record keeps it as `image.elf`.
    pub image: bool,
    /// Number of randomly generated wearers in an experiment; `arms` in older records.
    #[serde(alias = "arms")]
    pub draws: Option<u64>,
    /// Files from which an experiment was made: its declaration, then each session that it names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub declared: Vec<DeclaredFile>,
}

/// A file from which an experiment was made; the record keeps a copy.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct DeclaredFile {
    /// Name of the file; for a session, as the declaration gives it.
    pub file: String,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
}

/// Folder in which a record keeps the sessions of its declaration.
pub(super) const DECLARED: &str = "declared";

impl DeclaredFile {
    /// Returns the path of the copy relative to the record's folder; `place` is the index in the
    /// plan, from 0.
    #[must_use]
    pub fn copy_path(&self, place: usize) -> String {
        let name = Path::new(&self.file).file_name().unwrap_or_default();
        match place {
            0 => "declaration.toml".to_owned(),
            _ => format!("{DECLARED}/{place:02}-{}", name.to_string_lossy()),
        }
    }
}

impl Plan {
    /// Returns the plan of a command without options.
    #[must_use]
    pub fn new(command: &str, device: &str) -> Self {
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

/// Facts about a run that only the host knows; a rerun differs in this block alone.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct HostFacts {
    /// Time at which the record was begun, by the host's clock: UTC, RFC 3339.
    pub started_utc: String,
    /// Command line as it was given.
    pub arguments: Vec<String>,
    /// Operating system and processor architecture, for example "linux x86_64".
    pub system: String,
    /// Simulated seconds per second of this computer, if that was measured.
    pub speed_factor: Option<f64>,
    /// Record of which this run is a rerun.
    pub rerun_of: Option<String>,
}

impl HostFacts {
    /// Returns the facts about this program and a record that is begun at `start`.
    #[must_use]
    pub fn collect(start: Moment) -> Self {
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

/// Fit of the device's clock to the host's, from the answers of a trial.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ClockFit {
    /// Number of exchanges in the fit.
    pub exchanges: u64,
    /// Shortest round trip, µs; the error of the offset is at most half of it.
    pub round_trip_us: u64,
    /// Device time minus host time at the first exchange, µs, modulo 2^32; host time counts from
    /// the opening of the port.
    pub offset_us: u32,
    /// Excess rate of the device's clock, parts per million; positive if it runs faster. `None` if
    /// the exchanges span less than a second.
    pub drift_ppm: Option<f64>,
    /// Root mean square of the residuals, µs.
    pub residual_us: f64,
}
