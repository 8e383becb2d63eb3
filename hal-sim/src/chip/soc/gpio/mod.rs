//! Models ports A–I (RM0090 chapter 8): registers, pull resistors, external drivers, and edges of
//! the pins.
//!
//! A pin that is neither driven nor pulled reads 0. An output overrides an external level. A pin in
//! alternate-function mode is only driven from outside or pulled: the output of its peripheral is
//! not applied.

mod lock;

use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled};
use crate::chip::soc::Lanes;
use lock::Lock;

/// Number of ports: A to I.
pub const PORTS: usize = 9;

/// External connection of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Driven high.
    High,
    /// Driven low.
    Low,
    /// Not connected.
    Open,
}

/// Change of pins of one port by a write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Cycle from which the write is complete.
    pub cycle: Cycle,
    /// Port number; 0 is port A.
    pub port: u8,
    /// Pins that changed, bit n is pin n.
    pub changed: u16,
    /// Levels of all pins of the port after the change.
    pub levels: u16,
}

/// Register offsets (RM0090 8.4).
pub(crate) mod offset {
    pub const MODER: u32 = 0x00; // Mode
    pub const OTYPER: u32 = 0x04; // Output type
    pub const OSPEEDR: u32 = 0x08; // Output speed
    pub const PUPDR: u32 = 0x0C; // Pull resistors
    pub const IDR: u32 = 0x10; // Input data
    pub const ODR: u32 = 0x14; // Output data
    pub const BSRR: u32 = 0x18; // Bit set and reset
    pub const LCKR: u32 = 0x1C; // Lock of the configuration
    pub const AFRL: u32 = 0x20; // Alternate function, pins 0–7
    pub const AFRH: u32 = 0x24; // Alternate function, pins 8–15
}

#[derive(Clone, PartialEq, Debug, Default)]
struct Port {
    moder: u32,
    otyper: u16,
    ospeedr: u32,
    pupdr: u32,
    odr: u16,
    afr: [u32; 2],
    lock: Lock,
    /// Pins that are driven from outside, bit n is pin n.
    driven: u16,
    /// Levels of the pins in `driven`; 0 for all other pins.
    external: u16,
    /// Push-pull outputs, from MODER and OTYPER.
    push_pull: u16,
    levels: u16,
}

/// GPIO ports A to I with the levels of their pins.
#[derive(Clone, PartialEq, Debug)]
pub struct Gpio {
    ports: [Port; PORTS],
    /// Edges made by writes since the last drain, in ascending order of cycles: up to the last
    /// `advance` or access, and including an access of DMA2 that had begun by then (up to two
    /// cycles later).
    pub(crate) edges: Vec<Edge>,
}

impl Default for Gpio {
    fn default() -> Self {
        let mut gpio = Self {
            ports: std::array::from_fn(|_| Port::default()),
            edges: Vec::new(),
        };
        for port in 0..PORTS {
            gpio.ports[port].reset(port);
        }
        gpio
    }
}

impl Gpio {
    /// Resets `port` (RM0090 8.4); external connections stay. A port beyond I is ignored.
    pub fn reset_port(&mut self, port: usize, at: Cycle) {
        if let Some(p) = self.ports.get_mut(port) {
            let before = p.levels;
            p.reset(port);
            self.record(port, before, at);
        }
    }

    /// Reads the register at `offset` of `port` (0 is A).
    pub fn read(&mut self, port: usize, offset: u32) -> Modelled<u32> {
        let p = self.port(port)?;
        match offset {
            offset::LCKR => Ok(p.lock.read()),
            _ => p.register(offset),
        }
    }

