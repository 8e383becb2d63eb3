//! What a wearer is made to feel: a virtual wall at a joint, or an object that is
//! lifted and dropped.
//!
//! Lives here: their specifications, the checks, and what they ask of their
//! channels at each control tick. Not here: angle control, the sensor
//! (`control`), limits of the board or ramps (`safety` has the last word).
//! In: an angle, measured by `control`'s one path of measurements, and the time.
//! Out: one amplitude per channel, whether a limit was met, or a sensor fault.
//! Integers only; the same inputs give the same bits on every machine.

mod modulation;
mod spec;
mod wall;

pub use modulation::{
    Extreme, Form, Hold, HoldError, JOINTS, ModulatedSpec, Modulation, ModulationError,
    ModulationOrders, ModulationSpec, Modulations, ModulationsState, MotionPhase, PhaseDetector,
    PhaseState, QuarticSpec,
};
pub use spec::{CoContraction, PreWall, Side, WallError, WallSpec};
pub use wall::{Wall, WallOrders, WallState};
