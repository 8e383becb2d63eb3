//! Which device a trial ran on, as it told itself.

use serde::{Deserialize, Serialize};

/// What a device said in its `Hello`, and whether it is a simulator.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Identity {
    /// What it is.
    pub kind: DeviceKind,
    /// Whether a simulated wearer stood behind it: it is a simulator, or its
    /// serving side is part of this program.
    pub simulated: bool,
    /// Whether that serving side is part of this program: then it runs in
    /// virtual time, and again the same.
    pub in_process: bool,
    /// The chip's 96-bit number, 24 hexadecimal digits in the order of its bytes;
    /// `None` where there is no chip.
    pub unique_id: Option<String>,
    /// Firmware version.
    pub firmware: String,
    /// The schema hash of its link, 16 hexadecimal digits.
    pub schema: String,
    /// Why it last reset: "power on".
    pub reset: String,
    /// Isolation between opposite drive, µs.
    pub dead_time_us: u16,
    /// The chip's option bytes that are not as docs/hil.md sets them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub option_bytes: Vec<String>,
}

/// The kinds of device.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// A board: a person may be connected.
    Board,
    /// The flashed image on the chip simulator.
    Chip,
    /// The native simulator.
    Native,
    /// The device code under QEMU.
    Qemu,
}

impl DeviceKind {
    /// For people.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Chip => "chip simulator",
            Self::Native => "native simulator",
            Self::Qemu => "QEMU",
        }
    }

    /// For people, with the name it was found by: "board at /dev/ttyACM0". A
    /// simulator of this program has no other name than its kind.
    #[must_use]
    pub fn at(self, name: &str) -> String {
        match self.words() {
            words if words == name => words.to_owned(),
            words => format!("{words} at {name}"),
        }
    }
}
