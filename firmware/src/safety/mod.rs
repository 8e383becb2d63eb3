//! Safety: every limit that stands between a request and the outputs. No module below this one
//! takes orders.
//!
//! Contents: hard and wearer limits, the validated [`Setup`], the state machine ([`Guard`]),
//! electrode checks, ramps, host silence and fault codes.
//! Input: requests, inputs of the board, wanted amplitudes. Output: DAC codes for the scheduler
//! (this module implements `pulse::Supply`) and notices for `device`.

mod allowance;
mod check;
mod common_return;
mod fault;
mod guard;
pub mod limits;
mod list;
mod measures;
mod opposition;
mod outputs;
mod ramp;
mod setup;
mod slope;
mod stage;
mod stages;
mod state;
mod stimulus;
mod sums;
mod timed;
mod trip;
mod watch;
mod wearer;

pub use allowance::{
    AllowanceWords, Entry, Ledger, OPEN_US, RemainingAllowance, Usage, UsageAtBoot,
};
pub use check::{CHECK_PAUSE_US, ElectrodeCheck, Reading};
pub use fault::{Fault, FaultRecord};
pub use guard::Guard;
pub use list::{ListedPulse, MAX_LISTED, PulseList};
pub use opposition::opposed_pairs;
pub use outputs::{BrokenRule, Expected, OutputCheck};
pub use setup::{Channel, ChannelSpec, Setup, SetupError, check_group};
pub use stage::{Stage, StageSpec};
pub use stages::{
    Origin, StageKind, StageMismatch, StageSupply, StageTable, StageWords, Stages, StagesFault,
};
pub use state::{Denial, Inputs, Notice, State, StopCause};
pub use stimulus::{Stimuli, Stimulus};
pub use sums::{SumError, Sums};
pub use timed::{MAX_TIMED, Timed};
pub use trip::trip_levels;
pub use wearer::{Wearer, WearerSpec};
