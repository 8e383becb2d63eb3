//! What is wrong with measurements of a muscle.

/// Why force cannot be made numbers of; each says where, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// The sensor is at its end.
    #[error(
        "E640 the sensor saturates: it reads {reading_n:.3} N without any change for {samples} \
         samples from {at_s:.3} s on; use a shorter lever, a larger range, or less current"
    )]
    Saturated {
        /// Where it stays, N.
        reading_n: f64,
        /// How long, samples of 1 ms.
        samples: usize,
        /// From when on, s from the record's start.
        at_s: f64,
    },
    /// Force of the wrong sign.
    #[error(
        "E641 the sensor is upside down: stimulation moves its reading by {moved_n:.3} N, and \
         force counts up; turn it, or change the sign of its signal"
    )]
    UpsideDown {
        /// Mean during the train less before, N.
        moved_n: f64,
    },
    /// Amplitudes that do not rise.
    #[error(
        "E642 thresholds are out of order: {lower} is {low} mA and {upper} is {high} mA; \
         {upper} must be above {lower}: search again"
    )]
    OutOfOrder {
        /// What must be lower.
        lower: &'static str,
        /// Its amplitude, mA.
        low: f64,
        /// What must be higher.
        upper: &'static str,
        /// Its amplitude, mA.
        high: f64,
    },
    /// Too little of a record.
    #[error(
        "E643 the record cannot tell: {what}; it needs 0.1 s of rest, pulses, and 0.5 s after \
         the last one"
    )]
    TooShort {
        /// What it lacks.
        what: String,
    },
    /// No numbers come out.
    #[error(
        "E644 the model cannot be fitted from any of {starts} starts ({why}): look at the record \
         for what is no muscle's force"
    )]
    NoFit {
        /// How many were tried.
        starts: usize,
        /// Of the last.
        why: String,
    },
    /// A search came to its end.
    #[error(
        "E645 no motor threshold up to {most_ma} mA: check electrodes, lead and place, or allow \
         more current"
    )]
    NoThreshold {
        /// The largest amplitude tried, mA.
        most_ma: f64,
    },
}
