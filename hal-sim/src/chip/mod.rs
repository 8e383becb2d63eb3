//! The chip simulator: runs the ELF that would be flashed, cycle by cycle.
//!
//! Lives here: the core (`cpu`), the STM32F405 around it (`soc`), and the board
//! around that (`board`, `ad5668`, the `usb` host); `alone` and `bare` are a chip without
//! that board. `image` is what is flashed, `names` what registers are called; `profile`,
//! `rtt` and `gdb` look on. Not here: the device code, which comes as machine code only; the
//! wearer. In: an ELF, bytes on USB, pins. Out: pin edges with their cycle, DAC codes, bytes.
//! What nobody models stops the run and is named. docs/chip.md: what is exact.

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
