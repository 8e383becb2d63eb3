//! The STM32F405 that QEMU models as `netduinoplus2`. It has no reliable clock, so time, sensors
//! and bytes come over the lock-step port on USART2, and outputs leave the same way
//! (`lockstep::port`).
//!
//! This module contains that UART. It uses no timers, DMA, USB or pins, which QEMU models wrongly
//! or not at all, and so shows nothing about timing.

mod usart;

use crate::link::{Decoder, Kind};
use crate::lockstep::port::Port;
use usart::Usart;

/// Runs the lock-step port forever.
pub fn run() -> ! {
    let mut usart = Usart::enable();
    let mut port = Port::new(Kind::Qemu);
    let mut decoder = Decoder::default();
    Port::report_ready(&mut |frame| usart.write(frame));
    loop {
        // A corrupt frame is handled like an empty one, which is no valid command.
        let message = match decoder.push(usart.read()) {
            None => continue,
            Some(message) => message.unwrap_or_default(),
        };
        port.serve(message, &mut |frame| usart.write(frame));
        decoder.clear();
    }
}
