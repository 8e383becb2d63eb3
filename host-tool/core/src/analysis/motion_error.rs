//! Requirements that a movement must meet before it is judged.

/// Reason why a movement is not judged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// The samples are not a speed profile, which needs at least two finite values that are not
    /// negative and not all zero (E763). The field is the number of samples.
    #[error(
        "E763 cannot compute the smoothness (number of speed samples: {0}): give two or more \
         finite speeds, none of them negative and not all zero"
    )]
    Speed(usize),
    /// The movement has fewer samples than the smoothing filter needs (E764).
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
    /// No window length gives a filter with the requested cutoff (E765).
    #[error(
        "E765 no smoothing filter of order {order} has a cutoff of {cutoff_hz} Hz at {rate_hz} \
         samples per second: choose another order or cutoff"
    )]
    Filter {
        /// Order of the filter's polynomials.
        order: usize,
        /// Requested frequency at which half of the power remains, Hz.
        cutoff_hz: f64,
        /// Rate at which the signal was sampled, Hz.
        rate_hz: f64,
    },
}
