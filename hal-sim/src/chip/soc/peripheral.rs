//! What all peripherals have in common.

use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::Unmodelled;

/// A block of registers. Wires to other peripherals, interrupt lines and pins
/// are methods of each; `soc` joins them.
pub trait Peripheral {
    /// Reads the register at `offset` from the block's base. Sub-word accesses
    /// come as they are: a peripheral refuses the sizes that it does not model.
    ///
    /// # Errors
    /// A register, or a use of it, that nobody models.
    fn read(&mut self, offset: u32, size: Size, at: Cycle) -> Result<u32, Unmodelled>;

    /// Writes the register at `offset`.
    ///
    /// # Errors
    /// A register, or a use of it, that nobody models.
    fn write(&mut self, offset: u32, size: Size, value: u32, at: Cycle) -> Result<(), Unmodelled>;

    /// Lets time go on to `to`. Every access is preceded by it.
    ///
    /// # Errors
    /// Behaviour that nobody models.
    fn advance(&mut self, _to: Cycle) -> Result<(), Unmodelled> {
        Ok(())
    }

    /// Earliest cycle at which something happens that others can see.
    fn next_event(&self) -> Cycle {
        Cycle::MAX
    }
}
