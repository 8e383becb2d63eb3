//! A row of a trial's samples, and the state that the device was in.

use serde::{Deserialize, Serialize};

/// One telemetry sample.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Sample {
    /// Since the trial's start, s.
    pub t_s: f64,
    /// Wanted joint angle, or where a wall stands, degrees; `None` before the
    /// first setpoint, and without joint or wall.
    pub target_deg: Option<f64>,
    /// Joint angle the sensor gave, degrees; `None` before the first measurement,
    /// and without joint or wall.
    pub measured_deg: Option<f64>,
    /// Joint angle of a simulated body, degrees; nobody knows a person's.
    pub true_deg: Option<f64>,
    /// What the control law asked for, in its own unit; with a wall, how far the
    /// limb is inside, degrees. `None` while neither runs.
    pub effort: Option<f64>,
    /// A computed amplitude was clamped to the wearer's limit.
    pub limiting: bool,
    /// The device's state.
    pub state: DeviceState,
    /// Amplitude of each channel, in the channel's unit; `None` while it plays
    /// nothing.
    pub amplitudes: Vec<Option<f64>>,
    /// Pulse width of each channel whose width may change, µs, in channel order; `None`
    /// while it plays nothing.
    #[serde(default)]
    pub widths_us: Vec<Option<f64>>,
    /// Predicted force of each channel that has a muscle, N, in channel order; `None`
    /// where no model ran.
    pub forces_n: Vec<Option<f64>>,
    /// Wanted force of each channel under force control, N, in channel order;
    /// `None` before its first setpoint.
    #[serde(default)]
    pub wanted_n: Vec<Option<f64>>,
    /// Pulse rate that force control gives it, Hz; `None` while it plays nothing.
    #[serde(default)]
    pub rates_hz: Vec<Option<f64>>,
    /// The force below the wanted one that its limits can give, N, where they
    /// cannot give that itself; in the place of `wanted_n`.
    #[serde(default)]
    pub below_n: Vec<Option<f64>>,
    /// The force above it that they can give, N, likewise.
    #[serde(default)]
    pub above_n: Vec<Option<f64>>,
    /// Wanted force at the hand, N, backward, to the right, upward; empty before its
    /// first setpoint and where no arm is driven.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_n: Vec<Option<f64>>,
    /// What part of it can be made: 1 is all, and given; less is not given at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_made: Option<f64>,
    /// True force at the hand of a simulated body that is held there, N, likewise; empty of
    /// any other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_true_n: Vec<Option<f64>>,
    /// Whether an object is held, 1; 0 if not, 2 if the device let go. None where no joint
    /// is modulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<f64>,
    /// Angle of each modulated joint, °, by rising number; `None` without a fresh one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_deg: Vec<Option<f64>>,
    /// Its phase likewise: 1 the elbow flexes, −1 it extends; `None` before its first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phase: Vec<Option<f64>>,
}

/// The state of a device, by its word in `samples.csv`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceState {
    /// Reset, nothing decided yet.
    #[default]
    Boot,
    /// Outputs isolated, supply down. Includes the electrode check.
    Idle,
    /// Ready to start.
    Armed,
    /// Trains play.
    Stimulating,
    /// Amplitudes fall.
    Stopping,
    /// Isolated until acknowledged.
    Fault,
}
