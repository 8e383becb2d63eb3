//! Light-emitting diode of a breadboard. The reference board has none: every call does nothing. On a
//! board without the strap nothing is driven, because the pin may be connected to something else.

use super::pac::RCC;
use super::pac::gpio::vals;
use super::pins::{self, place};
use crate::board::wiring::{BOARD, Breadboard};

/// Lights the diode, or turns it off. The inputs must be configured.
pub fn set(is_lit: bool) {
    let Some(Breadboard { strap, led }) = BOARD.breadboard else {
        return;
    };
    if !pins::is_high(strap) {
        return;
    }
    RCC.ahb1enr().modify(|w| w.0 |= 1 << led.pin.port.index());
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    let (port, pin) = place(led.pin);
    let level = if is_lit == led.is_active_high {
        led.pin.bit()
    } else {
        led.pin.bit() << 16
    };
    port.bsrr().write(|w| w.0 = level);
    port.moder()
        .modify(|w| w.set_moder(pin, vals::Moder::OUTPUT));
}
