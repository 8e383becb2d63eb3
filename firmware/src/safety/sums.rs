//! The total current through the common return, and its limits.

use super::Wearer;
use crate::units::MicroAmps;

/// The largest current through the common return, with every channel at its limit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Sums {
    /// Largest sum at any microsecond of the phases of one sign. Channels of the opposite sign
    /// count as zero, because they may be at zero.
    pub peak: MicroAmps,
    /// Largest rms current of all channels together.
    pub rms: MicroAmps,
}

/// The limit of the common return that a setup exceeds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SumError {
    /// The current at some microsecond is too large.
    Peak {
        /// Largest current of one sign that would flow.
        sum: MicroAmps,
        /// Largest allowed current of one sign.
        max: MicroAmps,
    },
    /// The rms current is too large.
    Rms {
        /// Rms current of all channels together that would flow.
        sum: MicroAmps,
        /// Largest allowed rms current of all channels together.
        max: MicroAmps,
    },
}

impl Sums {
    /// Compares the sums with the wearer's limits and the size of the common return.
    ///
    /// # Errors
    /// Returns the first limit exceeded, with the sum that would flow.
    pub fn check(&self, wearer: &Wearer) -> Result<(), SumError> {
        let max = wearer.max_sum();
        if self.peak > max {
            return Err(SumError::Peak {
                sum: self.peak,
                max,
            });
        }
        let max = wearer.max_sum_rms();
        if self.rms > max {
            return Err(SumError::Rms { sum: self.rms, max });
        }
        Ok(())
    }
}
