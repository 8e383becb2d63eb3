//! Records: the data of a run, that is the session, the device's answers and the edges at its pins.
//!
//! This module has [`Run`] and its parts, reads and writes CSV, and has the [`Recorder`], which
//! keeps every row on disk while a trial is running. Numbers computed from the data are in
//! `analysis`, pictures in `report`.
//!
//! Input: telemetry, edges, counters, events. Output: a folder that [`load`] reads.

mod channel;
mod columns;
mod damage;
mod difference;
mod disk;
mod document;
mod ending;
mod error;
mod folder;
mod identity;
mod marker;
mod place;
mod provenance;
mod recorder;
mod sample;
mod samples;
mod table;
mod worn;

pub use crate::disk::{Disk, FileSystem};
pub use channel::ChannelInfo;
pub use columns::{Column, ColumnScope, EDGES, MARKERS, SAMPLES};
pub use damage::RowCounts;
pub use difference::{Difference, compare_rows};
pub use disk::{replace_file, replace_file_on, trial_folder};
pub use document::document;
pub use ending::{Completeness, Ending, write_summary};
pub use error::RecordError;
pub use folder::{load, load_each, save, write_header, write_header_on, write_run, write_run_on};
pub use identity::{DeviceKind, Identity};
pub use marker::{Marker, MarkerKind, read_markers};
pub use place::{Place, check_writable};
pub use provenance::{ClockFit, DeclaredFile, HostFacts, PROGRAM_COMMAND, Plan, Program};
pub use recorder::Recorder;
pub use sample::{DeviceState, Sample};
pub use samples::Samples;
pub use table::{
    Field, read_edges, read_samples, sample_columns, visit_sample, write_edges, write_samples,
};
pub use worn::TrialWearer;

use crate::clock::Moment;
use crate::session::Study;
use serde::{Deserialize, Serialize};

/// One or more trials that were run on one device for a common purpose, as one record contains
/// them.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// Version of the record's format. Records that this program writes have [`FORMAT`]; a record
    /// without a number has format 1.
    #[serde(default = "first_format")]
    pub format: u32,
    /// Title of the run, and heading of its report.
    pub title: String,
    /// Name of the device: "native simulator", the name of a port, ….
    pub device: String,
    /// Seed from which all random values of the run are generated; `None` if only the program that
    /// serves the device knows it.
    pub seed: Option<u64>,
    /// Program that recorded the run.
    #[serde(default)]
    pub program: Program,
    /// Command and options that started the run; `None` in records of format 1.
    #[serde(default)]
    pub plan: Option<Plan>,
    /// Facts about the study that the user entered, such as the wearer's pseudonym.
    #[serde(default)]
    pub study: Study,
    /// SHA-256 of the image that the device ran, if this program provided the image.
    #[serde(default)]
    pub image_sha256: Option<String>,
    /// Trials in the order in which they were run. Each has a folder in the record.
    #[serde(skip)]
    pub trials: Vec<Trial>,
    /// Values that a paper reports for the same trials, for comparison.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<PaperRow>,
    /// Sentences before the result that explain what is tried; without them there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub explained: Vec<String>,
    /// Main result of the run in one sentence, with which the report begins; `None` to derive it
    /// from the trials.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<String>,
    /// Assumptions behind a simulation, and outcomes that it computed, to be listed in the report.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<Assumption>,
    /// Facts that only the host knows. A rerun of a simulated run differs from it only in these.
    #[serde(default)]
    pub host: HostFacts,
    /// How the run ended; stored in `summary.json`.
    #[serde(skip)]
    pub ending: Ending,
    /// Data that the record has lost since it was closed, one phrase for each loss; filled in by
    /// [`load`].
    #[serde(skip)]
    pub damage: Vec<String>,
}

/// Version of the record's format that this program writes. A change that older programs cannot
/// read raises it.
pub const FORMAT: u32 = 2;

const fn first_format() -> u32 {
    1
}

