//! A right arm from the breastbone to a cuff near the wrist, under nine electrodes, in one posture
//! (Sierotowicz 2023). The model computes the force at the hand from the current in each electrode.
//!
//! Submodules: `elbow_arms` (published moment arms), `anatomy` (muscles, attachments, neighbours),
//! `posture` (bones, joints, lines of action), `angles` (joint angles of a posture), `driven`
//! (recruitment, calcium, fatigue), `mechanics` (arm in the cuff, or free), `sensors` (force,
//! IMUs), `moving` (the simulation over time, a [`super::Body`]), `spec` and `draw` (parameters of
//! a wearer). The models that a device or a study has of an arm belong to other modules. Input:
//! pulses. Output: the wrench on the cuff and the measurements of the IMUs. Everything is
//! simulated; `spec` says of every number whether it is sourced or assumed.

pub mod anatomy;
mod angles;
mod draw;
mod driven;
pub mod elbow_arms;
mod mechanics;
mod moving;
pub mod posture;
mod sensors;
mod spec;

pub use anatomy::{ELECTRODES, MUSCLES, Muscle};
pub use draw::FREQUENCY_HZ;
pub use driven::reached_muscles;
pub use moving::{Arm, Support};
pub use posture::{Lengths, Posture, Skeleton};
pub use sensors::{ForceSpec, GRAVITY_M_S2, Imu, ImuFault, ImuSpec};
pub use spec::{
    ArmSpec, CUFF_PART, FOREARM, HAND, HoldSpec, InvalidArm, SEGMENT_NAMES, SEGMENTS, UPPER_ARM,
};
