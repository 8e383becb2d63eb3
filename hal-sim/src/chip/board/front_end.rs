//! Models the analogue part of the reference board: output stages that drive loads, and the current
//! sense (docs/reference/hardware.md).

use crate::body::Drive;

/// Compliance voltage of a current stage, V.
const COMPLIANCE_V: f64 = 120.0;
/// Current limit of a voltage stage, mA (Hamana 2022, II-A).
const LIMITER_MA: f64 = 20.0;
/// Current at which the current sense reads 4095, mA.
const SENSE_MA: f64 = 120.0;

/// Returns the current that a stage with this full scale drives at DAC code `code` through a load
/// of `ohm` Ω, mA. A load of `u32::MAX` means that the electrode is off: no current flows.
pub fn current_ma(full_scale: Drive, code: u16, ohm: u32) -> f64 {
    if ohm == u32::MAX {
        return 0.0;
    }
    let part = f64::from(code) / 65_535.0;
    let load = f64::from(ohm.max(1));
    match full_scale {
        Drive::Milliamps(ma) => (ma * part).min(COMPLIANCE_V / load * 1e3),
        Drive::Volts(v) => (v * part / load * 1e3).min(LIMITER_MA),
    }
}

/// Returns the 12-bit ADC code of the current sense at `ma`.
pub fn sense(ma: f64) -> u16 {
    (ma.abs() / SENSE_MA * 4095.0).clamp(0.0, 4095.0) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_limit_as_the_hardware_page_says() {
        let current = Drive::Milliamps(100.0);
        assert_eq!(current_ma(current, 65_535, 1_000), 100.0);
        assert_eq!(current_ma(current, 65_535, 2_400), 50.0, "120 V");
        assert_eq!(current_ma(current, 65_535, u32::MAX), 0.0);
        let voltage = Drive::Volts(60.0);
        assert_eq!(current_ma(voltage, 65_535, 6_000), 10.0);
        assert_eq!(current_ma(voltage, 65_535, 0), 20.0, "the limiter");
        assert_eq!(sense(120.0), 4095);
        assert_eq!(sense(500.0), 4095);
    }
}
