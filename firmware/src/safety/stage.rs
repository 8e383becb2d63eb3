//! Output stages: the current- or voltage-controlled circuits that drive the channels.

use super::limits;
use crate::range::{OutOfRange, Range};
use crate::units::{Amplitude, DacCode, MicroAmps, MilliVolts};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An output stage as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Serialize, Deserialize, Schema)]
pub enum StageSpec {
    /// Current-controlled stage. Amplitudes are µA; DAC code 65 535 gives `full_scale_ua`.
    Current {
        /// Current at DAC code 65 535, 1000–100 000 µA.
        full_scale_ua: u32,
    },
    /// Voltage-controlled stage. Amplitudes are mV; DAC code 65 535 gives `full_scale_mv`.
    /// Voltages are converted with the configured load and then compared with the current limits.
    Voltage {
        /// Voltage at DAC code 65 535, 1000–150 000 mV.
        full_scale_mv: u32,
        /// Assumed load of the electrodes, 200–100 000 Ω; 2000 Ω is usual.
        load_ohm: u32,
    },
}

/// An output stage after [`StageSpec::validate`] has checked its ranges.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Stage(StageSpec);

impl StageSpec {
    /// Range of [`Self::Current::full_scale_ua`].
    pub const FULL_SCALE_UA: Range = Range::new("full_scale_ua", 1_000, 100_000);
    /// Range of [`Self::Voltage::full_scale_mv`].
    pub const FULL_SCALE_MV: Range = Range::new("full_scale_mv", 1_000, 150_000);
    /// Range of [`Self::Voltage::load_ohm`].
    pub const LOAD_OHM: Range = Range::new("load_ohm", 200, 100_000);

    /// Checks that every field is within its range.
    ///
    /// # Errors
    /// Returns the first field outside its range, and the range.
    pub fn validate(&self) -> Result<Stage, OutOfRange> {
        match *self {
            Self::Current { full_scale_ua } => Self::FULL_SCALE_UA.check(full_scale_ua)?,
            Self::Voltage {
                full_scale_mv,
                load_ohm,
            } => {
                Self::FULL_SCALE_MV.check(full_scale_mv)?;
                Self::LOAD_OHM.check(load_ohm)?;
            }
        }
        Ok(Stage(*self))
    }

    /// Returns the amplitude at DAC code 65 535, in µA or mV.
    #[must_use]
    pub const fn full_scale(&self) -> Amplitude {
        match *self {
            Self::Current { full_scale_ua } => Amplitude::new(full_scale_ua),
            Self::Voltage { full_scale_mv, .. } => Amplitude::new(full_scale_mv),
        }
    }
}

impl Stage {
    /// Returns whether amplitudes are currents, in µA, and not voltages.
    #[must_use]
    pub const fn is_current(&self) -> bool {
        matches!(self.0, StageSpec::Current { .. })
    }

    /// Returns the configuration that was checked.
    #[must_use]
    pub const fn spec(&self) -> StageSpec {
        self.0
    }

    /// Returns the amplitude at DAC code 65 535, in µA or mV.
    #[must_use]
    pub const fn full_scale(&self) -> Amplitude {
        self.0.full_scale()
    }

    /// Returns the configuration of a voltage stage with the load `ohm`, if that is below its own
    /// load; `None` otherwise and for a current stage.
    #[must_use]
    pub const fn with_load(&self, ohm: u32) -> Option<StageSpec> {
        match self.0 {
            StageSpec::Voltage {
                full_scale_mv,
                load_ohm,
            } if ohm < load_ohm => Some(StageSpec::Voltage {
                full_scale_mv,
                load_ohm: ohm,
            }),
            _ => None,
        }
    }

    /// Returns the current limit of this kind of stage.
    #[must_use]
    pub const fn max_current(&self) -> MicroAmps {
        match self.0 {
            StageSpec::Current { .. } => limits::MAX_CURRENT,
            StageSpec::Voltage { .. } => limits::VOLTAGE_STAGE_LIMITER,
        }
    }

    /// Returns the current at `amplitude`, rounded up, because limits are checked with it.
    #[must_use]
    pub fn current(&self, amplitude: Amplitude) -> MicroAmps {
        match self.0 {
            StageSpec::Current { .. } => MicroAmps::new(amplitude.get()),
            StageSpec::Voltage { load_ohm, .. } => {
                MilliVolts::new(amplitude.get()).current_through(load_ohm)
            }
        }
    }

    /// Returns the amplitude that drives `current`, rounded down, saturating.
    #[must_use]
    pub fn amplitude_for_current(&self, current: MicroAmps) -> Amplitude {
        match self.0 {
            StageSpec::Current { .. } => Amplitude::new(current.get()),
            StageSpec::Voltage { load_ohm, .. } => {
                let mv = u64::from(current.get()) * u64::from(load_ohm) / 1000;
                Amplitude::new(u32::try_from(mv).unwrap_or(u32::MAX))
            }
        }
    }

