//! Differences between boards, and a log of their pins.

use super::wiring::Wiring;
use crate::chip::Cycle;
use crate::chip::soc::gpio::Edge;
use crate::chip::soc::rcc::Crystal;
use std::sync::{Arc, Mutex};

/// Every change of the chip's pins, by its cycle, for pictures of a logic analyser.
#[derive(Clone, Debug, Default)]
pub struct PinLog {
    /// Cycle of device time 0.
    pub origin: Cycle,
    /// Changes since then.
    pub edges: Vec<Edge>,
}

/// A log that the board writes and somebody else reads; clones of the board write the same log.
pub type SharedPinLog = Arc<Mutex<PinLog>>;

/// A board's parts that differ from board to board, and from one specimen to the next.
#[derive(Clone, Copy, Debug)]
pub struct Hardware {
    /// Wiring of the board.
    pub wiring: &'static Wiring,
    /// Crystal that is fitted.
    pub crystal: Crystal,
    /// Whether a wire connects the strap to 3.3 V.
    pub is_strapped: bool,
}

impl Hardware {
    /// Returns a board with its nominal crystal and, if it has one, a closed strap.
    #[must_use]
    pub const fn new(wiring: &'static Wiring) -> Self {
        Self {
            wiring,
            crystal: Crystal::new(wiring.crystal_hz),
            is_strapped: true,
        }
    }
}
