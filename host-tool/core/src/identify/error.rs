//! Errors in measurements of a muscle.

/// Reason why a muscle's constants cannot be identified from force. Each message says where the
/// mistake is and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The force sensor is at the end of its range (E640).
    #[error(
        "E640 the force sensor saturates: it reads {reading_n:.3} N without change for {samples} \
         samples from {at_s:.3} s on; use a shorter lever, a larger range, or less current"
    )]
    Saturated {
        /// Reading at which the sensor is stuck, N.
        reading_n: f64,
        /// Number of consecutive samples (1 ms each) with this reading.
        samples: usize,
        /// Time at which the constant reading begins, s from the start of the record.
        at_s: f64,
    },
    /// The measured force has the wrong sign (E641).
    #[error(
        "E641 the force sensor has the wrong sign: stimulation changes its reading by \
         {moved_n:.3} N, but force must increase it; turn the sensor, or change the sign of its \
         signal"
    )]
    UpsideDown {
        /// Change of the mean reading by stimulation, N: mean during the train minus mean before
        /// it.
        moved_n: f64,
    },
    /// Thresholds that must rise from one to the next do not (E642).
    #[error(
        "E642 the thresholds contradict each other: {lower} is {low} mA and {upper} is {high} mA; \
         {upper} must be above {lower}: search again"
    )]
    OutOfOrder {
        /// Name of the threshold that must be lower.
        lower: &'static str,
        /// Amplitude of the threshold that must be lower, mA.
        low: f64,
        /// Name of the threshold that must be higher.
        upper: &'static str,
        /// Amplitude of the threshold that must be higher, mA.
        high: f64,
    },
    /// The record is too short or incomplete (E643).
    #[error(
        "E643 the record is not sufficient: {what}; it needs 0.1 s of rest, pulses, and 0.5 s \
         after the last pulse"
    )]
    TooShort {
        /// Description of the missing part.
        what: String,
    },
    /// The fit did not converge from any set of start values (E644).
    #[error(
        "E644 the fit of the model fails from all {starts} starts ({why}): check the record for \
         signals other than the force of the muscle"
    )]
    NoFit {
        /// Number of sets of start values that were tried.
        starts: usize,
        /// Reason why the fit from the last start values failed.
        why: String,
    },
    /// The search reached its largest amplitude without finding a motor threshold (E645).
    #[error(
        "E645 no motor threshold up to {most_ma} mA: check the electrodes, their leads and \
         positions, or allow more current"
    )]
    NoThreshold {
        /// Largest amplitude that was tried, mA.
        most_ma: f64,
    },
}
