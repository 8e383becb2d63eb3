//! Registers, and nothing else: one room per board or emulator.
//!
//! Exists on a target only. Here the three owners of `device` are given their
//! execution contexts, pins, timers and bytes. No rule about stimulation
//! lives here. In: interrupts and registers. Out: calls to the owners.
#![allow(unsafe_code)]

#[cfg(feature = "bench")]
pub mod bench;
#[cfg(any(feature = "bench", feature = "qemu"))]
mod last_words;
#[cfg(feature = "qemu")]
pub mod qemu;
#[cfg(feature = "stm32f405")]
pub mod stm32f405;
