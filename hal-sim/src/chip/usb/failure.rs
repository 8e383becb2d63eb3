//! Lists the failures after which the host gives up.

/// Reason why the host stopped talking to the device. A real host would retry or ask the user to;
/// here, each failure is a finding about the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// The device did not answer three transactions in a row (USB 2.0 8.6).
    #[error("the device did not answer: {0}")]
    NoAnswer(&'static str),
    /// The device answered STALL to a request that every device must serve, or on a data endpoint.
    #[error("the device answered with STALL: {0}")]
    Stalled(&'static str),
    /// The device sent more data than the host requested, or than fit a packet of the endpoint.
    #[error("the device sent more data than allowed (babble): {0}")]
    Babble(&'static str),
    /// The device did not finish a request within 5 s (USB 2.0 9.2.6.1).
    #[error("the device needed more than 5 s: {0}")]
    Slow(&'static str),
    /// A descriptor violates chapter 9 of USB 2.0, or is not that of a CDC ACM device.
    #[error("invalid USB descriptor: {0}")]
    Descriptor(&'static str),
}
