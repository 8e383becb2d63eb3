//! Hardware access: registers, one module per board or emulator, and [`wiring`], which is data.
//!
//! Register modules are compiled for targets only. They give the three owners of `device` their
//! execution contexts, pins, timers and bytes. Rules about stimulation do not belong here. In:
//! interrupts and registers. Out: calls to the owners.
#![allow(unsafe_code)]

#[cfg(all(target_os = "none", feature = "bench"))]
pub mod bench;
pub mod boot_failure;
pub mod image;
#[cfg(all(target_os = "none", any(feature = "bench", feature = "qemu")))]
mod panic_handler;
#[cfg(all(target_os = "none", feature = "qemu"))]
pub mod qemu;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
pub mod stm32f405;
pub mod wiring;
