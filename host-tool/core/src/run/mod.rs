//! Runs a session on a device of any kind.
//!
//! This module opens a device by name ([`DeviceName`]). Its [`Stepper`] configures and arms the
//! device and streams setpoints step by step; [`run()`] does so to the end. Telemetry is collected
//! in a `record::Trial`. Session files are read in `session`, pictures are drawn in `report`, and
//! bytes are exchanged in `link`.

mod board;
#[cfg(feature = "chip")]
mod chip;
mod device;
mod error;
mod file;
mod identity;
#[cfg(feature = "images")]
pub mod images;
mod interruption;
mod observer;
mod open_error;
mod option_bytes;
mod outcome;
mod outputs;
#[cfg(feature = "chip")]
mod profile;
mod pulses;
mod recorded;
mod runner;
mod simulated;
mod stages;
mod stepper;
mod trial;
mod wearer;

pub use board::Board;
#[cfg(feature = "chip")]
pub use chip::{ChipOptions, board_image, chip_image, open_chip_port, power_on};
pub use device::DeviceName;
pub use error::RunError;
pub use file::SessionFile;
pub use identity::{device_kind, identity};
pub use interruption::{Stopped, interruptible};
pub use observer::{Observation, Observer, ObserverRequest};
#[cfg(feature = "chip")]
pub use open_error::ChipError;
pub use open_error::OpenError;
pub use option_bytes::describe_option_bytes;
pub use outcome::Outcome;
pub use outputs::{Dump, FullestPeriod, Outputs, edges_of_one_period};
#[cfg(feature = "chip")]
pub use profile::{Booted, ProfileError, Profiled, profile};
pub use recorded::{BeginError, RecordedTrial, TrialPlace, record, record_on};
pub use runner::{acknowledge, run, run_with_outputs, wait_for_hello};
pub use simulated::{simulated_port, simulated_port_with};
pub use stages::{check_board, check_supply, describe_stages};
pub use stepper::{
    Attachments, Control, INTENSITY_STEP, Keys, StepEnd, StepLimit, Stepper, replay_keys,
};
pub use trial::{begin_trial, describe_event, edges_between, to_sample};
pub use wearer::{BodyError, attach_electrodes, create_body, merge_sessions, rest_wearer};
