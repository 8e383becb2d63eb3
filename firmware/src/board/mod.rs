//! What is different from board to board: registers, one module per board or emulator, and
//! [`wiring`], which is data.
//!
//! Registers exist on a target only. There the three owners of `device` are given their
//! execution contexts, pins, timers and bytes. No rule about stimulation
//! lives here. In: interrupts and registers. Out: calls to the owners.
#![allow(unsafe_code)]

#[cfg(all(target_os = "none", feature = "bench"))]
pub mod bench;
#[cfg(all(target_os = "none", any(feature = "bench", feature = "qemu")))]
mod panic_handler;
#[cfg(all(target_os = "none", feature = "qemu"))]
pub mod qemu;
#[cfg(all(target_os = "none", feature = "stm32f405"))]
pub mod stm32f405;
pub mod wiring;
