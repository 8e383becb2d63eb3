//! The STM32F405 around the core: memories, bus matrix, peripherals, at
//! register level, as far as the images touch them.
//!
//! In: the core's accesses, pins, USB packets. Out: pin edges, interrupt
//! lines, what the DACs hold. RM0090 is the reference manual.

pub mod otg;
mod peripheral;
mod ram;

pub use peripheral::Peripheral;
pub use ram::Ram;
