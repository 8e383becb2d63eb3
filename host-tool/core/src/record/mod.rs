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
pub use disk::{replace_file, trial_folder};
pub use document::document;
pub use ending::{Completeness, Ending, write_summary};
pub use error::RecordError;
pub use folder::{load, load_each, save, write_header, write_run};
pub use identity::{DeviceKind, Identity};
pub use marker::{Marker, MarkerKind, read_markers};
pub use place::{Place, check_writable};
pub use provenance::{ClockFit, DeclaredFile, HostFacts, Plan, Program};
pub use recorder::Recorder;
pub use sample::{DeviceState, Sample};
pub use samples::Samples;
pub use table::{read_edges, read_samples, write_edges, write_samples};
pub use worn::TrialWearer;

use crate::clock::Moment;
use crate::session::Study;
use serde::{Deserialize, Serialize};

/// One or more trials with a common purpose on one device.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// Format of the record: [`FORMAT`] in records that this program writes, 1 in records without a
    /// number.
    #[serde(default = "first_format")]
    pub format: u32,
    /// Title of the run, and heading of its report.
    pub title: String,
    /// Name under which the device was given: "native simulator", the name of a port, ….
    pub device: String,
    /// Seed of all random values; `None` if only the program that serves the device knows it.
    pub seed: Option<u64>,
    /// Program that recorded the run.
    #[serde(default)]
    pub program: Program,
    /// Command that started the run; `None` in records of the first format.
    #[serde(default)]
    pub plan: Option<Plan>,
    /// Facts about the study that only people know.
    #[serde(default)]
    pub study: Study,
    /// SHA-256 of the image that the device ran, if this program provided the image.
    #[serde(default)]
    pub image_sha256: Option<String>,
    /// Trials in the order in which they were run; each has a folder of its own.
    #[serde(skip)]
    pub trials: Vec<Trial>,
    /// Values that a paper printed for the same trials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<PaperRow>,
    /// Result of the comparison that the run is about, in a sentence with which the report begins.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<String>,
    /// Assumptions of a simulation, and its outcomes.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<Assumption>,
    /// Facts that only the host knows; a rerun differs in these alone.
    #[serde(default)]
    pub host: HostFacts,
    /// Ending of the run; stored in `summary.json`.
    #[serde(skip)]
    pub ending: Ending,
    /// Data that the record has lost since it was closed, one phrase each; [`load`] fills it in.
    #[serde(skip)]
    pub damage: Vec<String>,
}

/// Format of the records that this program writes.
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
    /// Returns a run without trials that this program begins at `start`.
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

    /// Returns the command that repeats the run when typed in its folder. For a simulated run of
    /// this program it gives the same bytes, for any other run the same session.
    #[must_use]
    pub fn how_to_reproduce(&self) -> &'static str {
        match self.is_repeatable() {
            true => "flexor rerun .",
            false => "flexor run 01-*/session.toml --device PORT",
        }
    }

    /// Returns whether every device that answered ran in this program, in virtual time.
    #[must_use]
    pub fn is_repeatable(&self) -> bool {
        let mut devices = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        devices.all(|identity| identity.in_process)
    }

    /// Returns whether a simulator stood in for the wearer: the device reported it, or a true angle
    /// is known, which only a simulated wearer can provide. The name of the device is no evidence,
    /// because anyone can choose it.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.trials.iter().any(Trial::is_simulated)
    }

    /// Returns [`Run::is_simulated`], or `None` if no device has answered, because the kind is then
    /// unknown.
    #[must_use]
    pub fn simulated_if_known(&self) -> Option<bool> {
        let is_simulated = self.is_simulated();
        (is_simulated || self.device_kind().is_some()).then_some(is_simulated)
    }

    /// Returns the seed as text for people.
    #[must_use]
    pub fn seed_in_words(&self) -> String {
        self.seed
            .map_or_else(|| "unknown".to_owned(), |seed| seed.to_string())
    }

    /// Returns the kind of device that stimulated, or `None` until a device has answered.
    #[must_use]
    pub fn device_kind(&self) -> Option<DeviceKind> {
        let mut said = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        said.next().map(|identity| identity.kind)
    }

    /// Returns the device that stimulated, as text for people: its kind as reported, and its name.
    #[must_use]
    pub fn device_in_words(&self) -> String {
        let said = self.trials.iter().find_map(|trial| trial.identity.as_ref());
        said.map_or_else(
            || self.device.clone(),
            |identity| identity.kind.format_with_name(&self.device),
        )
    }
}

