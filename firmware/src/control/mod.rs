//! Control: from a wanted angle and a measured one to amplitudes, from a wanted force of
//! a muscle or at the hand to them.
//!
//! Lives here: setpoint tracks, the pseudo-differentiator, the control laws and how
//! much of their feedback counts, the mapping of effort onto flexor and extensor,
//! and one joint of all these.
//! Not here: pulses, limits of the board or ramps (`safety` has the last word),
//! bytes, the sensor itself.
//! In: timed setpoints and measurements, and the time. Out: one amplitude per
//! channel and tick, whether a limit was met, or a named sensor fault.
//! Integers only, but where `limb` computes; the same inputs give the same bits on every
//! machine.

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
