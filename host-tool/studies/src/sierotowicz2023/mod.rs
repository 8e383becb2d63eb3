//! Repeats Sierotowicz 2023 on simulated arms: whether nine muscles produce a reference force at
//! the hand, and whether the calibration from twitches helps.
//!
//! Takes a seed and the declaration (`host-tool/experiments/sierotowicz.toml`); returns numbers
//! beside those of the paper. `model` is the device's model of an arm, `device` the recruitment
//! with it, `calibrate` and `imus` its calibration. `participant`, `course`, `walk` and
//! `replication` run participants through the conditions C1 to C4, `played` plays one condition on
//! a device, and `metrics`, `regression` and `population` evaluate the results. Muscle recruitment
//! is in `firmware::limb` and `host_core::limb`, the simulated arm in `hal_sim::body::arm`.
//! Everything is simulated: this is no evidence about people.

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
