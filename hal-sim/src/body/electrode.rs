//! Electrodes of a channel and the skin between them, as the output stage sees them.
//!
//! The load is purely resistive: a reading in the middle of a phase shows the resistance, and no
//! charge remains. Amplitudes are magnitudes; the trace records the polarity.

/// Load with which volts are converted to milliamperes, Ω: the value that a voltage stage reports
/// to the safety limits (design.md, Pulses).
pub const NOMINAL_LOAD_OHM: f64 = 2000.0;

/// Current limit of the voltage-controlled stage, mA (Hamana 2022 §II-A).
pub const VOLTAGE_STAGE_LIMIT_MA: f64 = 20.0;

/// Largest voltage that a current-controlled stage can put across its load, V. Assumed: enough for
/// the 100 mA hard limit into 1 kΩ.
pub const CURRENT_STAGE_COMPLIANCE_V: f64 = 120.0;

/// Quantity that an output stage controls during a phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// A voltage-controlled stage at this many volts (magnitude).
    Volts(f64),
    /// A current-controlled stage at this many milliamperes (magnitude).
    Milliamps(f64),
}

/// State in which an output stage puts the lead of its electrode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lead {
    /// The stage drives the lead below the common return.
    Cathodic(Drive),
    /// The stage drives the lead above the common return.
    Anodic(Drive),
    /// The stage connects the lead to the common return.
    Grounded,
    /// The stage disconnects the lead (high impedance).
    Floating,
}

/// Measurement of a stage in the middle of a phase: the quantity that the stage does not control.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// Voltage across the load, read by a current-controlled stage.
    Volts(f64),
    /// Current through the load, read by a voltage-controlled stage.
    Milliamps(f64),
}

/// Electrical load of one channel's electrodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Load {
    /// Electrodes on the skin: a resistance in ohms, above zero.
    Ohms(f64),
    /// No contact: the electrode is off, the lead broken, or nothing connected.
    Open,
}

impl Load {
    /// A resistance of [`NOMINAL_LOAD_OHM`].
    pub const NOMINAL: Self = Self::Ohms(NOMINAL_LOAD_OHM);

    /// Returns the current that flows, mA, within the current limit or the compliance of the stage;
    /// 0 with an open load.
    pub fn current_ma(self, drive: Drive) -> f64 {
        let Self::Ohms(ohm) = self else { return 0.0 };
        match drive {
            Drive::Volts(v) => (1e3 * v.abs() / ohm).min(VOLTAGE_STAGE_LIMIT_MA),
            Drive::Milliamps(ma) => ma.abs().min(1e3 * CURRENT_STAGE_COMPLIANCE_V / ohm),
        }
    }

    /// Returns the charge of one phase of `width_us`, µC.
    pub fn charge_uc(self, drive: Drive, width_us: u32) -> f64 {
        self.current_ma(drive) * f64::from(width_us) * 1e-3
    }

    /// Returns the measurement of the stage in mid-phase. With an open load, a voltage stage
    /// measures 0 mA, and a current stage that drives any current measures its full compliance.
    pub fn mid_phase(self, drive: Drive) -> Reading {
        match (drive, self) {
            (Drive::Volts(_), _) => Reading::Milliamps(self.current_ma(drive)),
            (Drive::Milliamps(_), Self::Ohms(ohm)) => {
                Reading::Volts(1e-3 * self.current_ma(drive) * ohm)
            }
            (Drive::Milliamps(ma), Self::Open) => Reading::Volts(if ma == 0.0 {
                0.0
            } else {
                CURRENT_STAGE_COMPLIANCE_V
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_load_takes_fourteen_milliamps_at_28_volts() {
        let drive = Drive::Volts(28.0);
        assert_eq!(Load::NOMINAL.current_ma(drive), 14.0);
        assert_eq!(Load::NOMINAL.mid_phase(drive), Reading::Milliamps(14.0));
        assert!((Load::NOMINAL.charge_uc(drive, 200) - 2.8).abs() < 1e-12);
    }

    #[test]
    fn stages_limit() {
        assert_eq!(Load::Ohms(500.0).current_ma(Drive::Volts(40.0)), 20.0);
        assert_eq!(Load::Ohms(5000.0).current_ma(Drive::Milliamps(50.0)), 24.0);
        assert_eq!(
            Load::Ohms(1000.0).mid_phase(Drive::Milliamps(30.0)),
            Reading::Volts(30.0)
        );
    }

    #[test]
    fn an_electrode_off_passes_nothing_and_shows_it() {
        for drive in [Drive::Volts(30.0), Drive::Milliamps(10.0)] {
            assert_eq!(Load::Open.current_ma(drive), 0.0);
            assert_eq!(Load::Open.charge_uc(drive, 500), 0.0);
        }
        assert_eq!(
            Load::Open.mid_phase(Drive::Volts(30.0)),
            Reading::Milliamps(0.0)
        );
        assert_eq!(
            Load::Open.mid_phase(Drive::Milliamps(1.0)),
            Reading::Volts(CURRENT_STAGE_COMPLIANCE_V)
        );
    }
}
