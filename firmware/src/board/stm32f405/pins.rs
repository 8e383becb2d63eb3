//! The pin map (LQFP64), docs/hardware.md. Channel lines, sync and pump are
//! defined by `pulse::tape`, which also makes their port words.
//!
//! | pins | use | mode |
//! |---|---|---|
//! | PC0–9, PB0,1,5–9,12–14 | channels 1–5, 6–10 | output, pull-down |
//! | PB15, PB10 | sync out, pump | output, pull-down |
//! | PC10, PC12 | SPI3 SCK, MOSI | AF6, pull-down |
//! | PC11, PD2 | /SYNC of DAC 1 (channels 1–5), DAC 2 (6–10) | output, pull-up |
//! | PA0, PA1 | joint angle, current sense | analogue |
//! | PA4, PA5 | analogue, spare | analogue |
//! | PA6 | arm input: high = closed | input, pull-down |
//! | PA7 | over-current: low = latched, or cable off | input, pull-down |
//! | PA8 | hand-held stop: high = closed, may stimulate | input, pull-down |
//! | PA15 | trigger in, TIM2_CH1 | AF1, pull-down |
//! | PA2, PA3 | USART2, unused by this image | reset state |
//! | PA9, PA11, PA12 | USB VBUS, DM, DP | by the USB driver |
//!
//! Every safety input reads its safe side when its cable is off: the healthy
//! side drives the line high through at most 10 kΩ against the internal
//! pull-down of 30–50 kΩ (DS8626, I/O static characteristics), at least 0.75 VDD > VIH 0.7 VDD.

use super::pac::gpio::{Gpio, vals};
use super::pac::{GPIOA, GPIOB, GPIOC, GPIOD, RCC};
use crate::pulse::tape::{ISOLATED_B, ISOLATED_C};

/// GPIOB_BSRR bit that clears the pump line, PB10.
const PUMP_LOW: u32 = 1 << (10 + 16);
/// The bits a port-isolating word resets are the outputs of that port.
const OUTPUTS_B: u32 = (ISOLATED_B | PUMP_LOW) >> 16;
const OUTPUTS_C: u32 = ISOLATED_C >> 16;

const ARM: usize = 6;
const OVER_CURRENT: usize = 7;
const HAND_STOP: usize = 8;
const TRIGGER: usize = 15;
const SCK: usize = 10;
const MOSI: usize = 12;
const SYNC_1: usize = 11;
const SYNC_2: usize = 2;

/// EXTI line of the over-current input: PA7 (RM0090 section 12.2.5).
pub const OVER_CURRENT_LINE: usize = OVER_CURRENT;

/// Writes isolated to both ports by the CPU and drops the pump, clocked or not before.
/// Holds only while no play stream runs.
pub fn isolate() {
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpiocen(true);
        w.set_gpioden(true);
    });
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    GPIOB.bsrr().write(|w| w.0 = ISOLATED_B | PUMP_LOW);
    GPIOC.bsrr().write(|w| w.0 = ISOLATED_C);
}

/// Makes every pin what the table says. First thing after reset: outputs get
/// their isolated level before they are outputs, so no edge is seen.
pub fn init() {
    isolate();
    select_dac(None);
    for pin in 0..16 {
        if OUTPUTS_B & 1 << pin != 0 {
            output(GPIOB, pin, vals::Pupdr::PULL_DOWN);
        }
        if OUTPUTS_C & 1 << pin != 0 {
            output(GPIOC, pin, vals::Pupdr::PULL_DOWN);
        }
    }
    output(GPIOC, SYNC_1, vals::Pupdr::PULL_UP);
    output(GPIOD, SYNC_2, vals::Pupdr::PULL_UP);
    alternate(GPIOC, SCK, 6);
    alternate(GPIOC, MOSI, 6);
    alternate(GPIOA, TRIGGER, 1);
    for pin in [0, 1, 4, 5] {
        GPIOA
            .pupdr()
            .modify(|w| w.set_pupdr(pin, vals::Pupdr::FLOATING));
        GPIOA
            .moder()
            .modify(|w| w.set_moder(pin, vals::Moder::ANALOG));
    }
    for pin in [ARM, OVER_CURRENT, HAND_STOP] {
        GPIOA
            .pupdr()
            .modify(|w| w.set_pupdr(pin, vals::Pupdr::PULL_DOWN));
        GPIOA
            .moder()
            .modify(|w| w.set_moder(pin, vals::Moder::INPUT));
    }
}

