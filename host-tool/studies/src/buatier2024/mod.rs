//! Replicates Buatier de Mongeot 2024: two arms lift an object while stimulation follows their
//! joints.
//!
//! Contains the declaration (`host-tool/experiments/buatier.toml`, committed before the first run),
//! the device's settings (`calibration`), its modulation alone (`device`) and the whole device for
//! comparison (`whole`), the trajectory of the hands (`way`), participants (`person`, `control`),
//! the virtual object (`scene`), a lift (`trial`), studies of eight participants (`participant`,
//! `replication`, `tests`), and their results (`outcome`, `comparisons`, `figures`, `deciding`).
//! The arms are in `hal_sim::body::sagittal`, modulation in `firmware::haptics`, static
//! optimisation in `host_core::limb`, the command in `cli`. Takes a seed and a number of studies;
//! returns an [`Outcome`](crate::laboratory::Outcome). Everything is simulated and no evidence
//! about people.

mod calibration;
mod comparisons;
mod control;
mod deciding;
mod declaration;
mod device;
mod error;
mod figures;
mod outcome;
mod participant;
mod person;
mod replication;
mod run;
mod scene;
mod tests;
mod trial;
mod way;
mod whole;

pub use calibration::{ARMS, CHANNELS, ChannelThresholds as ToldToDevice, Curves, curves};
pub use comparisons::{holds, value};
pub use control::LearntTorque;
pub use deciding::{Sensitivity, compute_sensitivity};
pub use declaration::{Claim, Condition, DECLARED, HEIGHTS, Metric, Side, Study};
pub use device::Device;
pub use error::LiftError;
pub use outcome::{NAME, RunInfo, outcome};
pub use participant::{ConditionResult, Participant, participant};
pub use person::{LiftWearer, draw_values, nominal_values};
pub use replication::{Replication, replication};
pub use run::Run;
pub use tests::{Tested, test_metric};
pub use trial::{LiftResult, Trace, Worker};
pub use way::LiftTrajectory;
pub use whole::{DeviceComparison, compare_whole_device};
