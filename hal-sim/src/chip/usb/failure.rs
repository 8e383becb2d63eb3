//! What a host gives up on.

/// Why the host talks to the device no more. A real one would try again or
/// ask the user to; here it is a finding about the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// Three transactions in a row without an answer (USB 2.0 8.6).
    #[error("the device does not answer: {0}")]
    NoAnswer(&'static str),
    /// A request that every device has to serve, or a data endpoint, stalled.
    #[error("the device answers STALL: {0}")]
    Stalled(&'static str),
    /// More data than asked for, or than a packet of the endpoint may have.
    #[error("the device babbles: {0}")]
    Babble(&'static str),
    /// Not finished within 5 s (USB 2.0 9.2.6.1).
    #[error("the device takes more than 5 s: {0}")]
    Slow(&'static str),
    /// A descriptor that breaks chapter 9 or is no CDC ACM device's.
    #[error("bad descriptor: {0}")]
    Descriptor(&'static str),
}
