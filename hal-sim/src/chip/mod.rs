//! The chip simulator: runs the ELF that would be flashed, cycle by cycle.
//!
//! Lives here: a Cortex-M4F (`cpu`), the STM32F405 around it (`soc`). Not
//! here: the device code, which comes as machine code only; the wearer
//! (`crate::body`). In: an ELF, bytes on USB, pins. Out: pin edges with their
//! cycle, DAC codes, bytes. What nobody models stops the run and is named.

pub mod ad5668;
pub mod alone;
pub mod board;
pub mod cpu;
pub mod gdb;
pub mod image;
pub mod profile;
pub mod rtt;
pub mod soc;
pub mod usb;

/// Core clock cycles (HCLK) since power was applied.
pub type Cycle = u64;
