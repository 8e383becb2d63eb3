//! Receiver of the outputs of a simulated board.

use crate::pulse::Levels;
use crate::units::{DacCode, Micros};

/// Receiver of a simulated board's outputs, which arrive in order of time for each kind.
pub trait Sink {
    /// Receives a change of the output levels at `at`.
    fn write_levels(&mut self, at: Micros, levels: Levels);
    /// Receives a DAC write at `at`.
    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode);
    /// Receives a write of the trip level of a bank's comparators. The default ignores the write.
    fn write_trip(&mut self, _at: Micros, _bank: u8, _code: DacCode) {}
    /// Receives bytes that leave for the host at `at`.
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
