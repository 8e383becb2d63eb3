//! A row of a trial's samples, and the state of the device.

use serde::{Deserialize, Serialize};

/// One telemetry sample: a row of `samples.csv`.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Sample {
    /// Time since the start of the trains, s.
    pub t_s: f64,
    /// Wanted joint angle, or the position of a virtual wall, degrees. `None` before the first
    /// setpoint, and for a session with neither joint nor wall.
    pub target_deg: Option<f64>,
    /// Joint angle that the sensor measured, degrees. `None` before the first measurement, and for
    /// a session with neither joint nor wall.
    pub measured_deg: Option<f64>,
    /// True joint angle of a simulated wearer, degrees; `None` for a person, whose true angle is
    /// unknown.
    pub true_deg: Option<f64>,
    /// Output of the control law, −1 to 1 or 0 to 1; for a virtual wall, the penetration of the
    /// limb, degrees. `None` while neither is active.
    pub effort: Option<f64>,
    /// Whether a computed amplitude was reduced to the wearer's limit, or a wanted force could not
    /// be produced in full.
    pub limiting: bool,
    /// State that the device reported with this sample.
    pub state: DeviceState,
    /// Amplitude of each channel, in the channel's unit; `None` while the channel outputs nothing.
    pub amplitudes: Vec<Option<f64>>,
    /// Pulse width of each channel whose width may change, µs, in channel order; `None` while the
    /// channel outputs nothing.
    #[serde(default)]
    pub widths_us: Vec<Option<f64>>,
    /// Force that the muscle model predicts for each channel with a muscle, N, in channel order;
    /// `None` where no model ran.
    pub forces_n: Vec<Option<f64>>,
    /// Wanted force of each channel under force control, N, in channel order; `None` before its
    /// first setpoint.
    #[serde(default)]
    pub wanted_n: Vec<Option<f64>>,
    /// Pulse rate that force control sets on each channel under force control, Hz, in channel
    /// order; `None` while the channel outputs nothing.
    #[serde(default)]
    pub rates_hz: Vec<Option<f64>>,
    /// For each channel under force control, the nearest force below the wanted one that the limits
    /// allow, N, in channel order; `None` if the limits allow the wanted force itself.
    #[serde(default)]
    pub below_n: Vec<Option<f64>>,
    /// For each channel under force control, the nearest force above the wanted one that the limits
    /// allow, N, in channel order; `None` if the limits allow the wanted force itself.
    #[serde(default)]
    pub above_n: Vec<Option<f64>>,
    /// Wanted force at the hand, N, with components backward, to the right and upward. Empty before
    /// the first setpoint, and if the session drives no arm.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_n: Vec<Option<f64>>,
    /// Share of the wanted force at the hand that the arm's muscles can exert, 0 to 1. The force is
    /// produced only at 1; below 1 no force is produced at all. `None` if the session drives no
    /// arm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand_made: Option<f64>,
    /// True force that a simulated wearer's hand exerts on the object that holds it, N, with
    /// components backward, to the right and upward. Empty for any other wearer.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hand_true_n: Vec<Option<f64>>,
    /// Whether the wearer holds an object: 1 if so, 0 if not, 2 if the object must be released
    /// because it was held too long. `None` if no joint angle modulates the stimulation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held: Option<f64>,
    /// Angle of each joint that modulates the stimulation, degrees, by ascending joint number;
    /// `None` without a recent measurement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joint_deg: Vec<Option<f64>>,
    /// Direction of the elbow's latest movement for each modulating joint, by ascending joint
    /// number: 1 for flexion, −1 for extension; `None` before the first movement.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phase: Vec<Option<f64>>,
}

/// State of the device that a sample reports; `samples.csv` has it as a word.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceState {
    /// After a reset, before the first window of the pulse tape has been computed.
    #[default]
    Boot,
    /// Outputs disconnected and supply of the output stages off. The electrode check also runs in
    /// this state.
    Idle,
    /// Armed: setup and electrodes were checked, and stimulation can be started.
    Armed,
    /// The pulse trains are output.
    Stimulating,
    /// After a stop: the amplitudes fall to 0.
    Stopping,
    /// A fault ended stimulation. The outputs are disconnected until the fault is acknowledged.
    Fault,
}
