//! Models and controllers of the device as functions, apart from any device.
//!
//! This module evaluates the calcium–force model of a muscle in the device's fixed point or in the
//! high-accuracy reference ([`device_response`], [`reference_response`]), the inverse model by which
//! the device finds the stimulus for a force ([`stimulus_for_force`]), and the controller of a joint
//! tick by tick ([`JointController`]). The models themselves are in `firmware` and `hal_sim`.
//!
//! Input: parameters, pulses, angles. Output: numbers in everyday units.

mod controller;
mod inverse;
mod response;

pub use controller::{ControllerError, ControllerOutput, JointController};
pub use inverse::{ForceStimulus, stimulus_for_force};
pub use response::{ResponseRow, device_response, reference_response};
