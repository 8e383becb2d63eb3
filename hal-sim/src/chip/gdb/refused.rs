//! Why a packet was not obeyed.

/// What a client is told instead of what it wanted: words where it reads them, else a number,
/// that of the system's error of this kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GdbRefusal {
    /// It cannot be understood.
    Malformed,
    /// It is longer than qSupported allows.
    TooLong,
    /// Nothing is there, or nothing that could do this.
    Address(&'static str),
    /// All are taken.
    Full(&'static str),
}

impl GdbRefusal {
    /// The packet that says so.
    pub fn answer(self, in_words: bool) -> String {
        let (number, words) = match self {
            Self::Malformed => (22, "the packet cannot be understood"),
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
