//! Fields that a joint shares with a wall or a force: the behaviour between setpoints, and where an
//! angle is measured.

use firmware::control::{HoldPolicy, SensorSource};

use super::control_fields::STALE_AFTER_MS;
use crate::fields::table::Table;

/// Reads how the device continues between and after setpoints.
pub(super) fn read_hold(t: &Table<'_>) -> HoldPolicy {
    match t.word("hold") {
        "hold" => HoldPolicy::Hold,
        _ => HoldPolicy::Extrapolate {
            max_ms: t.integer("max_extrapolation_ms"),
        },
    }
}

/// Reads where an angle is measured; codes are those of the converter at 0° and 100°.
pub(super) fn read_sensor(t: &Table<'_>) -> SensorSource {
    match t.word("sensor") {
        "host" => SensorSource::Host,
        _ => SensorSource::Adc {
            code_at_0: t.integer("code_at_0_deg"),
            code_at_100: t.integer("code_at_100_deg"),
        },
    }
}

/// Reads the age at which a measurement is stale, ms; the default depends on `sensor`.
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
