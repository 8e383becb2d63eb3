//! What a wearer is made to feel: a virtual wall at a joint.
//!
//! Lives here: the wall's specification, its checks, and what it asks of its
//! channels at each control tick. Not here: angle control, the sensor
//! (`control`), limits of the board or ramps (`safety` has the last word).
//! In: an angle, measured by `control`'s one path of measurements, and the time.
//! Out: one amplitude per channel, whether a limit was met, or a sensor fault.
//! Integers only; the same inputs give the same bits on every machine.

mod spec;
mod wall;

pub use spec::{CoContraction, PreWall, Side, WallError, WallSpec};
pub use wall::{Wall, WallOrders, WallState};
