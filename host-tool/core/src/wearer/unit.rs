//! Units of an output stage's amplitudes.

/// Unit of a channel's amplitudes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unit {
    /// Milliamperes, for a current-controlled stage.
    Milliampere,
    /// Volts, for a voltage-controlled stage.
    Volt,
}

impl Unit {
    /// Returns the symbol of the unit: "mA" or "V".
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Milliampere => "mA",
            Self::Volt => "V",
        }
    }
}
