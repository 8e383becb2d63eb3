//! An arm that lifts in the sagittal plane: elbow and shoulder flexion, eight muscles that a
//! person drives and of which four lie under electrodes (Buatier de Mongeot 2024).
//!
//! Lives here: `geometry` (moment arms and fibre lengths by angle, from `arm`'s published
//! numbers), `links` (two rigid segments), `fibres` (what pulses make of the fibres under an
//! electrode), `heat` (what muscles use up), `moving` (all of it in time), `spec`. Not here:
//! what the person wants, what is lifted, the device. In: drives of the muscles, pulses,
//! the force on the hand. Out: angles, where the hand is, torques, energy. All simulated;
//! every number says whether it is sourced or assumed.

mod fibres;
mod geometry;
mod heat;
mod links;
mod moving;
mod spec;

pub use geometry::{ALL, Geometry, LIMITS_DEG, MUSCLES, PostureGeometry};
pub use links::{GRAVITY_M_S2, Links};
pub use moving::{Intent, SagittalArm};
pub use spec::{ELECTRODES, Electrode, InvalidSagittal, SagittalSpec};

/// Joints.
pub const JOINTS: usize = 2;
/// The elbow's place among them.
pub const ELBOW: usize = 0;
/// The shoulder's.
pub const SHOULDER: usize = 1;
