//! The data of a run: what was asked, what the device answered, what its pins did.
//!
//! Here: [`Run`] and its parts, CSV in and out, and the [`Recorder`] that keeps
//! every row on disk while a trial is still running. Not here: numbers computed
//! from the data (`analysis`), pictures (`report`).
//! In: telemetry, edges, counters, events. Out: a folder that [`load`] reads back.

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
pub use columns::{Column, EDGES, Each, MARKERS, SAMPLES};
pub use damage::Held;
pub use difference::{Difference, compare_rows};
pub use disk::{replace_file, trial_folder};
pub use document::document;
pub use ending::{Completeness, Ending, write_summary};
pub use error::RecordError;
pub use folder::{load, load_each, save, write_header, write_run};
pub use identity::{DeviceKind, Identity};
pub use marker::{Marker, MarkerKind, read_markers};
pub use place::{Place, may_write};
pub use provenance::{ClockFit, Declared, HostFacts, Plan, Program};
pub use recorder::Recorder;
pub use sample::{DeviceState, Sample};
pub use samples::Samples;
pub use table::{read_edges, read_samples, write_edges, write_samples};
pub use worn::TrialWearer;

use crate::clock::Moment;
use crate::session::Study;
use serde::{Deserialize, Serialize};

/// Several trials of one purpose on one device.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// Of the record: [`FORMAT`] in what this program writes, 1 before there was
    /// a number.
    #[serde(default = "first_format")]
    pub format: u32,
    /// What the run is about; the heading of its report.
    pub title: String,
    /// How the device was named: "native simulator", a port's name, ….
    pub device: String,
    /// Seed of all that was random; `None` where only who serves the device knows.
    pub seed: Option<u64>,
    /// The program that recorded.
    #[serde(default)]
    pub program: Program,
    /// What was ordered; `None` in records of the first format.
    #[serde(default)]
    pub plan: Option<Plan>,
    /// What only people know.
    #[serde(default)]
    pub study: Study,
    /// The SHA-256 of the image that the device ran, where it was this program's.
    #[serde(default)]
    pub image_sha256: Option<String>,
    /// In the order they were run; each has a folder of its own.
    #[serde(skip)]
    pub trials: Vec<Trial>,
    /// What a paper printed for the same trials.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub paper: Vec<PaperRow>,
    /// The comparison that it is about, in a sentence; the report begins with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<String>,
    /// What was put into a simulation and what came out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub assumptions: Vec<Assumption>,
    /// What the host knows: a rerun differs in this alone.
    #[serde(default)]
    pub host: HostFacts,
    /// How it ended; kept in `summary.json`.
    #[serde(skip)]
    pub ending: Ending,
    /// What it has lost since it was closed, a phrase each: found by [`load`].
    #[serde(skip)]
    pub damage: Vec<String>,
}

/// The format of the records that this program writes.
pub const FORMAT: u32 = 2;

const fn first_format() -> u32 {
    1
}

