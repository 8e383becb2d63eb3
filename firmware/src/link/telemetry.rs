//! Telemetry: regular samples of the device's state while it runs.

use crate::control::ForceGap;
use crate::haptics::{Hold, JOINTS, MotionPhase};
use crate::pulse::CHANNELS;
use crate::safety::State;
use crate::units::{Amplitude, Micros};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// One telemetry sample. Values that do not exist or are not known are `None`, never zero.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Device time of the control tick.
    pub at: Micros,
    /// Reference angle of the joint, or angle of the wall, 0.01°; `None` before the first setpoint,
    /// and if neither runs.
    pub reference_centideg: Option<i16>,
    /// Measured joint angle, 0.01°; `None` before the first measurement, and if neither joint nor
    /// wall runs.
    pub measured_centideg: Option<i16>,
    /// Effort of the controller, in thousandths of its own unit; with a wall, the penetration in
    /// 0.001°, negative in front of the wall. `None` while neither runs.
    pub effort_milli: Option<i32>,
    /// Whether, since the last sample, a rise delayed an accepted amplitude, a computed amplitude
    /// was clamped to the wearer's limit, or a force was requested that is not possible.
    pub limiting: bool,
    /// Amplitudes of the latest pulses, one per channel of the setup, lowest channel first. `None`
    /// while the channel plays nothing: once amplitude 0 was requested, or the next burst is
    /// overdue.
    pub amplitudes: Vec<Option<Amplitude>, CHANNELS>,
    /// Widths of the latest pulses, µs, one per channel whose width may change, lowest channel
    /// first; `None` as for `amplitudes`.
    pub widths_us: Vec<Option<u16>, CHANNELS>,
    /// Predicted forces in mN, one per channel with a muscle; `None` while no model runs.
    pub forces_mn: Vec<Option<u32>, CHANNELS>,
    /// State of force control, one entry per channel under force control.
    pub force_control: Vec<ForceSample, CHANNELS>,
    /// State of the arm; `None` before its first setpoint, and without an arm.
    pub wrench: Option<WrenchSample>,
    /// State of the modulated joints; `None` while none runs.
    pub lift: Option<LiftSample>,
    /// State of the device's state machine.
    pub state: State,
}

/// A channel under force control in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct ForceSample {
    /// Reference force, mN; `None` before the first setpoint.
    pub reference_mn: Option<u32>,
    /// Time from burst start to burst start, µs; `None` while the channel plays nothing.
    pub period_us: Option<u32>,
    /// Gap of impossible forces in which a requested force was since the last sample; the nearer
    /// end of the gap is produced.
    pub gap: Option<ForceGap>,
}

/// The arm in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct WrenchSample {
    /// Reference force at the hand, mN: backward, to the right, upward.
    pub reference_mn: [i32; 3],
    /// Share of that force that the arm can exert in its posture, thousandths, the smallest since
    /// the last sample. At 1000 the whole force is exerted; below, none.
    pub achievable_permille: u16,
}

/// The modulated joints in one telemetry sample.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct LiftSample {
    /// State of the handled object.
    pub hold: Hold,
    /// Readings of the modulated joints, lowest number first.
    pub joints: Vec<JointSample, JOINTS>,
}

/// A modulated joint in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct JointSample {
    /// Measured angle, 0.01°; `None` without a recent, plausible measurement.
    pub measured_centideg: Option<i16>,
    /// Phase of the motion of the joint that determines this joint's phase; `None` before that
    /// joint has moved, and without an angle.
    pub phase: Option<MotionPhase>,
}