/// Returns the SHA-256 of `bytes` as 64 hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    use sha2::Digest;
    let digest = sha2::Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Run {
    /// Returns a run without trials, recorded by this program from `start` on.
    #[must_use]
    pub fn begin(title: &str, device: &str, seed: Option<u64>, plan: Plan, start: Moment) -> Self {
        Self {
            format: FORMAT,
            title: title.to_owned(),
            device: device.to_owned(),
            seed,
            program: Program::current(),
            plan: Some(plan),
            host: HostFacts::collect(start),
            ..Self::default()
        }
    }

    /// Returns the command that repeats the run when it is typed in the record's folder. A
    /// simulated run of this program is repeated byte for byte; for any other run, its first
    /// session is run again. A run whose setpoints a program decided on is repeated by that program,
    /// whose name is in [`HostFacts::arguments`].
    #[must_use]
    pub fn how_to_reproduce(&self) -> &'static str {
        let command = self.plan.as_ref().map(|plan| &*plan.command);
        match self.is_repeatable() {
            _ if command == Some(PROGRAM_COMMAND) => "python3 PROGRAM.py",
            true => "flexor rerun .",
            false => "flexor run 01-*/session.toml --device PORT",
        }
    }

    /// Returns whether every device that answered ran inside this program, so that a rerun gives
    /// the same data.
    #[must_use]
    pub fn is_repeatable(&self) -> bool {
        let mut devices = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        devices.all(|identity| identity.in_process)
    }

    /// Returns whether the wearer was simulated: the device reported it, or a sample has a true
    /// angle, which only a simulated wearer can provide. The name of the device proves nothing,
    /// because anyone can choose it.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.trials.iter().any(Trial::is_simulated)
    }

    /// Returns whether the wearer was simulated, or `None` if no device has answered yet and
    /// nothing is known.
    #[must_use]
    pub fn simulated_if_known(&self) -> Option<bool> {
        let is_simulated = self.is_simulated();
        (is_simulated || self.device_kind().is_some()).then_some(is_simulated)
    }

    /// Returns the seed as text for people, also if it is not known.
    #[must_use]
    pub fn seed_in_words(&self) -> String {
        self.seed
            .map_or_else(|| "unknown".to_owned(), |seed| seed.to_string())
    }

    /// Returns the kind of device that stimulated; `None` if no device has answered yet.
    #[must_use]
    pub fn device_kind(&self) -> Option<DeviceKind> {
        let mut identities = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        identities.next().map(|identity| identity.kind)
    }

    /// Returns a description of the device that stimulated: the kind that it reported, and its
    /// name.
    #[must_use]
    pub fn device_in_words(&self) -> String {
        let device_identity = self.trials.iter().find_map(|trial| trial.identity.as_ref());
        device_identity.map_or_else(
            || self.device.clone(),
            |identity| identity.kind.format_with_name(&self.device),
        )
    }
}

/// One uninterrupted run of a session, with all its data.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Trial {
    /// Name of the trial for people, for example "two-point".
    pub name: String,
    /// Name of the session file that the trial ran.
    pub session_file: String,
    /// Identity that the device reported; `None` if the device never answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<Identity>,
    /// Text of the session file, stored beside the rows as `session.toml`.
    #[serde(skip)]
    pub session_text: String,
    /// SHA-256 of the session file, 64 hexadecimal digits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session_sha256: Option<String>,
    /// Wearer file that the session names, stored beside the rows as `wearer.toml`; `None` if it
    /// names none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wearer: Option<TrialWearer>,
    /// Settings that the choice for `[fidelity]` found; `None` for a session without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<FidelityFound>,
    /// Fit of the device's clock to the host's clock; `None` if there was no answer to fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<ClockFit>,
    /// Duration of the trial, s.
    pub duration_s: f64,
    /// Channels in use, in the order of the entries of `Sample::amplitudes`.
    pub channels: Vec<ChannelInfo>,
    /// Telemetry, oldest first.
    #[serde(default, skip_serializing_if = "Samples::is_empty")]
    pub samples: Samples,
    /// Changes of the switch states in one period, oldest first. Before its first edge a channel is
    /// disconnected.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<Edge>,
    /// Whether the device controlled the angle of a joint. Tracking errors are computed only then.
    #[serde(default)]
    pub joint: bool,
    /// Virtual wall that the device rendered, if the session has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<WallPlace>,
    /// Window over which metrics are computed, as start and end in s; `None` for the whole trial.
    pub measure: Option<(f64, f64)>,
    /// Number of pulses with an amplitude above 0 that were output; `None` if it is unknown.
    #[serde(default)]
    pub pulses: Option<u64>,
    /// Most likely reason why no pulses were output; `None` if there were pulses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silent: Option<String>,
    /// Counters of the device by name, such as frames or pulses. If the device was already running,
    /// these are the differences between the end and the beginning of the trial.
    pub counters: Vec<(String, u64)>,
    /// Events that the device reported or the host noted: the time of each, s, and a description.
    pub events: Vec<(f64, String)>,
    /// Actions at the controls and edges of the trigger input, oldest first. They are stored in
    /// `markers.csv`, which also has the edges of the sync output.
    #[serde(skip)]
    pub markers: Vec<Marker>,
    /// Readings of the electrode check before the device was armed, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub electrode_check: Vec<ElectrodeReading>,
}

/// Reading of the electrode check on one channel, from which the device decides whether an
/// electrode is connected.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ElectrodeReading {
    /// Channel number, from 1.
    pub channel: u8,
    /// Amplitude that was applied, in the channel's unit.
    pub applied: f64,
    /// Current that flowed, mA.
    pub current_ma: f64,
    /// Load that a voltage stage measured, Ω: voltage divided by current. Infinite if no current
    /// flowed, which is `None` in a loaded record. `None` also for a current stage, which does not
    /// measure its voltage.
    pub load_ohm: Option<f64>,
}

