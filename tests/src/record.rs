//! Outputs of a device, with unwrapped times.

use firmware::lockstep::Sink;
use firmware::pulse::Levels;
use firmware::units::{DacCode, Micros};
use hal_sim::trace::{self, Trace, Unwrap};

/// Outputs of a device so far.
#[derive(Clone, Default)]
pub struct Record {
    /// Levels and DAC codes.
    pub trace: Trace,
    /// Bytes that the device sent to the host.
    pub bytes: Vec<u8>,
    levels: Unwrap,
    dac: Unwrap,
}

impl Record {
    /// Returns an empty record of a device that boots at `at`.
    #[must_use]
    pub fn starting_at(at: Micros) -> Self {
        let mut record = Self::default();
        record.levels.unwrap_time(at.get());
        record.dac.unwrap_time(at.get());
        record
    }
}

impl Sink for Record {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        let t = self.levels.unwrap_time(at.get());
        self.trace.record_levels(t, trace::Levels(levels.0));
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        let t = self.dac.unwrap_time(at.get());
        self.trace.record_dac(t, channel, code.get());
    }

    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        let t = self.dac.unwrap_time(at.get());
        self.trace.record_trip(t, bank, code.get());
    }

    fn write_bytes(&mut self, _: Micros, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }
}
