//! What may come together at the common return, and what is too much.

use super::Wearer;
use crate::units::MicroAmps;

/// The most that comes together at the common return with every channel at its limit.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Sums {
    /// At any microsecond, of the phases of one sign: a channel that pulls the other way
    /// may be at zero.
    pub peak: MicroAmps,
    /// Over time.
    pub rms: MicroAmps,
}

/// What is more than the common return may carry.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SumError {
    /// The current at some microsecond.
    Peak {
        /// What it would be.
        sum: MicroAmps,
        /// What it may be.
        max: MicroAmps,
    },
    /// The rms current.
    Rms {
        /// What it would be.
        sum: MicroAmps,
        /// What it may be.
        max: MicroAmps,
    },
}

impl Sums {
    /// Holds them against the wearer's limits and the size of the common return.
    ///
    /// # Errors
    /// The first limit exceeded, with the sum that would be.
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
