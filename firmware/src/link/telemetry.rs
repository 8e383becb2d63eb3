//! What the device tells of itself as it runs: one sample a period.

use crate::control::ForceGap;
use crate::haptics::{Hold, JOINTS, MotionPhase};
use crate::pulse::CHANNELS;
use crate::safety::State;
use crate::units::{Amplitude, Micros};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// One telemetry sample. `None` is what is not there or not known: never a zero.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Telemetry {
    /// Device time of the control tick.
    pub at: Micros,
    /// Wanted joint angle, or where the wall stands, 0.01°; none before the
    /// first setpoint, and where neither runs.
    pub target_centideg: Option<i16>,
    /// Measured joint angle, 0.01°; none before the first measurement, and where
    /// neither joint nor wall runs.
    pub measured_centideg: Option<i16>,
    /// What the law asked for, in thousandths of its own unit; with a wall, the
    /// penetration in 0.001°, negative in front of it. None while neither runs.
    pub effort_milli: Option<i32>,
    /// Since the last sample an amplitude was clamped to the wearer's limit, or a
    /// force was wanted that cannot be given.
    pub limiting: bool,
    /// Amplitudes now in force: of the latest pulses, one per channel of the
    /// setup, lowest channel first. None while the channel plays nothing: from
    /// an order of nothing, or from when the next burst is overdue.
    pub amplitudes: Vec<Option<Amplitude>, CHANNELS>,
    /// Widths now in force, µs: as the amplitudes, but one per channel whose width may
    /// change.
    pub widths_us: Vec<Option<u16>, CHANNELS>,
    /// Predicted forces in mN, one per channel with a muscle. None where no model
    /// runs.
    pub forces_mn: Vec<Option<u32>, CHANNELS>,
    /// What force control does, one per channel under it.
    pub force_control: Vec<ForceSample, CHANNELS>,
    /// What the arm does; none before its first setpoint, and where there is none.
    pub wrench: Option<WrenchSample>,
    /// What modulated joints do; none while none runs.
    pub lift: Option<LiftSample>,
    /// The device's state.
    pub state: State,
}

/// A channel under force control in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct ForceSample {
    /// Wanted force, mN; none before the first setpoint.
    pub target_mn: Option<u32>,
    /// Burst start to burst start, µs; none while the channel plays nothing.
    pub period_us: Option<u32>,
    /// Since the last sample a force between these two was wanted, and the nearer
    /// of them given.
    pub gap: Option<ForceGap>,
}

/// The arm in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct WrenchSample {
    /// Wanted force at the hand, mN.
    pub target_mn: [i32; 3],
    /// How much of it can be made as the arm is held, thousandths: all is given, or
    /// nothing. The least since the last sample.
    pub made_permille: u16,
}

/// The modulated joints in one telemetry sample.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct LiftSample {
    /// Whether an object is held.
    pub hold: Hold,
    /// Each of them, lowest number first.
    pub joints: Vec<JointSample, JOINTS>,
}

/// A modulated joint in one telemetry sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct JointSample {
    /// Its angle, 0.01°; none while there is no fresh one that can be believed.
    pub measured_centideg: Option<i16>,
    /// What its phase joint does; none before that has moved, and without its angle.
    pub phase: Option<MotionPhase>,
}
