//! Data accesses of instructions: alignment, MPU, private bus or `Bus`.

use super::{Bus, Cpu, Size, Trap};

impl Cpu {
    /// Loads from `address` and counts the wait states.
    ///
    /// # Errors
    /// [`Trap`].
    pub(super) fn load<B: Bus>(
        &mut self,
        bus: &mut B,
        address: u32,
        size: Size,
    ) -> Result<u32, Trap> {
        let _ = (bus, address, size);
        todo!("the core's helper writes this")
    }

    /// Stores to `address`; the write buffer hides what the manual says.
    ///
    /// # Errors
    /// [`Trap`].
    pub(super) fn store<B: Bus>(
        &mut self,
        bus: &mut B,
        address: u32,
        size: Size,
        value: u32,
    ) -> Result<(), Trap> {
        let _ = (bus, address, size, value);
        todo!("the core's helper writes this")
    }
}
