//! Causes of a reset.

/// Cause of a chip reset (RCC_CSR, section 7.3.21).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Power-on; also sets the flags of brown-out and pin.
    PowerOn,
    /// The supply was below the brown-out level but above the power-down level.
    BrownOut,
    /// The NRST pin.
    Pin,
    /// A software reset: SYSRESETREQ of the core.
    Software,
    /// The independent watchdog.
    Watchdog,
}

impl Cause {
    /// Returns the flags of RCC_CSR: every internal reset also pulls the pin (section 7.1.1).
    pub(super) const fn flags(self) -> u32 {
        let pin = 1 << 26;
        match self {
            Self::PowerOn => pin | 1 << 27 | 1 << 25,
            Self::BrownOut => pin | 1 << 25,
            Self::Pin => pin,
            Self::Software => pin | 1 << 28,
            Self::Watchdog => pin | 1 << 29,
        }
    }
}
