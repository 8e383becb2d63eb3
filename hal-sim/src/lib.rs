//! Simulators that replace the board and the wearer.
//!
//! `world` couples a device with a simulated limb in virtual time. Three backends execute the
//! device code: `native` runs it in this process, `qemu` runs its Thumb build, and `chip` runs the
//! flashed image on a model of the chip. `lockstep` defines the interface of a device in virtual
//! time; the backends implement it. `images` builds the images for `qemu` and `chip`, and `input`
//! reads files that a person names.
//! `body` and `trace` do not depend on the firmware, so that they cannot share its mistakes.
//! `random` generates the random numbers of all modules.
//!
//! Only the modules behind a feature read a clock or open a socket: `chip`, `gdb`, `rtt`, `images`,
//! `qemu` and `wire`, all of them on by default.

#![warn(missing_docs)]

pub mod body;
#[cfg(feature = "chip")]
pub mod chip;
#[cfg(feature = "images")]
pub mod images;
pub mod input;
pub mod lockstep;
pub mod native;
#[cfg(feature = "qemu")]
pub mod qemu;
pub mod random;
pub mod trace;
pub mod wire;
pub mod world;