    /// Writes the register at `offset` of `port`, or bytes of it (RM0090 8.4), with effect from
    /// cycle `done` on. The key of LCKR must be written as a whole word: a narrower write aborts
    /// the key sequence and changes nothing.
    pub fn write(&mut self, port: usize, offset: u32, written: Lanes, done: Cycle) -> Modelled {
        let p = self.port(port)?;
        let value = match (written.is_whole(), offset) {
            (true, _) => written.value,
            (false, offset::LCKR) => {
                p.lock.break_off();
                return Ok(());
            }
            (false, _) => written.merge_into(p.register(offset)?),
        };
        if offset == offset::BSRR {
            self.bsrr(port, value, done);
            return Ok(());
        }
        let p = &mut self.ports[port];
        let before = p.levels;
        match offset {
            offset::MODER => p.moder = p.lock.apply_lock(p.moder, value, 2, 0),
            offset::OTYPER => p.otyper = p.lock.apply_lock(p.otyper.into(), value, 1, 0) as u16,
            offset::OSPEEDR => p.ospeedr = p.lock.apply_lock(p.ospeedr, value, 2, 0),
            offset::PUPDR => p.pupdr = p.lock.apply_lock(p.pupdr, value, 2, 0),
            offset::IDR => (), // read only
            offset::ODR => p.odr = value as u16,
            offset::LCKR => p.lock.write(value),
            offset::AFRL => p.afr[0] = p.lock.apply_lock(p.afr[0], value, 4, 0),
            offset::AFRH => p.afr[1] = p.lock.apply_lock(p.afr[1], value, 4, 8),
            _ => return Err(Unmodelled("a GPIO register")),
        }
        p.refresh();
        self.record(port, before, done);
        Ok(())
    }

    /// Inverts bits of a configuration register, whether or not it is locked. Radiation or a glitch
    /// may do so, but no access can.
    pub fn upset(&mut self, port: usize, offset: u32, bits: u32, at: Cycle) -> Modelled {
        let old = self.read(port, offset)?;
        let lock = std::mem::take(&mut self.ports[port].lock); // `read` knows the port
        let done = self.write(port, offset, Lanes::whole(old ^ bits), at);
        self.ports[port].lock = lock;
        done
    }

    /// Writes BSRR of `port`: bits 15–0 set, 31–16 reset, set wins (RM0090 8.4.7). `port` must be
    /// in `0..PORTS`.
    #[inline]
    pub fn bsrr(&mut self, port: usize, value: u32, done: Cycle) {
        let p = &mut self.ports[port];
        let odr = after_bsrr(p.odr, value);
        let flipped = odr ^ p.odr;
        if flipped == 0 {
            return;
        }
        p.odr = odr;
        let before = p.levels;
        if flipped & !p.push_pull == 0 {
            p.levels ^= flipped;
        } else {
            p.refresh();
        }
        self.record(port, before, done);
    }

    /// Returns ODR, the output data register, of `port`, which must be in `0..PORTS`.
    #[inline]
    pub fn output(&self, port: usize) -> u16 {
        self.ports[port].odr
    }

    /// Connects `level` to a pin from outside, and returns the pin's level if it changed. The
    /// change is not recorded as an edge, because the caller knows it. Ports beyond I and pins
    /// beyond 15 are ignored.
    pub fn drive(&mut self, port: usize, pin: usize, level: Level) -> Option<bool> {
        let p = self.ports.get_mut(port).filter(|_| pin < 16)?;
        let (bit, before) = (1u16 << pin, p.levels);
        p.driven = p.driven & !bit | if level == Level::Open { 0 } else { bit };
        p.external = p.external & !bit | if level == Level::High { bit } else { 0 };
        p.refresh();
        let now = p.levels;
        ((before ^ now) & bit != 0).then_some(now & bit != 0)
    }

    /// Returns the level of a pin; low beyond port I and pin 15.
    pub fn level(&self, port: usize, pin: usize) -> bool {
        pin < 16
            && self
                .ports
                .get(port)
                .is_some_and(|p| p.levels >> pin & 1 != 0)
    }

