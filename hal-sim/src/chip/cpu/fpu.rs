//! FPv4-SP: everything whose first half-word is 0xEC00–0xEFFF or 0xFC00–0xFFFF
//! with coprocessor 10 or 11.

use super::{Bus, Cpu, Trap};

/// A decoded floating-point instruction; small and `Copy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {}

/// Decodes; `None` for what FPv4-SP leaves UNDEFINED.
#[must_use]
pub fn decode(_first: u16, _second: u16) -> Option<Op> {
    None
}

impl Cpu {
    /// Executes (the condition has passed), after `prepare_fp`; gives its
    /// cycles without pipeline effects (TRM table 7-1).
    ///
    /// # Errors
    /// [`Trap`].
    pub(super) fn execute_fpu<B: Bus>(&mut self, _bus: &mut B, op: Op) -> Result<u32, Trap> {
        match op {}
    }
}
