//! The loop: instructions, events, exceptions, sleep.

use super::{Bus, Cpu, Stop};
use crate::chip::Cycle;

impl Cpu {
    /// A core that has power but was not reset yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            registers: super::Registers::default(),
            cycle: 0,
            instructions: 0,
            system: super::system::System::default(),
            decoded: super::decode::Cache::default(),
            pipeline: super::timing::Pipeline::default(),
        }
    }

    /// Runs until `until` is reached (passed by at most one instruction or
    /// exception entry). Sleep is skipped to the next event.
    ///
    /// # Errors
    /// [`Stop`].
    pub fn run<B: Bus>(&mut self, _bus: &mut B, _until: Cycle) -> Result<(), Stop> {
        todo!("the core's helper writes this")
    }

    /// Executes exactly one instruction or takes one exception.
    ///
    /// # Errors
    /// [`Stop`].
    pub fn step<B: Bus>(&mut self, _bus: &mut B) -> Result<(), Stop> {
        todo!("the core's helper writes this")
    }
}

impl Default for Cpu {
    fn default() -> Self {
        Self::new()
    }
}