    /// Returns whether a pin is in input mode, in which it drives nothing.
    pub fn is_input(&self, port: usize, pin: usize) -> bool {
        let port = self.ports.get(port);
        port.is_some_and(|p| p.moder & 0b11 << (2 * pin) == 0)
    }

    /// Returns all levels of `port`, bit n is pin n; 0 beyond port I.
    pub fn levels(&self, port: usize) -> u16 {
        self.ports.get(port).map_or(0, |p| p.levels)
    }

    /// Returns whether a pin is in alternate-function mode with function number `function`, 0–15.
    pub fn has_function(&self, port: usize, pin: usize, function: u32) -> bool {
        let mode = 0b10 << (2 * pin);
        self.ports.get(port).is_some_and(|p| {
            p.moder & 0b11 << (2 * pin) == mode
                && p.afr[pin / 8] >> (4 * (pin % 8)) & 0xF == function
        })
    }

    fn port(&mut self, port: usize) -> Modelled<&mut Port> {
        self.ports.get_mut(port).ok_or(Unmodelled("a GPIO port"))
    }

    #[inline]
    fn record(&mut self, port: usize, before: u16, cycle: Cycle) {
        let levels = self.ports[port].levels;
        if levels != before {
            self.edges.push(Edge {
                cycle,
                port: port as u8,
                changed: levels ^ before,
                levels,
            });
        }
    }
}

impl Port {
    /// Returns the register at `offset`, except LCKR, which changes when it is read.
    fn register(&self, offset: u32) -> Modelled<u32> {
        Ok(match offset {
            offset::MODER => self.moder,
            offset::OTYPER => self.otyper.into(),
            offset::OSPEEDR => self.ospeedr,
            offset::PUPDR => self.pupdr,
            offset::IDR => self.idr().into(),
            offset::ODR => self.odr.into(),
            offset::BSRR => 0, // write only: reads as 0
            offset::AFRL => self.afr[0],
            offset::AFRH => self.afr[1],
            _ => return Err(Unmodelled("a GPIO register")),
        })
    }

    fn reset(&mut self, port: usize) {
        let (moder, ospeedr, pupdr) = match port {
            // SWDIO, SWCLK, JTDI on A; JTDO and NJTRST on B (RM0090 8.4.1–8.4.4).
            0 => (0xA800_0000, 0x0C00_0000, 0x6400_0000),
            1 => (0x0000_0280, 0x0000_00C0, 0x0000_0100),
            _ => (0, 0, 0),
        };
        *self = Self {
            moder,
            ospeedr,
            pupdr,
            driven: self.driven,
            external: self.external,
            ..Self::default()
        };
        self.refresh();
    }

    /// Recomputes the levels of the pins from the registers and external connections.
    fn refresh(&mut self) {
        let (mut output, mut up) = (0u16, 0u16);
        for pin in 0..16 {
            output |= u16::from(self.moder >> (2 * pin) & 0b11 == 0b01) << pin;
            up |= u16::from(self.pupdr >> (2 * pin) & 0b11 == 0b01) << pin;
        }
        self.push_pull = output & !self.otyper;
        // An open-drain output drives low or not at all.
        let sinks = output & self.otyper & !self.odr;
        let passive = self.driven & self.external | !self.driven & up;
        self.levels = self.push_pull & self.odr | !self.push_pull & !sinks & passive;
    }

    /// Returns the input data register; an analogue pin reads 0 (RM0090 8.3.12).
    fn idr(&self) -> u16 {
        let mut analogue = 0u16;
        for pin in 0..16 {
            analogue |= u16::from(self.moder >> (2 * pin) & 0b11 == 0b11) << pin;
        }
        self.levels & !analogue
    }
}

/// Returns ODR after a write of `value` to BSRR, if ODR was `odr` before.
#[inline]
pub const fn after_bsrr(odr: u16, value: u32) -> u16 {
    let (set, reset) = (value as u16, (value >> 16) as u16);
    odr & !reset | set
}

#[cfg(test)]
mod tests;
