//! Simulated STM32F405 in its DfuSe boot loader, with cuts and faults at chosen transfers.
//!
//! The state machine follows DFU 1.1 appendix A and AN3156; time passes only through
//! [`SimulatedClock`]. [`HostileDevice`] answers at random instead.

mod device;
mod faults;
mod hostile;
mod memory;

pub use device::{ExitKind, Simulated};
pub use faults::{Cut, CutPoint, Fault, PollReport};
pub use hostile::HostileDevice;
pub use memory::{Memory, Stop};

use crate::protocol::Clock;
use std::cell::Cell;
use std::rc::Rc;

/// Names of the alternate settings of an STM32F405's boot loader, in order.
pub const SETTINGS: [&str; 4] = [
    "@Internal Flash  /0x08000000/04*016Kg,01*064Kg,07*128Kg",
    "@Option Bytes  /0x1FFFC000/01*016 e",
    "@OTP Memory /0x1FFF7800/01*512 e,01*016 e",
    "@Device Feature/0xFFFF0000/01*004 e",
];

/// Clock that a session and a simulated device share. It advances by sleeping, and by the time that
/// the device takes to answer.
#[derive(Debug, Clone, Default)]
pub struct SimulatedClock(Rc<Cell<u64>>);

impl SimulatedClock {
    /// Time since the start in milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> u64 {
        self.0.get()
    }
}

impl Clock for SimulatedClock {
    fn sleep_ms(&mut self, ms: u32) {
        self.0.set(self.0.get().saturating_add(ms.into()));
    }

    fn elapsed_ms(&self) -> u64 {
        self.now_ms()
    }
}
