//! Control: computes amplitudes from reference and measured angles of a joint, from reference
//! forces of a muscle, and from reference forces at the hand.
//!
//! This module contains the setpoint tracks, the pseudo-differentiator, the control laws, the gain
//! of their feedback, the mapping of effort to flexor and extensor, and the joint that combines
//! them. Pulses, limits of the board, ramps (`safety`), the link and the sensor itself are
//! elsewhere.
//!
//! Inputs are timed setpoints and measurements, and the time. Outputs are one amplitude per channel
//! and tick, whether a limit was reached, and sensor faults.
//! All arithmetic is in integers, except where `limb` computes; the same inputs give the same bits
//! on every machine.

pub mod differentiator;
pub mod effort;
pub mod endpoint;
pub mod feed_forward;
pub mod force;
pub(crate) mod gain;
mod integral;
pub mod joint;
pub mod law;
mod limit_cycle;
mod low_pass;
pub mod mapping;
pub mod pid;
pub mod refusal;
pub mod response;
mod rest;
pub(crate) mod sensor;
pub mod setpoint;
pub mod spec;
mod steering;
pub mod super_twisting;

pub use effort::Effort;
pub use endpoint::{
    Endpoint, EndpointOrders, EndpointSpec, EndpointState, ForceImpossible, PostureSpec,
    WrenchError,
};
pub use feed_forward::{FeedForward, WearerModel};
pub use force::{ForceControl, ForceError, ForceGap, ForceOrders, ForceSpec, ForceState};
pub use joint::{Joint, JointState, Orders};
pub use law::LawSpec;
pub use limit_cycle::LimitCycle;
pub use mapping::{Amplitudes, Mapping, PointSpec};
pub use refusal::SpecError;
pub use response::ResponseSpec;
pub use sensor::{CLOCK_ERROR_US, MeasurementError, SensorFault, SensorSource};
pub use setpoint::{HoldPolicy, SetpointError};
pub use spec::JointSpec;