/// One uninterrupted stimulation, with all its data.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Trial {
    /// Name of the trial for people, for example "two-point".
    pub name: String,
    /// Session file that describes the trial.
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
    /// Wearer file that the session names, stored beside the rows as `wearer.toml`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wearer: Option<TrialWearer>,
    /// Result of `[fidelity]`, if the session has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<FidelityFound>,
    /// Fit of the device's clock to the host's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<ClockFit>,
    /// Duration of the trial, s.
    pub duration_s: f64,
    /// Channels in use, in the order of `Sample::amplitudes`.
    pub channels: Vec<ChannelInfo>,
    /// Telemetry, oldest first.
    #[serde(default, skip_serializing_if = "Samples::is_empty")]
    pub samples: Samples,
    /// Changes of the switch states in one period, oldest first. A channel is disconnected until
    /// its first edge.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<Edge>,
    /// Whether the device controlled the angle of a joint; the angle is assessed only then.
    #[serde(default)]
    pub joint: bool,
    /// Virtual wall, if the session has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<WallPlace>,
    /// Part that metrics assess, from–to in s; the whole trial if `None`.
    pub measure: Option<(f64, f64)>,
    /// Number of pulses with an amplitude above 0 that were output; `None` if it is unknown.
    #[serde(default)]
    pub pulses: Option<u64>,
    /// Most likely reason why there were no pulses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silent: Option<String>,
    /// Named counts of the trial: frames, pulses, …. If the device was already running, the
    /// difference between the counts at the trial's end and at its beginning.
    pub counters: Vec<(String, u64)>,
    /// Events of the trial, each with its time in s.
    pub events: Vec<(f64, String)>,
    /// Actions at the controls, and edges of the trigger input, oldest first; stored in
    /// `markers.csv`, which also has the edges of the sync output.
    #[serde(skip)]
    pub markers: Vec<Marker>,
    /// Readings of the electrode check during arming, in order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub electrode_check: Vec<ElectrodeReading>,
}

/// Reading of the electrode check of arming on one channel.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ElectrodeReading {
    /// Channel number, from 1.
    pub channel: u8,
    /// Amplitude that was applied, in the channel's unit.
    pub applied: f64,
    /// Current that flowed, mA.
    pub current_ma: f64,
    /// Load at a voltage stage, voltage divided by current, Ω; `None` without current, and for a
    /// current stage, which does not measure its voltage.
    pub load_ohm: Option<f64>,
}

impl Trial {
    /// Returns whether a simulator stood in for the wearer, as [`Run::is_simulated`] defines it.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        let said = self
            .identity
            .as_ref()
            .is_some_and(|identity| identity.simulated);
        said || self.samples.iter().any(|s| s.true_deg.is_some())
    }

    /// Returns whether the trial has something to follow: an angle, a wall or a force. Any other
    /// trial is open loop.
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

    /// Returns the wanted force of a channel, N; `None` without force control and before its first
    /// setpoint.
    #[must_use]
    pub fn wanted_n(&self, sample: &Sample, channel: u8) -> Option<f64> {
        let place = self.channel_index(channel, |c| c.force)?;
        sample.wanted_n.get(place).copied().flatten()
    }

    /// Returns the two forces closest to the wanted one that a channel's limits allow, N; `None` if
    /// the limits allow the wanted force itself.
    #[must_use]
    pub fn nearest_forces_n(&self, sample: &Sample, channel: u8) -> Option<(f64, f64)> {
        let place = self.channel_index(channel, |c| c.force)?;
        let side = |list: &[Option<f64>]| list.get(place).copied().flatten();
        side(&sample.below_n).zip(side(&sample.above_n))
    }

    /// Returns the index of a channel among the channels for which `has` is true.
    pub(crate) fn channel_index(
        &self,
        channel: u8,
        has: fn(&ChannelInfo) -> bool,
    ) -> Option<usize> {
        let mut such = self.channels.iter().filter(|c| has(c));
        such.position(|c| c.number == channel)
    }
}

/// Position of a trial's virtual wall.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct WallPlace {
    /// Angle of the wall, degrees.
    pub at_deg: f64,
    /// Whether the limb is inside at larger angles; else at smaller ones.
    pub stops_flexion: bool,
    /// Angle by which the pre-wall begins in front of the wall, degrees; 0 without a pre-wall.
    pub pre_wall_deg: f64,
}

/// Result of a session's `[fidelity]`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct FidelityFound {
    /// Telemetry period, ms.
    pub telemetry_ms: u16,
    /// Period of the control law, ms, if there is a control law.
    pub law_period_ms: Option<u8>,
    /// Time step of the simulated finger, µs, if there is a simulated finger.
    pub finger_step_us: Option<u32>,
}

/// A change of one channel's switch state.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Edge {
    /// Device time, µs.
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
    /// Both electrodes are shorted to the return.
    Grounded,
}

/// Values that a paper printed for trials of this kind. A trial may have several.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct PaperRow {
    /// [`Trial::name`] of the trial with which the values are compared.
    pub trial: String,
    /// RMSE of the paper's own trials, degrees, in the printed order.
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

/// A statement that a reader needs to judge a simulated result.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Assumption {
    /// Whether the statement is an assumption or an outcome.
    pub role: Role,
    /// The statement, in one sentence.
    pub text: String,
}

/// Side of a simulation that a statement describes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Assumption that was put into the simulated wearer or the experiment.
    PutIn,
    /// Outcome that the run computed.
    CameOut,
}
