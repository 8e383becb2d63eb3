//! Fields that a joint shares with a wall or a force: the behaviour between setpoints, and where an
//! angle is measured.

use firmware::control::{HoldPolicy, SensorSource};

use super::control_fields::STALE_AFTER_MS;
use crate::fields::table::Table;

/// Reads the field `hold`: whether the device extrapolates the reference between setpoints and
/// after the last one, or holds it.
pub(super) fn read_hold(t: &Table<'_>) -> HoldPolicy {
    match t.word("hold") {
        "hold" => HoldPolicy::Hold,
        _ => HoldPolicy::Extrapolate {
            max_ms: t.integer("max_extrapolation_ms"),
        },
    }
}

/// Reads the source of the measured angle: the host, or the board's analog-to-digital converter
/// with its codes at 0° and at 100°.
pub(super) fn read_sensor(t: &Table<'_>) -> SensorSource {
    match t.word("sensor") {
        "host" => SensorSource::Host,
        _ => SensorSource::Adc {
            code_at_0: t.integer("code_at_0_deg"),
            code_at_100: t.integer("code_at_100_deg"),
        },
    }
}

/// Reads the age from which a measured angle is stale, ms. The default depends on whether `sensor`
/// is the host or the board's converter.
pub(super) fn read_stale(t: &Table<'_>, sensor: SensorSource) -> u16 {
    let (adc, host) = STALE_AFTER_MS;
    t.integer_or(
        "stale_after_ms",
        if sensor == SensorSource::Host {
            host
        } else {
            adc
        },
    )
}
