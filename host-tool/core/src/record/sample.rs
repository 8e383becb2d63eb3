//! A row of a trial's samples, and the state of the device.

use serde::{Deserialize, Serialize};

/// One telemetry sample.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Sample {
    /// Time since the trial's start, s.
    pub t_s: f64,
    /// Wanted joint angle, or the position of a wall, degrees; `None` before the first setpoint,
    /// and without joint or wall.
    pub target_deg: Option<f64>,
    /// Joint angle that the sensor measured, degrees; `None` before the first measurement, and
    /// without joint or wall.
    pub measured_deg: Option<f64>,
    /// Joint angle of a simulated wearer, degrees; `None` for a person, whose true angle is
    /// unknown.
    pub true_deg: Option<f64>,
    /// Output of the control law, in its own unit; for a wall, the penetration of the limb,
    /// degrees. `None` while neither runs.
    pub effort: Option<f64>,
    /// Whether a computed amplitude was clamped to the wearer's limit.
    pub limiting: bool,
    /// State that the device reported with this sample.
    pub state: DeviceState,
    /// Amplitude of each channel, in the channel's unit; `None` while the channel outputs nothing.
    pub amplitudes: Vec<Option<f64>>,
    /// Pulse width of each channel whose width may change, µs, in channel order; `None` while the
    /// channel outputs nothing.
    #[serde(default)]
    pub widths_us: Vec<Option<f64>>,
    /// Predicted force of each channel that has a muscle, N, in channel order; `None` where no
    /// model ran.
    pub forces_n: Vec<Option<f64>>,
    /// Wanted force of each channel under force control, N, in channel order; `None` before its
    /// first setpoint.
    #[serde(default)]
    pub wanted_n: Vec<Option<f64>>,
    /// Pulse rate from force control, Hz, in the order of `wanted_n`; `None` while the channel
    /// outputs nothing.
    #[serde(default)]
    pub rates_hz: Vec<Option<f64>>,
    /// Closest force below the wanted one that the limits allow, N, in the order of `wanted_n`;
    /// `None` if they allow the wanted force itself.
    #[serde(default)]
    pub below_n: Vec<Option<f64>>,
    /// Closest force above the wanted one that the limits allow, N, in the order of `wanted_n`;
    /// `None` if they allow the wanted force itself.
    #[serde(default)]
    pub above_n: Vec<Option<f64>>,
    /// Wanted force at the hand, N, backward, to the right, upward; empty before its first setpoint
    /// and if no arm is driven.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_n: Vec<Option<f64>>,
    /// Share of the wanted force at the hand that the arm can exert: 1 is all of it, and is output;
    /// anything less is not output at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_made: Option<f64>,
    /// True force at the hand of a simulated wearer that is held there, N, backward, to the right,
    /// upward; empty for any other wearer.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_true_n: Vec<Option<f64>>,
    /// Whether an object is held: 1 if it is, 0 if not, 2 if the device released it. `None` if no
    /// joint is modulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<f64>,
    /// Angle of each modulated joint, °, in the order of joint numbers; `None` without a fresh
    /// angle.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_deg: Vec<Option<f64>>,
    /// Phase of each modulated joint, in the same order: 1 if the elbow flexes, −1 if it extends;
    /// `None` before the first movement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phase: Vec<Option<f64>>,
}

/// State of a device, which `samples.csv` gives by its word.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceState {
    /// After a reset, before the device has decided anything.
    #[default]
    Boot,
    /// Outputs disconnected and supply off. Includes the electrode check.
    Idle,
    /// Ready to start.
    Armed,
    /// Trains are output.
    Stimulating,
    /// Amplitudes fall to 0.
    Stopping,
    /// Outputs disconnected until the fault is acknowledged.
    Fault,
}
