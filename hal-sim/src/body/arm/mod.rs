//! A right arm from the breastbone to a cuff near the wrist, under nine electrodes, in one
//! posture (Sierotowicz 2023): what a current in each makes of force at the hand.
//!
//! Lives here: `elbow_arms` (published moment arms), `anatomy` (muscles, attachments,
//! neighbours), `posture` (bones, joints, lines of action), `angles` (how it is held), `driven` (recruitment, calcium,
//! tiredness), `mechanics` (held in the cuff, or free), `sensors` (force, IMUs), `moving`
//! (all in time, a [`super::Body`]), `spec` and `draw` (who wears it). Not here: how a
//! device or a study thinks an arm works: another model, in another room. In: pulses. Out:
//! the wrench on the cuff, what IMUs read. All simulated; every number in `spec` says
//! whether it is sourced or assumed.

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
pub use moving::{Arm, Support};
pub use posture::{Lengths, Posture, Skeleton};
pub use sensors::{ForceSpec, GRAVITY_M_S2, Imu, ImuFault, ImuSpec};
pub use spec::{
    ArmSpec, CUFF_PART, FOREARM, HAND, HoldSpec, InvalidArm, SEGMENT_NAMES, SEGMENTS, UPPER_ARM,
};