    /// Returns the DAC code for `amplitude`, rounded down, saturating at full scale.
    #[must_use]
    pub fn code(&self, amplitude: Amplitude) -> DacCode {
        // 65 535 = 255 · 257: computed in two steps that fit 32 bits, at most 150 000 · 257 each,
        // because the core has no 64-bit division. full_scale >= 1000.
        let full = self.full_scale().get();
        let amplitude = amplitude.get().min(full) * 255;
        let (quotient, rest) = (amplitude / full, amplitude % full);
        DacCode::new((quotient * 257 + rest * 257 / full) as u16)
    }

    /// Returns the largest allowed product of DAC code and width (codes × µs) for a phase that may
    /// have a charge of `max_nc`; saturating.
    #[must_use]
    pub fn code_us(&self, max_nc: u32) -> u32 {
        // nC = mA·µs = 1000 µA·µs; through a load Ω·nC = 1000 mV·µs. At most 4e9 · 65 535.
        let thousandths_us = match self.0 {
            StageSpec::Current { .. } => u64::from(max_nc) * 1000,
            StageSpec::Voltage { load_ohm, .. } => u64::from(max_nc) * u64::from(load_ohm),
        };
        let code_us = thousandths_us * 65_535 / u64::from(self.full_scale().get().max(1));
        u32::try_from(code_us).unwrap_or(u32::MAX)
    }

    /// Returns the amplitude that `code` gives, in thousandths, rounded down.
    #[must_use]
    pub fn amplitude(&self, code: DacCode) -> Amplitude {
        // At most 65 535 · 150 000 / 65 535.
        Amplitude::new((u64::from(code.get()) * u64::from(self.full_scale().get()) / 65_535) as u32)
    }

    /// Returns the current that the reference stage drives through `ohm` at `code`, rounded down:
    /// a current stage reaches up to 120 V, a voltage stage its current limiter. For simulated
    /// boards.
    #[must_use]
    pub fn current_through(&self, code: DacCode, ohm: u32) -> MicroAmps {
        let set = u64::from(self.amplitude(code).get());
        let ohm = u64::from(ohm.max(1));
        let ua = match self.0 {
            StageSpec::Current { .. } => set.min(120_000_000 / ohm),
            // mV · 1000 / Ω = µA.
            StageSpec::Voltage { .. } => (set * 1000 / ohm).min(self.max_current().get().into()),
        };
        MicroAmps::new(ua as u32) // at most 150 000
    }

    /// Returns the smallest and the largest plausible current at `amplitude`. Below, the electrode
    /// is off; above, it is shorted. A current stage must reach half of the set current; a voltage
    /// stage must see 100 Ω to 20 kΩ.
    #[must_use]
    pub fn plausible_current(&self, amplitude: Amplitude) -> (MicroAmps, MicroAmps) {
        let set = amplitude.get();
        let (low, high) = match self.0 {
            StageSpec::Current { .. } => (set / 2, set.saturating_mul(3) / 2),
            StageSpec::Voltage { .. } => (set / 20, set.saturating_mul(10)),
        };
        (MicroAmps::new(low), MicroAmps::new(high))
    }

    /// Returns the largest amplitude of the electrode check, below the motor threshold: 1 mA or 2
    /// V.
    #[must_use]
    pub const fn check_amplitude(&self) -> Amplitude {
        match self.0 {
            StageSpec::Current { .. } => Amplitude::new(1_000),
            StageSpec::Voltage { .. } => Amplitude::new(2_000),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests every amplitude up to full scale and some beyond it, and every code.
    #[test]
    fn no_amplitude_becomes_a_code_above_it() {
        let current = [1_000, 37_777, 99_991, 100_000]
            .map(|full_scale_ua| StageSpec::Current { full_scale_ua });
        let load_ohm = 2_000;
        let voltage =
            [1_000, 24_000, 60_001, 149_999, 150_000].map(|full_scale_mv| StageSpec::Voltage {
                full_scale_mv,
                load_ohm,
            });
        for spec in current.into_iter().chain(voltage) {
            let stage = spec.validate().unwrap();
            let full = stage.full_scale().get();
            for asked in 0..=full {
                let exact = u64::from(asked) * 65_535 / u64::from(full);
                let code = stage.code(Amplitude::new(asked));
                assert_eq!(u64::from(code.get()), exact, "{spec:?}: {asked}");
                assert!(stage.amplitude(code).get() <= asked, "{spec:?}: {asked}");
            }
            for beyond in [full + 1, 2 * full, u32::MAX] {
                let code = stage.code(Amplitude::new(beyond));
                assert_eq!(code, DacCode::new(65_535), "{spec:?}: {beyond}");
            }
            for code in 0..=u16::MAX {
                let code = DacCode::new(code);
                assert!(
                    stage.code(stage.amplitude(code)) <= code,
                    "{spec:?}: {code:?}"
                );
            }
        }
    }
}
