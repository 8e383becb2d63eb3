//! The chip simulator: runs the ELF that would be flashed, cycle by cycle.
//!
//! Contains the core (`cpu`), the STM32F405 around it (`soc`), and the board around the chip
//! (`board`, `ad5668`, the `usb` host); `alone` and `bare` run a chip without that board. `image`
//! reads the ELF, `names` gives the names of registers; `profile`, `rtt` and `gdb` observe a run.
//! The device code comes as machine code only, and the wearer is not simulated here. In: an ELF,
//! bytes on USB, pins. Out: pin edges with their cycle, DAC codes, bytes. A feature that is not
//! modelled stops the run with an error that names it. docs/how/chip.md describes what is exact.

pub mod ad5668;
pub mod alone;
pub mod bare;
pub mod board;
pub mod cpu;
#[cfg(feature = "gdb")]
pub mod gdb;
pub mod image;
pub mod names;
pub mod profile;
#[cfg(feature = "rtt")]
pub mod rtt;
pub mod soc;
pub mod time;
pub mod usb;

/// Core clock cycles (HCLK) since power was applied.
pub type Cycle = u64;
