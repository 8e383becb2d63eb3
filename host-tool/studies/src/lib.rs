//! What is compared, apart from what is flashed.
//!
//! `bench` measures the device's algorithms and cycles; `accuracy` and `tracking`
//! compare muscle models and control laws, `stability` maps where methods fail,
//! `ladder` judges the choice of muscle models, `limb` what recruitments of an arm give;
//! `laboratory` is what protocols share, `catalog` which studies there are; `experiments` are the papers' protocols,
//! `endpoint` that of a wanted force at the hand, `electrodes` which of them serve it,
//! `lee` that which identifies a muscle, `ramps` Harris' characterization, `distributed` a
//! muscle under several electrodes, `lift` stimulation that follows lifting arms; `faults`
//! are campaigns of what breaks; `figures` draw them. `subjects` are whom muscle models are
//! compared on.

pub mod accuracy;
pub mod bench;
pub mod catalog;
pub mod distributed;
pub mod electrodes;
pub mod endpoint;
pub mod experiments;
pub mod faults;
pub mod figures;
pub mod hands;
pub mod laboratory;
pub mod ladder;
pub mod lee;
pub mod lift;
pub mod limb;
pub mod ramps;
pub mod stability;
mod subjects;
pub mod tracking;
pub mod two_points;