/// The SHA-256 of `bytes`, 64 hexadecimal digits.
#[must_use]
pub fn sha256(bytes: &[u8]) -> String {
    use sha2::Digest;
    let digest = sha2::Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Run {
    /// A run without trials that this program begins at `start`.
    #[must_use]
    pub fn begin(title: &str, device: &str, seed: Option<u64>, plan: Plan, start: Moment) -> Self {
        Self {
            format: FORMAT,
            title: title.to_owned(),
            device: device.to_owned(),
            seed,
            program: Program::this(),
            plan: Some(plan),
            host: HostFacts::at(start),
            ..Self::default()
        }
    }

    /// What repeats it, typed in its folder: for a simulated run of this program
    /// the same bytes, for any other the same session.
    #[must_use]
    pub fn how_to_reproduce(&self) -> &'static str {
        match self.is_repeatable() {
            true => "flexor rerun .",
            false => "flexor run 01-*/session.toml --device PORT",
        }
    }

    /// Whether every device that answered ran in this program, in virtual time.
    #[must_use]
    pub fn is_repeatable(&self) -> bool {
        let mut devices = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        devices.all(|identity| identity.in_process)
    }

    /// Whether a simulator stood in for the wearer: the device said so, or a
    /// true angle is known, which only a simulated body can tell. A name, which
    /// anybody can give, is no evidence.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.trials.iter().any(Trial::is_simulated)
    }

    /// [`Run::is_simulated`]; `None` where no device has answered, so that nobody knows.
    #[must_use]
    pub fn simulated(&self) -> Option<bool> {
        let is_simulated = self.is_simulated();
        (is_simulated || self.kind().is_some()).then_some(is_simulated)
    }

    /// The seed for people.
    #[must_use]
    pub fn seed_in_words(&self) -> String {
        self.seed
            .map_or_else(|| "unknown".to_owned(), |seed| seed.to_string())
    }

    /// What stimulated; `None` until a device has answered.
    #[must_use]
    pub fn kind(&self) -> Option<DeviceKind> {
        let mut said = self
            .trials
            .iter()
            .filter_map(|trial| trial.identity.as_ref());
        said.next().map(|identity| identity.kind)
    }

    /// What stimulated, for people: what it said it is, and where.
    #[must_use]
    pub fn device_in_words(&self) -> String {
        let said = self.trials.iter().find_map(|trial| trial.identity.as_ref());
        said.map_or_else(
            || self.device.clone(),
            |identity| identity.kind.at(&self.device),
        )
    }
}

/// One uninterrupted stimulation.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Trial {
    /// For people: "two-point".
    pub name: String,
    /// The session file that described it.
    pub session_file: String,
    /// The device, as it told itself; `None` if it never answered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<Identity>,
    /// The text of the session file, kept beside the rows as `session.toml`.
    #[serde(skip)]
    pub session_text: String,
    /// Its SHA-256, 64 hexadecimal digits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub session_sha256: Option<String>,
    /// The wearer file that the session names, kept beside the rows as `wearer.toml`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wearer: Option<TrialWearer>,
    /// What `[fidelity]` came to, where the session has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fidelity: Option<FidelityFound>,
    /// The device's clock against the host's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock: Option<ClockFit>,
    /// Length, s.
    pub duration_s: f64,
    /// The channels in use; `Sample::amplitudes` has this order.
    pub channels: Vec<ChannelInfo>,
    /// Telemetry, oldest first.
    #[serde(default, skip_serializing_if = "Samples::is_empty")]
    pub samples: Samples,
    /// Switch states of one period, oldest first. A channel is isolated until
    /// its first edge.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<Edge>,
    /// Whether the device drove a joint after a target: only then is its angle judged.
    #[serde(default)]
    pub joint: bool,
    /// The virtual wall, if there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall: Option<WallPlace>,
    /// The part that metrics judge, from–to in s; all of it when `None`.
    pub measure: Option<(f64, f64)>,
    /// Pulses of more than 0 that were played; `None` if nobody could tell.
    #[serde(default)]
    pub pulses: Option<u64>,
    /// Why there was none, most likely.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub silent: Option<String>,
    /// Named counts of this trial: frames, pulses, …. Of a device that was
    /// running before, what it counted between the trial's begin and its end.
    pub counters: Vec<(String, u64)>,
    /// What happened when, s.
    pub events: Vec<(f64, String)>,
    /// What was done at the controls, and edges of the trigger input, oldest first; kept in
    /// `markers.csv`, which has the edges of the sync output, too.
    #[serde(skip)]
    pub markers: Vec<Marker>,
    /// What the electrode check of arming read, in the order it did.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub electrode_check: Vec<ElectrodeReading>,
}

/// What the electrode check of arming read of a channel.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ElectrodeReading {
    /// 1-based.
    pub channel: u8,
    /// What was applied, in the channel's unit.
    pub applied: f64,
    /// The current that flowed, mA.
    pub current_ma: f64,
    /// Of a voltage stage: volts by current, Ω; `None` for a current stage, which
    /// does not measure its voltage, and without any current.
    pub load_ohm: Option<f64>,
}

