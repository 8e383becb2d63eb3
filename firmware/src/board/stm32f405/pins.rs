//! Makes the pins what the board's wiring says ([`crate::board::wiring`]; docs/hardware.md).
//!
//! | use | mode |
//! |---|---|
//! | channels' lines, sync out, pump | output, pull-down |
//! | SPI3 clock and data | alternate function, pull-down |
//! | /SYNC of the DACs | output, pull-up |
//! | joint angle, current sense, spare | analogue |
//! | arm input, over-current, hand-held stop | input, pull-down |
//! | trigger in | alternate function, pull-down |
//! | USB | by the USB driver |
//! | all others | reset state |
//!
//! Every safety input reads its safe side when its cable is off: the healthy
//! side drives the line high through at most 10 kΩ against the internal
//! pull-down of 30–50 kΩ (DS8626, I/O static characteristics), at least 0.75 VDD > VIH 0.7 VDD.

use super::pac::gpio::{Gpio, vals};
use super::pac::{GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, RCC};
use crate::board::wiring::{self, BOARD, BoardPins, Inputs, Pin, Port};
use crate::pulse::tape::{isolated_words, pump_low};

const INPUTS: Inputs = BOARD.inputs;
/// /SYNC of each DAC.
const SELECT: [Pin; 2] = BOARD.dacs.select;
/// The bits of each tape port's BSRR that isolate its lines and drop the pump.
const SAFE: [u32; wiring::TAPE_PORTS] = {
    let (isolated, pump_low) = (isolated_words::<BoardPins>(), pump_low::<BoardPins>());
    [isolated[0] | pump_low[0], isolated[1] | pump_low[1]]
};
/// The ports in use, as RCC_AHB1ENR has them.
const CLOCKED: u32 = BOARD.ports();
/// What is locked of each of them.
const LOCKED: [(Port, u32); CLOCKED.count_ones() as usize] = {
    let mut locked = [(Port::A, 0); CLOCKED.count_ones() as usize];
    let (mut n, mut used) = (0, 0);
    while n < Port::ALL.len() {
        if CLOCKED & 1 << n != 0 {
            locked[used] = (Port::ALL[n], BOARD.locked(Port::ALL[n]));
            used += 1;
        }
        n += 1;
    }
    locked
};

/// EXTI line of the over-current input (RM0090 section 12.2.5), and its port there.
pub const OVER_CURRENT_LINE: usize = INPUTS.over_current.number as usize;
/// See [`OVER_CURRENT_LINE`].
pub const OVER_CURRENT_PORT: u8 = INPUTS.over_current.port.index() as u8;

/// The ports that the tape plays.
pub const TAPE_PORTS: [Gpio; wiring::TAPE_PORTS] =
    [gpio(BOARD.outputs.ports[0]), gpio(BOARD.outputs.ports[1])];

/// Registers of `port`.
const fn gpio(port: Port) -> Gpio {
    match port {
        Port::A => GPIOA,
        Port::B => GPIOB,
        Port::C => GPIOC,
        Port::D => GPIOD,
        Port::E => GPIOE,
    }
}

/// Registers of the pin's port, and its number there.
const fn place(pin: Pin) -> (Gpio, usize) {
    (gpio(pin.port), pin.number as usize)
}

/// Writes isolated to both ports by the CPU and drops the pump, clocked or not before.
/// Holds only while no play stream runs.
pub fn isolate() {
    RCC.ahb1enr().modify(|w| w.0 |= CLOCKED);
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    for (port, word) in TAPE_PORTS.into_iter().zip(SAFE) {
        port.bsrr().write(|w| w.0 = word);
    }
}

/// Makes every pin what the table says. First thing after reset: outputs get
/// their isolated level before they are outputs, so no edge is seen.
pub fn init() {
    isolate();
    select_dac(None);
    for pin in 0..16 {
        // What isolates a port resets its outputs.
        if SAFE[0] >> 16 & 1 << pin != 0 {
            output(TAPE_PORTS[0], pin, vals::Pupdr::PULL_DOWN);
        }
        if SAFE[1] >> 16 & 1 << pin != 0 {
            output(TAPE_PORTS[1], pin, vals::Pupdr::PULL_DOWN);
        }
    }
    let [first, second] = const { [place(SELECT[0]), place(SELECT[1])] };
    output(first.0, first.1, vals::Pupdr::PULL_UP);
    output(second.0, second.1, vals::Pupdr::PULL_UP);
    alternate(
        const { place(BOARD.dacs.clock.pin) },
        BOARD.dacs.clock.function,
    );
    alternate(
        const { place(BOARD.dacs.data.pin) },
        BOARD.dacs.data.function,
    );
    alternate(const { place(INPUTS.trigger.pin) }, INPUTS.trigger.function);
    for (port, pin) in const {
        [
            place(INPUTS.angle.pin),
            place(INPUTS.current.pin),
            place(INPUTS.spare[0]),
            place(INPUTS.spare[1]),
        ]
    } {
        port.pupdr()
            .modify(|w| w.set_pupdr(pin, vals::Pupdr::FLOATING));
        port.moder()
            .modify(|w| w.set_moder(pin, vals::Moder::ANALOG));
    }
    for (port, pin) in const {
        [
            place(INPUTS.arm),
            place(INPUTS.over_current),
            place(INPUTS.hand_stop),
        ]
    } {
        port.pupdr()
            .modify(|w| w.set_pupdr(pin, vals::Pupdr::PULL_DOWN));
        port.moder()
            .modify(|w| w.set_moder(pin, vals::Moder::INPUT));
    }
}

/// Locks what [`init`] made of the pins until the next reset, by the sequence of
/// RM0090 section 8.4.8; says whether it holds.
#[must_use]
pub fn lock() -> bool {
    LOCKED.into_iter().all(|(port, pins)| {
        let port = gpio(port);
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

fn alternate((port, pin): (Gpio, usize), function: u8) {
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
    /// The lower channels.
    One,
    /// The upper channels.
    Two,
}

/// Pulls one /SYNC low, or lets both go. BSRR writes touch no channel line.
pub fn select_dac(dac: Option<Dac>) {
    let [first, second] = SELECT;
    let level = |pin: Pin, low: bool| if low { pin.bit() << 16 } else { pin.bit() };
    gpio(first.port)
        .bsrr()
        .write(|w| w.0 = level(first, dac == Some(Dac::One)));
    gpio(second.port)
        .bsrr()
        .write(|w| w.0 = level(second, dac == Some(Dac::Two)));
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
    let port = gpio(INPUTS.arm.port).idr().read();
    let high = |pin: Pin| port.0 & pin.bit() != 0;
    SafetyInputs {
        arm: high(INPUTS.arm),
        hand_stop: high(INPUTS.hand_stop),
        over_current: !high(INPUTS.over_current),
        held: high(INPUTS.trigger.pin),
    }
}
