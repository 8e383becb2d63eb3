//! Requirements that a movement must meet before it is judged.

/// Reason why a movement is not judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// The samples are not a speed profile; their number is given (E763).
    #[error(
        "E763 a movement of {0} samples has no smoothness: give two or more, no speed below zero, \
         not all of them zero"
    )]
    Speed(usize),
    /// The movement is shorter than the filter that is to smooth it (E764).
    #[error(
        "E764 a movement of {samples} samples is shorter than the filter's {window}: record more \
         of it, or take a higher cutoff"
    )]
    Short {
        /// Number of samples recorded.
        samples: usize,
        /// Number of samples in the filter's window.
        window: usize,
    },
    /// No filter has the requested cutoff (E765).
    #[error("E765 no filter of order {order} ends at {cutoff_hz} Hz of {rate_hz} samples a second")]
    Filter {
        /// Order of the polynomial.
        order: usize,
        /// Cutoff, at which half of the power remains, Hz.
        cutoff_hz: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
    },
}
