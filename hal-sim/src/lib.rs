//! What stands in for the board and the wearer.
//!
//! `world` couples a device with a body in virtual time; `native` runs the
//! device code in this process, `qemu` its Thumb build, `chip` the flashed
//! image on a model of the chip; `lockstep`, below them all, is what a device
//! in virtual time can do.
//! `images` builds what the last two run, `input` reads files that somebody names.
//! `body` and `trace` know nothing of the firmware, so that they cannot agree with its
//! mistakes. `random` draws for all of them.
//!
//! No module reads a clock or opens a socket but those behind a feature: `chip`, `gdb`, `rtt`,
//! `images`, `qemu` and `wire`, all of them on by default.

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
