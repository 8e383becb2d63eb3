//! Common interface of all peripherals.

pub(super) use crate::chip::Cycle;
pub(super) use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// A block of registers. Connections to other peripherals, interrupt lines and pins are methods of
/// each block; `soc` joins them.
pub trait Peripheral {
    /// Reads the register at `offset` from the block's base, a multiple of 4. [`super::width`]
    /// handles accesses narrower than a word.
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32>;

    /// Writes `value` to the register at `offset` from the block's base, a multiple of 4, at cycle
    /// `at`.
    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled;

    /// Brings the state of the block to cycle `to`. Called before every access.
    fn advance(&mut self, _to: Cycle) -> Modelled {
        Ok(())
    }

    /// Returns the earliest cycle at which a change becomes visible outside the block; `Cycle::MAX`
    /// if none is expected.
    fn next_event(&self) -> Cycle {
        Cycle::MAX
    }
}

/// Word accesses of a test program, which panic if they are not modelled.
#[cfg(test)]
pub trait WordAccess: Peripheral {
    /// Advances the block to cycle `at`, then writes the register at `offset`.
    fn set(&mut self, offset: u32, value: u32, at: Cycle) {
        self.advance(at).unwrap();
        Peripheral::write(self, offset, value, at).unwrap();
    }

    /// Advances the block to cycle `at`, then reads the register at `offset`.
    fn get(&mut self, offset: u32, at: Cycle) -> u32 {
        self.advance(at).unwrap();
        Peripheral::read(self, offset, at).unwrap()
    }
}

#[cfg(test)]
impl<P: Peripheral> WordAccess for P {}
