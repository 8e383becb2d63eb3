//! Harris 2017's characterization of an elbow under electrodes: torque against current, pulse
//! width and angle, and the latency before it.
//!
//! Lives here: the declaration (`host-tool/experiments/harris-ramps.toml`, committed before it was
//! run), persons drawn of it, the tests of section 3.3, what is measured and claimed of them,
//! thresholds against width, and the sheets that stand beside the paper's figures 3 and 5 to 7.
//! Not here: the arm (`hal_sim::body::bench::elbow`), the command (`cli`).
//! In: a seed, draws, a device. Out: an [`Outcome`](crate::laboratory::Outcome) and
//! `draws.csv`. All simulated: no evidence about people.

mod angles;
mod claims;
mod course;
mod csv;
mod declared;
mod device;
mod error;
mod figures;
mod found;
mod latency;
mod outcome;
mod person;
mod rows;
mod run;
mod strength_duration;
mod study;
mod tables;
mod test;
mod wearer_file;

pub use angles::{
    AngleDependence, DEPENDS, detection_power as effect_found, is_significant, least_found,
    relative_torque_change,
};
pub use course::{Answer, Course, Moment, record_test};
pub use declared::{DECLARED, RampsDeclaration};
pub use device::{OutputDifference, play_all_on_device};
pub use error::RampsError;
pub use found::{
    DrawMeasurements, DrawResult, HeldPulse, Pulses, StrengthDurationFound, TestMeasurements,
};
pub use latency::{Latency, latency};
pub use outcome::RunInfo;
pub use person::{RampsWearer, Setting, in_words, is_triceps};
pub use run::Run;
pub use strength_duration::{StrengthDurationFit, Threshold, fit_law};
pub use study::{NAME, Study};
pub use test::{Stimulation, Test, stimulations};
