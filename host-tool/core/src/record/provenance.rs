//! Origin of a record: program, plan and host.

use crate::clock::Moment;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the program that recorded a run.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Program {
    /// Version number of the program.
    pub version: String,
    /// Commit from which the program was built; `None` if the build found no Git checkout.
    pub git: Option<String>,
    /// Whether the checkout had changes that were not committed; `None` if that is not known.
    pub modified: Option<bool>,
    /// Schema hash of the link protocol, hexadecimal; `None` in records of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
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
            schema: Some(format!("{:#018x}", firmware::link::SCHEMA)),
        }
    }

    /// Returns the version with the commit, for example "0.1.0 (1a2b3c4d, modified)".
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

/// Command in the plan of a record whose setpoints a program decided on. Such a record cannot be
/// repeated from its folder alone.
pub const PROGRAM_COMMAND: &str = "python";

/// Command and options that determine a simulated run, together with the session files in the
/// folders of its trials.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Plan {
    /// Command, for example "run", "demo" or "experiment harris-wall".
    pub command: String,
    /// Device as it was given to `--device`, or a description if the device is part of this
    /// program.
    pub device: String,
    /// Name of the control law that replaced the session's own; `None` if none did.
    pub law: Option<String>,
    /// Whether the command acknowledged a latched fault before the run.
    pub acknowledge: bool,
    /// Whether the outputs were also written as a VCD file (value change dump).
    pub vcd: bool,
    /// Whether an image was flashed that the user chose instead of the default one; the record
    /// keeps it as `image.elf`.
    pub image: bool,
    /// Number of randomly generated wearers in an experiment; `None` for other commands. Older
    /// records name it `arms`.
    #[serde(alias = "arms")]
    pub draws: Option<u64>,
    /// Files that define an experiment: its declaration, then each session that the declaration
    /// names.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub declared: Vec<DeclaredFile>,
}

/// A file that defines an experiment; the record keeps a copy of it.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct DeclaredFile {
    /// Name of the file; for a session, as the declaration gives it.
    pub file: String,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
}

/// Name of the folder in which a record keeps the files that define its experiment.
pub(super) const DECLARED: &str = "declared";

impl DeclaredFile {
    /// Returns the path of the copy, relative to the record's folder. `place` is the index of the
    /// file in [`Plan::declared`].
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
    /// Returns the plan of a command that was run without options.
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

/// Facts about a run that only the host knows. A rerun of a simulated run differs from it only in
/// these.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct HostFacts {
    /// Time at which the record was begun, by the host's clock, in UTC in the format of RFC 3339.
    pub started_utc: String,
    /// Arguments of the program's command line.
    pub arguments: Vec<String>,
    /// Operating system and processor architecture, for example "linux x86_64".
    pub system: String,
    /// Simulated seconds per second of real time; `None` if that was not measured.
    pub speed_factor: Option<f64>,
    /// Record that this run repeats; `None` if it is not a rerun.
    pub rerun_of: Option<String>,
}

impl HostFacts {
    /// Collects the facts about this program and computer, for a record that is begun at `start`.
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

/// Fit of the device's clock to the host's clock, from all pairs of request and answer in a trial.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ClockFit {
    /// Number of pairs of request and answer in the fit.
    pub exchanges: u64,
    /// Shortest time from a request to its answer, µs. The error of the offset is at most half of
    /// it.
    pub round_trip_us: u64,
    /// Device time minus host time at the first pair of request and answer, µs, modulo 2^32. Host
    /// time counts from the opening of the port.
    pub offset_us: u32,
    /// Rate of the device's clock relative to the host's, parts per million; positive if it runs
    /// faster. `None` if all pairs of request and answer lie within less than a second.
    pub drift_ppm: Option<f64>,
    /// Root mean square of the differences between measured and fitted device time, µs.
    pub residual_us: f64,
}
