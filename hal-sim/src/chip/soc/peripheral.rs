//! What all peripherals have in common.

pub(super) use crate::chip::Cycle;
pub(super) use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// A block of registers. Wires to other peripherals, interrupt lines and pins
/// are methods of each; `soc` joins them.
pub trait Peripheral {
    /// Reads the register at `offset` from the block's base, a multiple of 4. What an
    /// access narrower than a word means is [`super::width`]'s.
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32>;

    /// Writes the register at `offset`.
    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled;

    /// Lets time go on to `to`. Every access is preceded by it.
    fn advance(&mut self, _to: Cycle) -> Modelled {
        Ok(())
    }

    /// Earliest cycle at which something happens that others can see.
    fn next_event(&self) -> Cycle {
        Cycle::MAX
    }
}

/// A program's accesses to words, which must be modelled.
#[cfg(test)]
pub trait WordAccess: Peripheral {
    /// Writes the register at `offset`.
    fn set(&mut self, offset: u32, value: u32, at: Cycle) {
        self.advance(at).unwrap();
        Peripheral::write(self, offset, value, at).unwrap();
    }

    /// Reads it.
    fn get(&mut self, offset: u32, at: Cycle) -> u32 {
        self.advance(at).unwrap();
        Peripheral::read(self, offset, at).unwrap()
    }
}

#[cfg(test)]
impl<P: Peripheral> WordAccess for P {}
