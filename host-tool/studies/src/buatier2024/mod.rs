//! Buatier de Mongeot 2024: two arms lift an object while stimulation follows their joints.
//!
//! Lives here: the declaration (`host-tool/experiments/buatier.toml`, committed before it was run),
//! what a device is told (`calibration`), the device's own modulation at work (`device`) and the
//! whole device beside it (`whole`), the
//! way of the hands (`way`), persons (`person`, `control`), the virtual object (`scene`), a lift
//! (`trial`), studies of eight persons (`participant`, `replication`, `tests`), what they come to
//! (`outcome`, `comparisons`, `figures`, `deciding`). Not here: arms (`hal_sim::body::sagittal`),
//! modulation (`firmware::haptics`), static optimisation (`host_core::limb`), the command
//! (`cli`). In: a seed, a number of studies. Out: an [`Outcome`](crate::laboratory::Outcome).
//! All simulated: no evidence about people.

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
