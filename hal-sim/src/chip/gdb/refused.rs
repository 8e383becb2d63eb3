//! Defines the reasons why a packet is refused.

/// Reason why a packet was refused. The answer gives the reason in words if the client understands
/// them, otherwise as an error number of Unix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GdbRefusal {
    /// The packet is malformed.
    Malformed,
    /// The packet is longer than qSupported allows.
    TooLong,
    /// The address does not exist or does not support the operation.
    Address(&'static str),
    /// All breakpoints or comparators are in use.
    Full(&'static str),
}

impl GdbRefusal {
    /// Returns the contents of the answer packet: `E.` and the reason in words, or `E` and the
    /// error number.
    pub fn answer(self, in_words: bool) -> String {
        let (number, words) = match self {
            Self::Malformed => (22, "the packet is not valid"),
            Self::TooLong => (7, "the packet is longer than PacketSize"),
            Self::Address(what) => (14, what),
            Self::Full(what) => (28, what),
        };
        match in_words {
            true => format!("E.{words}"),
            false => format!("E{number:02x}"),
        }
    }
}
