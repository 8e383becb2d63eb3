//! Pin modes that follow from the wiring, and the register values that they require.
//!
//! Set-up does not use this module: it calls the register crate. So the comparison in each window
//! shows a mistake in either (`board::stm32f405::registers`).

use super::CHANNELS;
use super::Wiring;
use super::pins::{Pin, Port};

/// Expected bits of a register.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Bits {
    /// Mask of the bits that are compared; 0 if the register is ignored.
    pub bits: u32,
    /// Expected value of the masked bits.
    pub value: u32,
}

/// Use of a pin; the numbers are those of MODER (RM0090 section 8.4.1).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Mode {
    Input = 0b00,
    Output = 0b01,
    Alternate = 0b10,
    Analogue = 0b11,
}

#[derive(Clone, Copy)]
struct PinUse {
    pin: Pin,
    mode: Mode,
    /// Number of the alternate function, 0 without one.
    function: u8,
    /// Whether the input is never read, so that changes of its mode do no harm.
    is_spare: bool,
}

const fn used(pin: Pin, mode: Mode) -> PinUse {
    PinUse {
        pin,
        mode,
        function: 0,
        is_spare: false,
    }
}

/// Number of pins beside the channels' lines.
const OTHERS: usize = 14;
const USES: usize = 2 * CHANNELS + OTHERS;

impl Wiring {
    const fn uses(&self) -> [PinUse; USES] {
        let (outputs, inputs, dacs) = (&self.outputs, &self.inputs, &self.dacs);
        let alternate = [dacs.clock, dacs.data, inputs.trigger];
        let others = [
            used(outputs.sync, Mode::Output),
            used(outputs.pump, Mode::Output),
            used(dacs.select[0], Mode::Output),
            used(dacs.select[1], Mode::Output),
            used(inputs.arm, Mode::Input),
            used(inputs.over_current, Mode::Input),
            used(inputs.hand_stop, Mode::Input),
            used(inputs.angle.pin, Mode::Analogue),
            used(inputs.current.pin, Mode::Analogue),
            used(inputs.spare[0], Mode::Analogue),
            used(inputs.spare[1], Mode::Analogue),
            used(alternate[0].pin, Mode::Alternate),
            used(alternate[1].pin, Mode::Alternate),
            used(alternate[2].pin, Mode::Alternate),
        ];
        let mut uses = [used(outputs.sync, Mode::Output); USES];
        let mut n = 0;
        while n < OTHERS {
            uses[n] = others[n];
            n += 1;
        }
        uses[9].is_spare = true;
        uses[10].is_spare = true;
        n = 0;
        while n < alternate.len() {
            uses[11 + n].function = alternate[n].function;
            n += 1;
        }
        n = 0;
        while n < CHANNELS {
            let lines = outputs.channels[n];
            uses[OTHERS + 2 * n] = used(lines.cathodic, Mode::Output);
            uses[OTHERS + 2 * n + 1] = used(lines.anodic, Mode::Output);
            n += 1;
        }
        uses
    }

    /// Returns every pin that the board uses.
    pub(super) const fn pins(&self) -> [Pin; USES] {
        let uses = self.uses();
        let mut pins = [uses[0].pin; USES];
        let mut n = 0;
        while n < USES {
            pins[n] = uses[n].pin;
            n += 1;
        }
        pins
    }

    /// Returns MODER of `port`, for all its pins that the board uses.
    #[must_use]
    pub const fn modes(&self, port: Port) -> Bits {
        let (uses, mut modes, mut n) = (self.uses(), Bits { bits: 0, value: 0 }, 0);
        while n < USES {
            let PinUse { pin, mode, .. } = uses[n];
            if pin.is_on(port) {
                modes.bits |= 0b11 << (2 * pin.number);
                modes.value |= (mode as u32) << (2 * pin.number);
            }
            n += 1;
        }
        modes
    }

    /// Returns AFRL (`half` 0) or AFRH (1) of `port`, for its pins that peripherals use.
    #[must_use]
    pub const fn functions(&self, port: Port, half: u8) -> Bits {
        let (uses, mut functions, mut n) = (self.uses(), Bits { bits: 0, value: 0 }, 0);
        while n < USES {
            let PinUse { pin, mode, .. } = uses[n];
            if pin.is_on(port) && matches!(mode, Mode::Alternate) && pin.number / 8 == half {
                let place = 4 * (pin.number % 8);
                functions.bits |= 0xF << place;
                functions.value |= (uses[n].function as u32) << place;
            }
            n += 1;
        }
        functions
    }

    /// Returns a mask of the outputs on `port`, one bit per pin.
    #[must_use]
    pub const fn driven(&self, port: Port) -> u32 {
        let (uses, mut driven, mut n) = (self.uses(), 0, 0);
        while n < USES {
            if uses[n].pin.is_on(port) && matches!(uses[n].mode, Mode::Output) {
                driven |= uses[n].pin.bit();
            }
            n += 1;
        }
        driven
    }

    /// Returns the ports with a pin that the board uses, bit 0 for port A, as in RCC_AHB1ENR.
    #[must_use]
    pub const fn ports(&self) -> u32 {
        let (uses, mut ports, mut n) = (self.uses(), 0, 0);
        while n < USES {
            ports |= 1 << uses[n].pin.port.index();
            n += 1;
        }
        ports
    }

    /// Returns a mask of the pins of `port` whose configuration is locked until the next reset.
    #[must_use]
    pub const fn locked(&self, port: Port) -> u32 {
        let (uses, mut locked, mut n) = (self.uses(), 0, 0);
        while n < USES {
            if uses[n].pin.is_on(port) && !uses[n].is_spare {
                locked |= uses[n].pin.bit();
            }
            n += 1;
        }
        locked
    }
}
