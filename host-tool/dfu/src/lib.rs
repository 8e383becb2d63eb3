//! Writes firmware to an STM32F405 through the USB DFU boot loader in its ROM (DfuSe 1.1a, ST
//! AN3156, UM0424).
//!
//! [`container`] reads and writes firmware files. [`flash`] checks an image and writes it in an
//! order that keeps the chip safe when the connection is cut. [`protocol`] speaks DfuSe over a
//! [`protocol::Transport`], which [`simulated`] and, with the feature `usb`, `usb` implement.
//! Nothing below `usb` reads a clock: waiting goes through [`protocol::Clock`].

#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic
    )
)]

pub mod chip;
pub mod container;
pub mod flash;
pub mod ids;
pub mod protocol;
pub mod simulated;
#[cfg(feature = "usb")]
pub mod usb;
