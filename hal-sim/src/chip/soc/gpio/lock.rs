//! Models LCKR: the configuration of locked pins stays until reset (RM0090 8.3.8, 8.4.8).
//!
//! The key sequence writes bit 16 as 1, 0, 1 with the same pins each time, then reads once; any
//! other access in between aborts it. Assumed: that read already shows the lock.

/// LCKK, the lock key bit of LCKR.
const KEY: u32 = 1 << 16;

/// Lock of the configuration of one port, and the progress of its key sequence.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Lock {
    pins: u16,
    /// Number of correct writes of the key sequence so far.
    written: u8,
    locked: bool,
}

impl Lock {
    /// Reads LCKR, which completes the key sequence.
    pub fn read(&mut self) -> u32 {
        self.locked |= self.written == 3;
        self.written = 0;
        u32::from(self.pins) | if self.locked { KEY } else { 0 }
    }

    /// Writes LCKR; has no effect once the port is locked.
    pub fn write(&mut self, value: u32) {
        if self.locked {
            return;
        }
        let (pins, key) = (value as u16, value & KEY != 0);
        let goes_on = pins == self.pins && key == (self.written == 2);
        self.written = match self.written {
            1 | 2 if goes_on => self.written + 1,
            _ => u8::from(key),
        };
        self.pins = pins;
    }

    /// Aborts the key sequence.
    pub const fn break_off(&mut self) {
        self.written = 0;
    }

    /// Returns the new value of a configuration register with `width` (1, 2, 4) bits per pin, whose
    /// lowest pin is `first`, when `value` is written over `old`.
    pub fn apply_lock(&self, old: u32, value: u32, width: u32, first: u32) -> u32 {
        if !self.locked {
            return value;
        }
        let field = (1 << width) - 1;
        let pins = (first..16).take((32 / width) as usize);
        let kept = pins.filter(|pin| self.pins >> pin & 1 != 0);
        let mask = kept.fold(0, |mask, pin| mask | field << (width * (pin - first)));
        old & mask | value & !mask
    }
}
