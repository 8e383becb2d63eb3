//! Repeats Harris 2017's characterisation of an elbow under stimulation: torque against current,
//! pulse width and angle, and the latency before a pulse.
//!
//! Takes a seed, a number of draws and a device; returns an [`Outcome`](crate::laboratory::Outcome)
//! and `draws.csv`. The declaration (`host-tool/experiments/harris-ramps.toml`) was committed
//! before it was run. The module generates random wearers, performs the tests of section 3.3,
//! judges the claims, searches thresholds against pulse width, and draws the counterparts of the
//! paper's figures 3 and 5 to 7. The arm is in `hal_sim::body::bench::elbow`. Everything is
//! simulated: this is no evidence about people.

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
