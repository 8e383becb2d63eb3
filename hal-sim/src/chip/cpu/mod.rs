//! A Cortex-M4F: ARMv7E-M Thumb-2, DSP and FPv4-SP, with its cycles.
//!
//! `decode` and `execute` are the instructions, `dsp` and `fpu` two families
//! of them, `access` their way to memory, `timing` their cycles; `exception`
//! and `system` (NVIC, SCB, SysTick, MPU, DWT, FPU control) the rest of the
//! core. In: a `Bus`. Out: accesses in the order of their cycles.

pub mod bus;
pub mod registers;
pub mod stop;

pub use bus::{Bus, Size};
pub use registers::Registers;
pub use stop::{Fault, Stop, Trap};
