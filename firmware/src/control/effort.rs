//! The effort: the output of every controller.

use crate::arithmetic::fixed_point::Q;

/// Output of a controller before any clamp: positive values flex, negative values extend.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Effort {
    /// Volts above threshold (milliamperes on a current-controlled stage).
    AboveThreshold(Q),
    /// Fraction of the range from motor threshold (0) to the wearer's maximum (±1).
    Fraction(Q),
}

impl Effort {
    /// Returns the effort in thousandths of its unit, for telemetry; saturates.
    #[must_use]
    pub fn to_milli(self) -> i32 {
        let (Self::AboveThreshold(q) | Self::Fraction(q)) = self;
        // Beyond 2^22 the thousandths do not fit anyway; 2^46 · 1000 < 2^56.
        let bits = q.to_bits().clamp(-(1 << 46), 1 << 46);
        let milli = (bits * 1000) >> Q::FRAC_NBITS;
        milli.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }
}
