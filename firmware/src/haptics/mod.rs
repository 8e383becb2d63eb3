//! Haptics: stimulation that a wearer feels as a virtual wall at a joint, or as an object that is
//! lifted and lowered.
//!
//! This module contains the specifications, their checks, and the amplitudes of the channels at
//! each control tick. Angle control and the sensor (`control`), limits of the board and ramps
//! (`safety`) are elsewhere.
//! Inputs are an angle, from the measurements of `control`, and the time. Outputs are one amplitude
//! per channel, whether a limit was reached, and sensor faults.
//! All arithmetic is in integers; the same inputs give the same bits on every machine.

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
