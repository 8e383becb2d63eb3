//! Derives the identity of a device from its answer to `Hello`.

use super::describe_option_bytes;
use crate::link::Fit;
use crate::record::{ClockFit, DeviceKind, Identity};
use firmware::link::message::ResetCause;
use firmware::link::{HelloInfo, Kind};

/// Beginning of the chip number by which the chip simulator is recognized; docs/protocol.md
/// reserves it. The image that runs on the simulator cannot know that it is simulated, and reports
/// that it is a board.
const SIMULATED_CHIP: &[u8] = b"FLEXOR S";

/// Converts the fit of the device's clock into the form that a record contains.
pub(super) fn to_clock_fit(fit: Fit) -> ClockFit {
    ClockFit {
        exchanges: fit.exchanges,
        round_trip_us: fit.round_trip_us,
        offset_us: fit.offset_us,
        drift_ppm: fit.drift_ppm,
        residual_us: fit.residual_us,
    }
}

/// Returns the kind of device from its answer to `Hello`. The name or address of its port is not
/// considered, because it proves nothing.
#[must_use]
pub fn device_kind(info: &HelloInfo) -> DeviceKind {
    match info.kind {
        Kind::Native => DeviceKind::Native,
        Kind::Qemu => DeviceKind::Qemu,
        Kind::Board if bytes(info).starts_with(SIMULATED_CHIP) => DeviceKind::Chip,
        Kind::Board => DeviceKind::Board,
        Kind::Breadboard => DeviceKind::Breadboard,
    }
}

/// Converts a device's answer to `Hello` into the form that a record contains. `in_process` says
/// whether the device runs inside this program.
#[must_use]
pub fn identity(info: &HelloInfo, in_process: bool) -> Identity {
    let kind = device_kind(info);
    let bytes = bytes(info);
    let has_id = bytes.iter().any(|byte| *byte != 0);
    let [major, minor, patch] = info.version;
    let reset = match info.reset {
        ResetCause::PowerOn => "power on",
        ResetCause::Pin => "reset pin",
        ResetCause::BrownOut => "brown-out",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Software => "software",
    };
    Identity {
        kind,
        simulated: in_process || kind != DeviceKind::Board,
        in_process,
        board: info.board.as_str().to_owned(),
        unique_id: has_id.then(|| bytes.iter().map(|byte| format!("{byte:02x}")).collect()),
        firmware: format!("{major}.{minor}.{patch}"),
        schema: format!("{:016x}", info.schema),
        reset: reset.to_owned(),
        dead_time_us: info.dead_time_us,
        option_bytes: info.option_bytes.map_or_else(Vec::new, |option_bytes| {
            describe_option_bytes(&option_bytes)
        }),
    }
}

/// Returns the unique number of the chip as bytes, in the order in which they lie in its memory.
fn bytes(info: &HelloInfo) -> Vec<u8> {
    let words = info.unique_id.into_iter();
    words.flat_map(u32::to_le_bytes).collect()
}