impl Trial {
    /// Returns whether the wearer of this trial was simulated, by the same evidence as
    /// [`Run::is_simulated`].
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        let is_declared = self
            .identity
            .as_ref()
            .is_some_and(|identity| identity.simulated);
        is_declared
            || self
                .samples
                .map_each(|s| s.true_deg.is_some())
                .any(|is_known| is_known)
    }

    /// Returns whether the trial has a reference or a wall: an angle to follow, a virtual wall, or
    /// a wanted force of a channel. All other trials are open loop.
    #[must_use]
    pub fn has_reference(&self) -> bool {
        self.joint || self.wall.is_some() || self.channels.iter().any(|c| c.force)
    }

    /// Returns the predicted force of a channel, N; `None` without a muscle, and if no force was
    /// predicted.
    #[must_use]
    pub fn force_n(&self, sample: &Sample, channel: u8) -> Option<f64> {
        let place = self.channel_index(channel, |c| c.muscle)?;
        sample.forces_n.get(place).copied().flatten()
    }

    /// Returns the wanted force of a channel, N; `None` without force control, and before the first
    /// setpoint.
    #[must_use]
    pub fn wanted_n(&self, sample: &Sample, channel: u8) -> Option<f64> {
        let place = self.channel_index(channel, |c| c.force)?;
        sample.wanted_n.get(place).copied().flatten()
    }

    /// Returns the nearest forces below and above the wanted force that the limits of a channel
    /// allow, N; `None` if the limits allow the wanted force itself.
    #[must_use]
    pub fn nearest_forces_n(&self, sample: &Sample, channel: u8) -> Option<(f64, f64)> {
        let place = self.channel_index(channel, |c| c.force)?;
        let side = |list: &[Option<f64>]| list.get(place).copied().flatten();
        side(&sample.below_n).zip(side(&sample.above_n))
    }

    /// Returns the index of a channel among those channels for which `has` is true. This is its
    /// index in a list of a sample, which has entries only for these channels.
    pub(crate) fn channel_index(
        &self,
        channel: u8,
        has: fn(&ChannelInfo) -> bool,
    ) -> Option<usize> {
        let mut channels = self.channels.iter().filter(|c| has(c));
        channels.position(|c| c.number == channel)
    }
}

/// Position of a virtual wall.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct WallPlace {
    /// Joint angle at the surface of the wall, degrees.
    pub at_deg: f64,
    /// Whether the wall stops flexion, so that the limb is inside it at larger angles; if false, at
    /// smaller angles.
    pub stops_flexion: bool,
    /// Thickness of the pre-wall, which begins this far in front of the wall, degrees; 0 without a
    /// pre-wall.
    pub pre_wall_deg: f64,
}

/// Settings that a session with `[fidelity]` ran with.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct FidelityFound {
    /// Period of telemetry, ms.
    pub telemetry_ms: u16,
    /// Period of the control law, ms; `None` if there is no control law.
    pub law_period_ms: Option<u8>,
    /// Time step of the simulated finger, µs; `None` if there is no simulated finger.
    pub finger_step_us: Option<u32>,
    /// Number of motor units that were simulated for each pool of the hand; `None` for every unit,
    /// and if there is no simulated hand.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_units: Option<u32>,
    /// Time step of the simulated arm, ms; `None` if there is no simulated arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm_step_ms: Option<u32>,
}

/// A change of the switch state of one channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Edge {
    /// Time since the start of the recorded period, µs.
    pub t_us: u64,
    /// Channel number, from 1.
    pub channel: u8,
    /// State from this time on.
    pub state: State,
    /// Amplitude code of the channel's DAC, 0–65535.
    pub dac_code: u16,
}

/// State of a channel's output switches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Both electrodes are open.
    Isolated,
    /// Current flows out of the active electrode.
    Anodic,
    /// Current flows into the active electrode.
    Cathodic,
    /// Both electrodes are connected to the common return, so that no voltage drives the tissue.
    Grounded,
}

/// Values that a paper reports for trials of this kind. Several rows may belong to one trial.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct PaperRow {
    /// Name of the trial, [`Trial::name`], with which the values are compared.
    pub trial: String,
    /// Root mean square errors of the paper's own trials, degrees, in the order in which the paper
    /// prints them.
    pub values: Vec<f64>,
    /// Source of the values, for example "table 8, participant P".
    pub source: String,
}

impl PaperRow {
    /// Returns the arithmetic mean of the values, degrees; `None` without values.
    pub fn mean(&self) -> Option<f64> {
        (!self.values.is_empty())
            .then(|| self.values.iter().sum::<f64>() / self.values.len() as f64)
    }
}

/// A statement that helps a reader to judge a simulated result.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Assumption {
    /// Whether the statement is an assumption of the simulation or one of its outcomes.
    pub role: Role,
    /// The statement, in one sentence.
    pub text: String,
}

/// Whether a statement about a simulation is an assumption or an outcome.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Assumption that was put into the simulated wearer or the experiment.
    PutIn,
    /// Outcome that the run computed.
    CameOut,
}