impl Trial {
    /// Whether a simulator stood in for the wearer, as [`Run::is_simulated`] says.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        let said = self
            .identity
            .as_ref()
            .is_some_and(|identity| identity.simulated);
        said || self.samples.iter().any(|s| s.true_deg.is_some())
    }

    /// Whether anything was to be followed: an angle, a wall or a force. What
    /// follows nothing is open loop.
    #[must_use]
    pub fn follows(&self) -> bool {
        self.joint || self.wall.is_some() || self.channels.iter().any(|c| c.force)
    }

    /// The predicted force of a channel, N; `None` without a muscle, and where none
    /// was predicted.
    #[must_use]
    pub fn force_n(&self, sample: &Sample, channel: u8) -> Option<f64> {
        let place = self.place(channel, |c| c.muscle)?;
        sample.forces_n.get(place).copied().flatten()
    }

    /// The wanted force of a channel, N; `None` without force control and before
    /// its first setpoint.
    #[must_use]
    pub fn wanted_n(&self, sample: &Sample, channel: u8) -> Option<f64> {
        let place = self.place(channel, |c| c.force)?;
        sample.wanted_n.get(place).copied().flatten()
    }

    /// The two forces that a channel's limits can give, N, if they could not give
    /// the wanted one between them.
    #[must_use]
    pub fn gap_n(&self, sample: &Sample, channel: u8) -> Option<(f64, f64)> {
        let place = self.place(channel, |c| c.force)?;
        let side = |list: &[Option<f64>]| list.get(place).copied().flatten();
        side(&sample.below_n).zip(side(&sample.above_n))
    }

    /// A channel's place among those that have something.
    pub(crate) fn place(&self, channel: u8, has: fn(&ChannelInfo) -> bool) -> Option<usize> {
        let mut such = self.channels.iter().filter(|c| has(c));
        such.position(|c| c.number == channel)
    }
}

/// Where a trial's virtual wall stands.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct WallPlace {
    /// The wall, degrees.
    pub at_deg: f64,
    /// Whether the limb is inside at larger angles, or at smaller ones.
    pub stops_flexion: bool,
    /// How far in front of it its pre-wall begins, degrees; 0 for none.
    pub pre_wall_deg: f64,
}

/// What a session's `[fidelity]` came to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct FidelityFound {
    /// Telemetry period, ms.
    pub telemetry_ms: u16,
    /// The law's period, ms, if there is one.
    pub law_period_ms: Option<u8>,
    /// The simulated finger's step, µs, if there is one.
    pub finger_step_us: Option<u32>,
}

/// A change of one channel's switch state.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Edge {
    /// Device time, µs.
    pub t_us: u64,
    /// 1-based.
    pub channel: u8,
    /// From this moment on.
    pub state: State,
    /// Amplitude code of the channel's DAC, 0–65535.
    pub dac_code: u16,
}

/// How a channel's output switches stand.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Both electrodes open.
    Isolated,
    /// Current out of the active electrode.
    Anodic,
    /// Current into the active electrode.
    Cathodic,
    /// Both electrodes shorted to the return.
    Grounded,
}

/// What a paper printed for a trial of this kind. A trial may have several.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct PaperRow {
    /// [`Trial::name`] it is compared with.
    pub trial: String,
    /// RMSE of the paper's own trials, degrees, in print order.
    pub values: Vec<f64>,
    /// Where it is printed: "table 8, participant P".
    pub source: String,
}

impl PaperRow {
    /// Arithmetic mean of the values, degrees; `None` without values.
    pub fn mean(&self) -> Option<f64> {
        (!self.values.is_empty())
            .then(|| self.values.iter().sum::<f64>() / self.values.len() as f64)
    }
}

/// One thing a reader must know to judge a simulated result.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Assumption {
    /// Put in by us, or an outcome.
    pub role: Role,
    /// One sentence.
    pub text: String,
}

/// Which side of a simulation a statement describes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Typed into the simulated body or the experiment.
    PutIn,
    /// Computed by the run.
    CameOut,
}
