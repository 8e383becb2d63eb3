//! Requirements that a movement must meet before it is judged.

/// Reason why a movement is not judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// The samples are not a speed profile; their number is given (E763).
    #[error(
        "E763 cannot compute the smoothness (number of speed samples: {0}): give two or more \
         finite speeds, none of them negative and not all zero"
    )]
    Speed(usize),
    /// The movement is shorter than the filter that is to smooth it (E764).
    #[error(
        "E764 the movement has {samples} samples, fewer than the {window} of the filter's window: \
         record more of it, or choose a higher cutoff"
    )]
    Short {
        /// Number of samples recorded.
        samples: usize,
        /// Number of samples in the filter's window.
        window: usize,
    },
    /// No filter has the requested cutoff (E765).
    #[error(
        "E765 no smoothing filter of order {order} has a cutoff of {cutoff_hz} Hz at {rate_hz} \
         samples per second: choose another order or cutoff"
    )]
    Filter {
        /// Order of the polynomial.
        order: usize,
        /// Cutoff, at which half of the power remains, Hz.
        cutoff_hz: f64,
        /// Sample rate, Hz.
        rate_hz: f64,
    },
}
