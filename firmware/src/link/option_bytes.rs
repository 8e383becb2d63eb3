//! Option bytes of the chip, as hosts see them.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Option bytes of the chip, which determine its behaviour before any program runs (RM0090 section
/// 3.7). They are set once with a probe.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct OptionBytes {
    /// Level below which the chip is in reset, 1–3; 0 is off. Level 3 is about 2.8 V.
    pub brown_out_level: u8,
    /// Whether the watchdog starts with the reset, before the firmware does.
    pub hardware_watchdog: bool,
    /// Level of read protection, 0–2; level 2 cannot be undone.
    pub read_protection: u8,
}

impl OptionBytes {
    /// Required option bytes, as docs/evidence/hil.md sets them.
    pub const WANTED: Self = Self {
        brown_out_level: 3,
        hardware_watchdog: false,
        read_protection: 0,
    };

    /// Decodes the register FLASH_OPTCR (RM0090 3.9.7, 3.7.1).
    #[must_use]
    pub const fn from_optcr(optcr: u32) -> Self {
        Self {
            // BOR_LEV: 00 is level 3, 11 is off.
            brown_out_level: !(optcr >> 2) as u8 & 0b11,
            hardware_watchdog: optcr & 1 << 5 == 0, // WDG_SW
            read_protection: match (optcr >> 8) as u8 {
                0xAA => 0,
                0xCC => 2,
                _ => 1,
            },
        }
    }
}
