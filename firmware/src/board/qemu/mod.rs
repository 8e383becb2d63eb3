//! The STM32F405 that QEMU models as `netduinoplus2`, where there is no clock
//! to believe: time, sensors and bytes come over the lock-step port on
//! USART2, outputs go back the same way (`lockstep::port`).
//!
//! Lives here: that UART. Not here: timers, DMA, USB, pins (QEMU models them
//! wrongly or not at all), and so nothing about timing.

mod usart;

use crate::link::{Decoder, Kind};
use crate::lockstep::port::Port;
use usart::Usart;

/// Serves the lock-step port for ever.
pub fn run() -> ! {
    let mut usart = Usart::enable();
    let mut port = Port::new(Kind::Qemu);
    let mut decoder = Decoder::default();
    Port::report_ready(&mut |frame| usart.write(frame));
    loop {
        // A frame that was spoilt is no command either: an empty one.
        let message = match decoder.push(usart.read()) {
            None => continue,
            Some(message) => message.unwrap_or_default(),
        };
        port.serve(message, &mut |frame| usart.write(frame));
        decoder.clear();
    }
}