/// Locks what [`init`] made of the pins until the next reset, by the sequence of
/// RM0090 section 8.4.8; says whether it holds.
#[must_use]
pub fn lock() -> bool {
    let inputs = [0, 1, ARM, OVER_CURRENT, HAND_STOP, TRIGGER];
    let inputs = inputs.iter().fold(0, |mask, pin| mask | 1 << pin);
    let on_c = OUTPUTS_C | 1 << SYNC_1 | 1 << SCK | 1 << MOSI;
    let ports = [
        (GPIOA, inputs),
        (GPIOB, OUTPUTS_B),
        (GPIOC, on_c),
        (GPIOD, 1 << SYNC_2),
    ];
    ports.into_iter().all(|(port, pins)| {
        const KEY: u32 = 1 << 16;
        for word in [pins | KEY, pins, pins | KEY] {
            port.lckr().write(|w| w.0 = word);
        }
        let _ = port.lckr().read();
        port.lckr().read().0 == pins | KEY
    })
}

fn output(port: Gpio, pin: usize, pull: vals::Pupdr) {
    port.otyper().modify(|w| w.set_ot(pin, vals::Ot::PUSH_PULL));
    // Medium: edges of about 10 ns (DS8626, I/O AC characteristics) suffice for 1 µs slots.
    port.ospeedr()
        .modify(|w| w.set_ospeedr(pin, vals::Ospeedr::MEDIUM_SPEED));
    port.pupdr().modify(|w| w.set_pupdr(pin, pull));
    port.moder()
        .modify(|w| w.set_moder(pin, vals::Moder::OUTPUT));
}

fn alternate(port: Gpio, pin: usize, function: u8) {
    port.ospeedr()
        .modify(|w| w.set_ospeedr(pin, vals::Ospeedr::HIGH_SPEED));
    port.pupdr()
        .modify(|w| w.set_pupdr(pin, vals::Pupdr::PULL_DOWN));
    port.afr(pin / 8).modify(|w| w.set_afr(pin % 8, function));
    port.moder()
        .modify(|w| w.set_moder(pin, vals::Moder::ALTERNATE));
}

/// Which DAC listens.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Dac {
    /// Channels 1–5, /SYNC on PC11.
    One,
    /// Channels 6–10, /SYNC on PD2.
    Two,
}

/// Pulls one /SYNC low, or lets both go. BSRR writes touch no channel line.
pub fn select_dac(dac: Option<Dac>) {
    let level = |line: usize, low: bool| 1u32 << if low { line + 16 } else { line };
    GPIOC
        .bsrr()
        .write(|w| w.0 = level(SYNC_1, dac == Some(Dac::One)));
    GPIOD
        .bsrr()
        .write(|w| w.0 = level(SYNC_2, dac == Some(Dac::Two)));
}

/// What people, comparators and the trigger input say, all of one instant.
pub struct SafetyInputs {
    /// The arm key is closed.
    pub arm: bool,
    /// The hand-held stop is closed.
    pub hand_stop: bool,
    /// An over-current comparator has latched, or its cable is off.
    pub over_current: bool,
    /// The trigger input is held.
    pub held: bool,
}

/// Reads the port once.
#[must_use]
pub fn safety_inputs() -> SafetyInputs {
    let port = GPIOA.idr().read();
    let high = |pin| port.idr(pin) == vals::Idr::HIGH;
    SafetyInputs {
        arm: high(ARM),
        hand_stop: high(HAND_STOP),
        over_current: !high(OVER_CURRENT),
        held: high(TRIGGER),
    }
}
