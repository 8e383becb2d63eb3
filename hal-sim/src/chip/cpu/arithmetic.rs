//! 32-bit register arithmetic: everything whose first half-word is
//! 0xFA00–0xFBFF. Shifts by register, extensions, parallel and saturating
//! arithmetic, SEL, REV, CLZ; multiplications and divisions of all kinds.

use super::Cpu;

/// A decoded instruction of this family; small and `Copy`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {}

/// Decodes; `None` for what the architecture leaves UNDEFINED or
/// UNPREDICTABLE.
#[must_use]
pub fn decode(_first: u16, _second: u16) -> Option<Op> {
    None
}

impl Cpu {
    /// Executes (the condition has passed); gives its cycles without pipeline
    /// effects, early-terminating divisions included (TRM table 3-1).
    pub(super) fn execute_arithmetic(&mut self, op: Op) -> Result<u32, super::Trap> {
        match op {}
    }
}
