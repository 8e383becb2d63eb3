//! Output stages of a real board, as the rest of the image sees them: their inputs and readings are
//! used as they are. [`super::simulated_stage`] takes their place on a breadboard.

use super::pins::{self, SafetyInputs};
use super::stages;
use crate::device::Restart;
use crate::link::Kind;
use crate::pulse::{Sample, WindowPlan};
use crate::safety::{Fault, Setup, Stages};
use crate::units::DacCode;

/// Kind of device that an image for these stages is.
pub const KIND: Kind = Kind::Board;
/// Whether the image enters the chip's boot loader on request.
pub const HAS_BOOT_LOADER: bool = false;

/// Output stages as inputs of the program.
pub struct OutputStage;

impl OutputStage {
    /// Returns the stages.
    pub const fn new() -> Self {
        Self
    }

    /// Notes that the DAC of `channel` was set to `code`.
    #[inline(always)]
    pub fn note_dac(&mut self, _channel: u8, _code: DacCode) {}

    /// Notes the `sample` that the current sense takes while `plan` plays.
    #[inline(always)]
    pub fn note_sample(&mut self, _sample: &Sample, _plan: &WindowPlan, _setup: Option<&Setup>) {}

    /// Returns the reading of the current sense, counts, from the ADC's.
    #[inline(always)]
    pub fn current(&self, raw: u16) -> u16 {
        raw
    }

    /// Reads the safety inputs.
    #[inline(always)]
    pub fn inputs(&self) -> SafetyInputs {
        pins::safety_inputs()
    }
}

/// Returns the fault, with its detail, if the image does not belong on this board. Nothing that the
/// reference board has would show that.
pub fn find_other_board() -> Option<(Fault, u32)> {
    None
}

/// Returns the board's table of its output stages.
pub fn stages(unique_id: [u32; 3]) -> Stages {
    stages::load(unique_id)
}

/// Does what the accepted `restart` asks for, and restarts.
pub fn restart(restart: &Restart) -> ! {
    match restart {
        Restart::StoreStages(table) => stages::store(table),
        // The session refuses this request here.
        Restart::EnterBootLoader => cortex_m::peripheral::SCB::sys_reset(),
    }
}
