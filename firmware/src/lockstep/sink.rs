//! What comes out of a simulated board.

use crate::pulse::Levels;
use crate::units::{DacCode, Micros};

/// Where a simulated board's outputs go, in time order per kind.
pub trait Sink {
    /// The outputs change.
    fn levels(&mut self, at: Micros, levels: Levels);
    /// A DAC is written.
    fn dac(&mut self, at: Micros, channel: u8, code: DacCode);
    /// The level of a bank's comparators is written. Nobody need listen.
    fn trip(&mut self, _at: Micros, _bank: u8, _code: DacCode) {}
    /// Bytes leave for the host.
    fn bytes(&mut self, at: Micros, bytes: &[u8]);
}

impl<S: Sink + ?Sized> Sink for &mut S {
    fn levels(&mut self, at: Micros, levels: Levels) {
        (**self).levels(at, levels);
    }
    fn dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        (**self).dac(at, channel, code);
    }
    fn trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        (**self).trip(at, bank, code);
    }
    fn bytes(&mut self, at: Micros, bytes: &[u8]) {
        (**self).bytes(at, bytes);
    }
}
