//! What comes out of a simulated board.

use crate::pulse::Levels;
use crate::units::{DacCode, Micros};

/// Where a simulated board's outputs go, in time order per kind.
pub trait Sink {
    /// The outputs change.
    fn write_levels(&mut self, at: Micros, levels: Levels);
    /// A DAC is written.
    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode);
    /// The level of a bank's comparators is written. Nobody need listen.
    fn write_trip(&mut self, _at: Micros, _bank: u8, _code: DacCode) {}
    /// Bytes leave for the host.
    fn write_bytes(&mut self, at: Micros, bytes: &[u8]);
}

impl<S: Sink + ?Sized> Sink for &mut S {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        (**self).write_levels(at, levels);
    }
    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        (**self).write_dac(at, channel, code);
    }
    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        (**self).write_trip(at, bank, code);
    }
    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        (**self).write_bytes(at, bytes);
    }
}
