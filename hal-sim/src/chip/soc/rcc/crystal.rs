//! The crystal of a board, HSE.

/// HSE start-up, 2 ms typical (DS8626, HSE oscillator characteristics).
pub(super) const HSE_START_NS: u64 = 2_000_000;

/// The crystal of a board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Crystal {
    /// Frequency, Hz, 4–26 MHz.
    pub hz: u32,
    /// Start-up time, ns; `None` for a crystal that is missing or never starts.
    pub start_ns: Option<u64>,
}

impl Crystal {
    /// Returns a crystal of `hz` with the typical start-up time.
    #[must_use]
    pub const fn new(hz: u32) -> Self {
        Self {
            hz,
            start_ns: Some(HSE_START_NS),
        }
    }
}
