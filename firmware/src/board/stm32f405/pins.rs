//! Configuration of the pins according to the board's wiring ([`crate::board::wiring`];
//! docs/reference/hardware.md).
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
//! Every safety input reads its safe level when its cable is disconnected. Otherwise the connected
//! circuit drives the line high through at most 10 kΩ against the internal pull-down of 30–50 kΩ
//! (DS8626, I/O static characteristics): at least 0.75 VDD > VIH 0.7 VDD.

use super::pac::gpio::{Gpio, vals};
use super::pac::{GPIOA, GPIOB, GPIOC, GPIOD, GPIOE, RCC};
use crate::board::wiring::{self, BOARD, BoardPins, Breadboard, Inputs, Pin, Port, Pump};
use crate::pulse::tape::{isolated_words, pump_low};

const INPUTS: Inputs = BOARD.inputs;
/// /SYNC pin of each DAC.
const SELECT: [Pin; 2] = BOARD.dacs.select;
/// BSRR words of the tape ports that disconnect the outputs and turn the pump off.
const SAFE: [u32; wiring::TAPE_PORTS] = {
    let (isolated, pump_low) = (isolated_words::<BoardPins>(), pump_low::<BoardPins>());
    [isolated[0] | pump_low[0], isolated[1] | pump_low[1]]
};
/// Ports in use, as bits of RCC_AHB1ENR.
const CLOCKED: u32 = BOARD.ports();
/// Ports in use, with a mask of the pins to lock.
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

/// EXTI line of the over-current input (RM0090 section 12.2.5).
pub const OVER_CURRENT_LINE: usize = INPUTS.over_current.number as usize;
/// Port of the over-current input, as SYSCFG numbers ports; see [`OVER_CURRENT_LINE`].
pub const OVER_CURRENT_PORT: u8 = INPUTS.over_current.port.index() as u8;

/// GPIO ports that the tape plays.
pub const TAPE_PORTS: [Gpio; wiring::TAPE_PORTS] =
    [gpio(BOARD.outputs.ports[0]), gpio(BOARD.outputs.ports[1])];

/// Returns the GPIO registers of `port`.
const fn gpio(port: Port) -> Gpio {
    match port {
        Port::A => GPIOA,
        Port::B => GPIOB,
        Port::C => GPIOC,
        Port::D => GPIOD,
        Port::E => GPIOE,
    }
}

/// Returns the registers of the pin's port, and the pin's number there.
pub(super) const fn place(pin: Pin) -> (Gpio, usize) {
    (gpio(pin.port), pin.number as usize)
}

/// Disconnects the outputs of both ports and turns the pump off, by writes of the CPU. Enables the
/// ports' clocks first. The effect lasts only while no play stream runs.
pub fn isolate() {
    RCC.ahb1enr().modify(|w| w.0 |= CLOCKED);
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    for (port, word) in TAPE_PORTS.into_iter().zip(SAFE) {
        port.bsrr().write(|w| w.0 = word);
    }
}

/// Configures the digital inputs, pulled down. On a breadboard the pump's pin and the strap are two
/// of them.
pub fn init_inputs() {
    RCC.ahb1enr().modify(|w| w.0 |= CLOCKED);
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    for (port, pin) in const {
        [
            place(INPUTS.arm),
            place(INPUTS.over_current),
            place(INPUTS.hand_stop),
        ]
    } {
        input(port, pin);
    }
    if let Pump::Input(pin) = BOARD.outputs.pump {
        let (port, pin) = place(pin);
        input(port, pin);
    }
    if let Some(Breadboard { strap, .. }) = BOARD.breadboard {
        let (port, pin) = place(strap);
        input(port, pin);
    }
}

/// Configures every pin but the inputs as in the table above: outputs get their disconnected level
/// before they become outputs, so that no edge occurs.
pub fn init_outputs() {
    isolate();
    select_dac(None);
    for pin in 0..16 {
        // The disconnect word of a port resets exactly its outputs.
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
    let spare = INPUTS.spare.into_iter().flatten();
    for pin in [INPUTS.angle.pin, INPUTS.current.pin]
        .into_iter()
        .chain(spare)
    {
        let (port, pin) = place(pin);
        port.pupdr()
            .modify(|w| w.set_pupdr(pin, vals::Pupdr::FLOATING));
        port.moder()
            .modify(|w| w.set_moder(pin, vals::Moder::ANALOG));
    }
}

/// Locks the configuration of the pins until the next reset, by the sequence of RM0090 section
/// 8.4.8. Returns whether the lock is set.
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

/// Returns the level of `pin`.
#[must_use]
pub fn is_high(pin: Pin) -> bool {
    gpio(pin.port).idr().read().0 & pin.bit() != 0
}

fn input(port: Gpio, pin: usize) {
    port.pupdr()
        .modify(|w| w.set_pupdr(pin, vals::Pupdr::PULL_DOWN));
    port.moder()
        .modify(|w| w.set_moder(pin, vals::Moder::INPUT));
}

fn output(port: Gpio, pin: usize, pull: vals::Pupdr) {
    port.otyper().modify(|w| w.set_ot(pin, vals::Ot::PUSH_PULL));
    // Medium speed: edges of about 10 ns (DS8626, I/O AC characteristics) suffice for 1 µs slots.
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

/// The DAC that receives SPI frames.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Dac {
    /// DAC of the lower channels.
    One,
    /// DAC of the upper channels.
    Two,
}

/// Pulls the /SYNC line of `dac` low, or releases both lines. The BSRR writes touch no channel
/// line.
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

/// State of the safety inputs and the trigger input, read at one instant.
pub struct SafetyInputs {
    /// Whether the arm key is closed.
    pub arm: bool,
    /// Whether the hand-held stop is closed, which allows stimulation.
    pub hand_stop: bool,
    /// Whether an over-current comparator has latched, or its cable is off.
    pub over_current: bool,
    /// Whether the trigger input is active.
    pub held: bool,
}

/// Reads all inputs with one access to their port.
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
