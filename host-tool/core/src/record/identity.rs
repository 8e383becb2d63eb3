//! Identity of the device on which a trial ran, as the device reported it.

use serde::{Deserialize, Serialize};

/// What a device reported about itself in its answer to `Hello`, and whether it is a simulator.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Identity {
    /// Kind of device: a board, or one of the simulators.
    pub kind: DeviceKind,
    /// Whether a simulated wearer was attached instead of a person. True for every device except a
    /// board with real output stages, and for every device inside this program.
    pub simulated: bool,
    /// Whether the device ran inside this program. It then runs in virtual time, so that a rerun
    /// gives the same result.
    pub in_process: bool,
    /// Name of the board whose pins the image drives; empty without a chip.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub board: String,
    /// Unique number of the chip, 96 bits, as 24 hexadecimal digits in the order of its bytes in
    /// memory; `None` if the device has no chip.
    pub unique_id: Option<String>,
    /// Version of the firmware.
    pub firmware: String,
    /// Hash of the protocol's schema that the device uses, 16 hexadecimal digits. It must equal
    /// that of the host.
    pub schema: String,
    /// Cause of the device's latest reset, for example "power on".
    pub reset: String,
    /// Time for which an output is disconnected between drive in one direction and drive in the
    /// other, µs.
    pub dead_time_us: u16,
    /// Option bytes of the chip that differ from the settings in docs/evidence/hil.md, one description each.
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
    /// Native backend: the device code compiled for this computer.
    Native,
    /// QEMU, which executes the device code compiled for its processor.
    Qemu,
    /// Board whose output stages are simulated and to which no person may be connected; or the chip
    /// simulator of such a board.
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
            Self::Breadboard => "breadboard: LEDs and analyser only, no output stage",
        }
    }

    /// Returns the kind in words with the name by which the device was opened, for example "board
    /// at /dev/ttyACM0". For a simulator of this program, returns only the kind.
    #[must_use]
    pub fn format_with_name(self, name: &str) -> String {
        match self.words() {
            words if words == name => words.to_owned(),
            words if self == Self::Breadboard => format!("{words}, at {name}"),
            words => format!("{words} at {name}"),
        }
    }
}
