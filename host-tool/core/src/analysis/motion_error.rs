//! What a movement must be before it is judged.

/// Why a movement is not judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// No speed profile.
    #[error(
        "E763 a movement of {0} samples has no smoothness: give two or more, no speed below zero, \
         not all of them zero"
    )]
    Speed(usize),
    /// A filter that is longer than what it is to smooth.
    #[error(
        "E764 a movement of {samples} samples is shorter than the filter's {window}: record more \
         of it, or take a higher cutoff"
    )]
    Short {
        /// Recorded.
        samples: usize,
        /// Of the filter.
        window: usize,
    },
    /// No such filter.
    #[error("E765 no filter of order {order} ends at {cutoff_hz} Hz of {rate_hz} samples a second")]
    Filter {
        /// Of the polynomial.
        order: usize,
        /// Where half of the power is left.
        cutoff_hz: f64,
        /// Of the samples.
        rate_hz: f64,
    },
}
