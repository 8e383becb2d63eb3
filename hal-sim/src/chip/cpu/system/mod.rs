//! Private peripherals, 0xE000_0000–0xE00F_FFFF: NVIC, SCB, SysTick, MPU, DWT,
//! FPU control, ITM as far as the images touch them (Arm ARM B3).

use super::Size;
use super::bus::Unmodelled;
use crate::chip::Cycle;

/// State of the private peripherals and of exceptions.
#[derive(Debug, Default)]
pub struct System {}

impl System {
    /// Reads a private register at `at`.
    ///
    /// # Errors
    /// A register that nobody models.
    pub fn read(&mut self, _address: u32, _size: Size, _at: Cycle) -> Result<u32, Unmodelled> {
        todo!("the exceptions' helper writes this")
    }

    /// Writes a private register. The caller takes what is pending afterwards.
    ///
    /// # Errors
    /// A register that nobody models.
    pub fn write(
        &mut self,
        _address: u32,
        _size: Size,
        _value: u32,
        _at: Cycle,
    ) -> Result<(), Unmodelled> {
        todo!("the exceptions' helper writes this")
    }

    /// Whether the MPU lets data at `address` be accessed. Hot: one compare
    /// while no region denies anything nearby.
    #[inline]
    #[must_use]
    pub fn may_access(&self, _address: u32, _write: bool, _privileged: bool) -> bool {
        true
    }

    /// CCR.DIV_0_TRP.
    #[must_use]
    pub const fn divide_by_zero_traps(&self) -> bool {
        false
    }

    /// Earliest cycle at which SysTick pends its exception.
    #[must_use]
    pub fn next_event(&self) -> Cycle {
        Cycle::MAX
    }
}
