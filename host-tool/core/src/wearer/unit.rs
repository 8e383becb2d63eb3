//! What a stage's amplitudes are.

/// What a channel's amplitudes are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unit {
    /// Milliamperes, on a current-controlled stage.
    Milliampere,
    /// Volts, on a voltage-controlled stage.
    Volt,
}

impl Unit {
    /// "mA" or "V".
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Milliampere => "mA",
            Self::Volt => "V",
        }
    }
}
