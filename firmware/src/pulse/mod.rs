//! Pulse trains, rendered as output states and played back one word per microsecond.
//!
//! Contents: the validated [`Train`], groups, the [`Scheduler`] that renders the next window, and
//! the port words of the pulse tape. Not here: amplitudes and permission to pulse, which `safety`
//! supplies through [`Supply`].
//! Input: trains, an epoch, triggers. Output: a [`WindowPlan`] per 250 µs.

use crate::board::wiring::BOARD;

mod group;
mod plan;
mod scheduler;
pub mod tape;
mod train;

pub use crate::board::wiring::{BANKS, CHANNELS};
pub(crate) use group::gcd;
pub use group::{Group, GroupError, GroupSpec, MAX_GROUPS, Partner, check_members};
pub use plan::{Change, Levels, MAX_PULSES, PulseStart, Sample, State, WindowPlan};
pub(crate) use scheduler::bit_positions;
pub use scheduler::{Burst, BurstTime, Middle, RenderError, Scheduler, Supply};
pub use train::{Shape, Train, TrainError, TrainSpec, Trigger};

/// Length of one window of the pulse tape, which one refill renders, µs. It is also the number of
/// slots in a window.
pub const WINDOW_US: u32 = 250;

/// Shortest disconnected time between anodic and cathodic drive of one channel, in µs, which the
/// board's output stages need.
pub const DEAD_TIME_US: u16 = BOARD.stages.dead_time_us;

/// Delay from a captured trigger edge to the epoch of triggered trains, in µs. Two windows are
/// rendered ahead, so any delay above 500 µs can be kept exactly.
pub const TRIGGER_DELAY_US: u32 = 1000;
