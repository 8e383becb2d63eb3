//! Identity of the device on which a trial ran, as the device reported it.

use serde::{Deserialize, Serialize};

/// Content of a device's `Hello`, and whether the device is a simulator.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Identity {
    /// Kind of device: a board, or one of the simulators.
    pub kind: DeviceKind,
    /// Whether a simulated wearer was attached: the device is a simulator, or the program that
    /// serves it is this one.
    pub simulated: bool,
    /// Whether this program serves the device. The device then runs in virtual time, and a rerun
    /// gives the same result.
    pub in_process: bool,
    /// 96-bit unique number of the chip, as 24 hexadecimal digits in the order of its bytes; `None`
    /// if there is no chip.
    pub unique_id: Option<String>,
    /// Version of the firmware.
    pub firmware: String,
    /// Schema hash of the device's link, 16 hexadecimal digits.
    pub schema: String,
    /// Cause of the last reset, for example "power on".
    pub reset: String,
    /// Time for which outputs are disconnected between opposite drive, µs.
    pub dead_time_us: u16,
    /// Option bytes of the chip that differ from the settings in docs/hil.md.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub option_bytes: Vec<String>,
}

/// Kind of device, by the backend that executes its code.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// Board, to which a person may be connected.
    Board,
    /// Chip simulator, which executes the flashed image.
    Chip,
    /// Native simulator.
    Native,
    /// QEMU, which executes the device code.
    Qemu,
    /// Board with a simulated output stage, to which nobody may be connected.
    Breadboard,
}

impl DeviceKind {
    /// Returns the kind in words for people.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Board => "board",
            Self::Chip => "chip simulator",
            Self::Native => "native simulator",
            Self::Qemu => "QEMU",
            Self::Breadboard => "breadboard without output stages",
        }
    }

    /// Returns the kind in words, with the name by which the device was found, for example "board
    /// at /dev/ttyACM0". A simulator of this program has only its kind as a name.
    #[must_use]
    pub fn format_with_name(self, name: &str) -> String {
        match self.words() {
            words if words == name => words.to_owned(),
            words => format!("{words} at {name}"),
        }
    }
}
