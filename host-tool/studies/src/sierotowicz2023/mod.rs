//! Sierotowicz 2023 on simulated arms: do nine muscles make a wanted force at the hand, and
//! does the calibration from twitches help?
//!
//! Lives here: what was declared (`host-tool/experiments/sierotowicz.toml`), what the device is
//! told of an arm (`model`), the device at work on it (`device`), its calibration
//! (`calibrate`, `imus`), participants and their conditions C1 to C4 (`participant`,
//! `course`, `walk`, `replication`), one condition on a device (`played`), what they come to
//! (`metrics`, `regression`, `population`). Not here: how muscles are recruited
//! (`firmware::limb`, `host_core::limb`), the body (`hal_sim::body::arm`). In: a seed. Out:
//! numbers beside the paper's. All simulated: no evidence about people.

mod calibrate;
mod claims;
mod course;
mod declaration;
mod device;
pub mod electrodes;
mod error;
mod figure_8;
mod imus;
mod metrics;
mod model;
mod participant;
mod picture;
mod played;
mod population;
mod regression;
mod replication;
mod run;
mod sheets;
mod walk;

pub use calibrate::{fit_model, fit_routing, geometry_error_deg, motionless_channels, twitches};
pub use course::Condition;
pub use declaration::{DECLARED, Study};
pub use device::{Device, Method, Switches, force_on_circle, switches};
pub use error::EndpointError;
pub use imus::check as check_imus;
pub use metrics::{Correlation, Measures, Target, align, measures, median, pearson};
pub use model::{Action, Cylinder, Frame, JOINT_NAMES, Model, Point, cursory, turned};
pub use participant::{Command, DIRECTION_NAMES, DIRECTIONS, Participant};
pub use picture::page as arms_page;
pub use played::{DeviceCheck, play_c3};
pub use population::{RunInfo, outcome};
pub use regression::{Features, Score, cross_validate, folds, ridge, score};
pub use replication::{
    CONDITIONS, PARTICIPANTS, ParticipantResult, Replication, frame_of, person, replication,
};
pub use run::{NAME, Run};
pub use walk::{RATES_HZ, WalkResult, walk};
