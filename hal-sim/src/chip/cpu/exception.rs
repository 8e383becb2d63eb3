//! Exception entry and return, stacking, lazy floating-point stacking, faults,
//! reset (Arm ARM B1.5), with their cycles (TRM section 3.9).

use super::{Bus, Cpu, Fault, Stop, Trap};

impl Cpu {
    /// Reset: private registers to their reset values, SP and PC from the
    /// vector table at 0.
    ///
    /// # Errors
    /// [`Stop`]: no vector table.
    pub fn reset<B: Bus>(&mut self, _bus: &mut B) -> Result<(), Stop> {
        todo!("the exceptions' helper writes this")
    }

    /// Samples the interrupt lines and takes the pending exception of highest
    /// priority if it preempts; says whether it did. Called between
    /// instructions, whenever something may have changed.
    ///
    /// # Errors
    /// [`Stop`].
    pub(super) fn take_pending<B: Bus>(&mut self, _bus: &mut B) -> Result<bool, Stop> {
        todo!("the exceptions' helper writes this")
    }

    /// Takes `fault` of the instruction at R15, escalated where its exception
    /// is disabled or its priority does not suffice.
    ///
    /// # Errors
    /// [`Stop::LockUp`].
    pub(super) fn take_fault<B: Bus>(&mut self, _bus: &mut B, _fault: Fault) -> Result<(), Stop> {
        todo!("the exceptions' helper writes this")
    }

    /// Returns from an exception: a branch to `exc_return` (0xFxxx_xxxx) in
    /// handler mode. Tail-chains where another is pending.
    ///
    /// # Errors
    /// [`Trap`].
    pub(super) fn return_from_exception<B: Bus>(
        &mut self,
        _bus: &mut B,
        _exc_return: u32,
    ) -> Result<(), Trap> {
        todo!("the exceptions' helper writes this")
    }

    /// Before every floating-point instruction: CPACR, lazy stacking, FPCA.
    ///
    /// # Errors
    /// [`Trap`].
    #[inline]
    pub(super) fn prepare_fp<B: Bus>(&mut self, _bus: &mut B) -> Result<(), Trap> {
        todo!("the exceptions' helper writes this")
    }

    /// SVC.
    pub(super) fn supervisor_call(&mut self) {
        todo!("the exceptions' helper writes this")
    }

    /// BKPT `immediate`: semihosting if it is 0xAB and semihosting is on, else
    /// [`Fault::Breakpoint`].
    ///
    /// # Errors
    /// [`Trap`].
    pub(super) fn breakpoint<B: Bus>(&mut self, _bus: &mut B, _immediate: u8) -> Result<(), Trap> {
        todo!("the exceptions' helper writes this")
    }

    /// MRS: special register `sysm`.
    pub(super) fn read_special(&self, _sysm: u8) -> u32 {
        todo!("the exceptions' helper writes this")
    }

    /// MSR with `mask` (bits 11:10 of the encoding). The caller takes what is
    /// pending afterwards.
    pub(super) fn write_special(&mut self, _sysm: u8, _mask: u8, _value: u32) {
        todo!("the exceptions' helper writes this")
    }
}
