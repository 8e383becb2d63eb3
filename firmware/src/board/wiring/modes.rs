//! Pin modes that follow from the wiring, and the register values that they require.
//!
//! Set-up does not use this module: it calls the register crate. So the comparison in each window
//! shows a mistake in either (`board::stm32f405::registers`).

use super::CHANNELS;
use super::pins::{Alternate, Pin, Port};
use super::{Breadboard, Wiring};

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

/// Number of pins beside the channels' lines, of a board that has them all.
const OTHERS: usize = 16;
const USES: usize = 2 * CHANNELS + OTHERS;

/// Uses of a board's pins.
struct Uses {
    list: [PinUse; USES],
    /// Number of entries of `list` that count.
    count: usize,
}

impl Uses {
    const fn push(&mut self, entry: PinUse) {
        self.list[self.count] = entry; // `USES` are all there are
        self.count += 1;
    }
}

impl Wiring {
    const fn uses(&self) -> Uses {
        let (outputs, inputs, dacs) = (&self.outputs, &self.inputs, &self.dacs);
        let mut uses = Uses {
            list: [used(outputs.sync, Mode::Output); USES],
            count: 1,
        };
        uses.push(used(
            outputs.pump.pin(),
            if outputs.pump.is_driven() {
                Mode::Output
            } else {
                Mode::Input
            },
        ));
        uses.push(used(dacs.select[0], Mode::Output));
        uses.push(used(dacs.select[1], Mode::Output));
        uses.push(used(inputs.arm, Mode::Input));
        uses.push(used(inputs.over_current, Mode::Input));
        uses.push(used(inputs.hand_stop, Mode::Input));
        uses.push(used(inputs.angle.pin, Mode::Analogue));
        uses.push(used(inputs.current.pin, Mode::Analogue));
        let alternate = [dacs.clock, dacs.data, inputs.trigger];
        let mut n = 0;
        while n < alternate.len() {
            let Alternate { pin, function } = alternate[n];
            uses.push(PinUse {
                function,
                ..used(pin, Mode::Alternate)
            });
            n += 1;
        }
        n = 0;
        while n < inputs.spare.len() {
            if let Some(pin) = inputs.spare[n] {
                uses.push(PinUse {
                    is_spare: true,
                    ..used(pin, Mode::Analogue)
                });
            }
            n += 1;
        }
        if let Some(Breadboard { strap, led }) = self.breadboard {
            uses.push(used(strap, Mode::Input));
            uses.push(used(led.pin, Mode::Output));
        }
        n = 0;
        while n < CHANNELS {
            if let Some(lines) = outputs.channels[n] {
                uses.push(used(lines.cathodic, Mode::Output));
                uses.push(used(lines.anodic, Mode::Output));
            }
            n += 1;
        }
        uses
    }

    /// Returns every pin that the board uses, and their number.
    pub(super) const fn pins(&self) -> ([Pin; USES], usize) {
        let Uses { list, count } = self.uses();
        let mut pins = [list[0].pin; USES];
        let mut n = 0;
        while n < count {
            pins[n] = list[n].pin;
            n += 1;
        }
        (pins, count)
    }

    /// Returns MODER of `port`, for all its pins that the board uses.
    #[must_use]
    pub const fn modes(&self, port: Port) -> Bits {
        let (uses, mut modes, mut n) = (self.uses(), Bits { bits: 0, value: 0 }, 0);
        while n < uses.count {
            let PinUse { pin, mode, .. } = uses.list[n];
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
        while n < uses.count {
            let PinUse { pin, mode, .. } = uses.list[n];
            if pin.is_on(port) && matches!(mode, Mode::Alternate) && pin.number / 8 == half {
                let place = 4 * (pin.number % 8);
                functions.bits |= 0xF << place;
                functions.value |= (uses.list[n].function as u32) << place;
            }
            n += 1;
        }
        functions
    }

    /// Returns a mask of the outputs on `port`, one bit per pin.
    #[must_use]
    pub const fn driven(&self, port: Port) -> u32 {
        let (uses, mut driven, mut n) = (self.uses(), 0, 0);
        while n < uses.count {
            if uses.list[n].pin.is_on(port) && matches!(uses.list[n].mode, Mode::Output) {
                driven |= uses.list[n].pin.bit();
            }
            n += 1;
        }
        driven
    }

    /// Returns the ports with a pin that the board uses, bit 0 for port A, as in RCC_AHB1ENR.
    #[must_use]
    pub const fn ports(&self) -> u32 {
        let (uses, mut ports, mut n) = (self.uses(), 0, 0);
        while n < uses.count {
            ports |= 1 << uses.list[n].pin.port.index();
            n += 1;
        }
        ports
    }

    /// Returns a mask of the pins of `port` whose configuration is locked until the next reset.
    #[must_use]
    pub const fn locked(&self, port: Port) -> u32 {
        let (uses, mut locked, mut n) = (self.uses(), 0, 0);
        while n < uses.count {
            if uses.list[n].pin.is_on(port) && !uses.list[n].is_spare {
                locked |= uses.list[n].pin.bit();
            }
            n += 1;
        }
        locked
    }
}
