//! What drives a channel: a current- or a voltage-controlled output stage.

use super::limits;
use crate::range::{OutOfRange, Range};
use crate::units::{Amplitude, DacCode};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An output stage as a host declares it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StageSpec {
    /// Amplitudes are µA; DAC code 65 535 gives `full_scale_ua`.
    Current {
        /// 1000–100 000 µA.
        full_scale_ua: u32,
    },
    /// Amplitudes are mV; DAC code 65 535 gives `full_scale_mv`. Volts are
    /// judged against current limits through the declared load.
    Voltage {
        /// 1000–150 000 mV.
        full_scale_mv: u32,
        /// 200–100 000 Ω; 2000 is usual.
        load_ohm: u32,
    },
}

/// A checked stage.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stage(StageSpec);

impl StageSpec {
    /// Of [`Self::Current::full_scale_ua`].
    pub const FULL_SCALE_UA: Range = Range::new("full_scale_ua", 1_000, 100_000);
    /// Of [`Self::Voltage::full_scale_mv`].
    pub const FULL_SCALE_MV: Range = Range::new("full_scale_mv", 1_000, 150_000);
    /// Of [`Self::Voltage::load_ohm`].
    pub const LOAD_OHM: Range = Range::new("load_ohm", 200, 100_000);

    /// Checks the ranges.
    ///
    /// # Errors
    /// The field and what it may be.
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

    /// Full scale in the stage's own thousandths.
    #[must_use]
    pub const fn full_scale(&self) -> Amplitude {
        match *self {
            Self::Current { full_scale_ua } => Amplitude(full_scale_ua),
            Self::Voltage { full_scale_mv, .. } => Amplitude(full_scale_mv),
        }
    }
}

impl Stage {
    /// Whether amplitudes are currents.
    #[must_use]
    pub const fn is_current(&self) -> bool {
        matches!(self.0, StageSpec::Current { .. })
    }

    /// Full scale in the stage's own thousandths.
    #[must_use]
    pub const fn full_scale(&self) -> Amplitude {
        self.0.full_scale()
    }

    /// The current limit of this kind of stage, µA.
    #[must_use]
    pub const fn max_current_ua(&self) -> u32 {
        match self.0 {
            StageSpec::Current { .. } => limits::MAX_CURRENT_UA,
            StageSpec::Voltage { .. } => limits::VOLTAGE_STAGE_LIMITER_UA,
        }
    }

    /// Current at `amplitude`, µA, rounded up (limits are judged with it).
    #[must_use]
    pub fn current_ua(&self, amplitude: Amplitude) -> u32 {
        match self.0 {
            StageSpec::Current { .. } => amplitude.0,
            StageSpec::Voltage { load_ohm, .. } => {
                // load_ohm >= 200 and the product fits u64.
                let ua = (u64::from(amplitude.0) * 1000).div_ceil(u64::from(load_ohm));
                u32::try_from(ua).unwrap_or(u32::MAX)
            }
        }
    }

    /// The DAC code for `amplitude`, rounded down, saturating at full scale.
    #[must_use]
    pub fn code(&self, amplitude: Amplitude) -> DacCode {
        // full_scale >= 1000; the product fits u64.
        let code = u64::from(amplitude.0) * 65_535 / u64::from(self.full_scale().0);
        DacCode(u16::try_from(code).unwrap_or(u16::MAX))
    }

    /// The amplitude that `code` puts out, in thousandths, rounded down.
    #[must_use]
    pub fn amplitude(&self, code: DacCode) -> Amplitude {
        // At most 65 535 · 150 000 / 65 535.
        Amplitude((u64::from(code.0) * u64::from(self.full_scale().0) / 65_535) as u32)
    }

    /// Current that the reference stage drives through `ohm` at `code`, µA:
    /// up to 100 V from a current stage, up to the limiter from a voltage
    /// stage. For simulated boards.
    #[must_use]
    pub fn current_through_ua(&self, code: DacCode, ohm: u32) -> u32 {
        let set = u64::from(self.amplitude(code).0);
        let ohm = u64::from(ohm.max(1));
        let ua = match self.0 {
            StageSpec::Current { .. } => set.min(100_000_000 / ohm),
            // mV · 1000 / Ω = µA.
            StageSpec::Voltage { .. } => {
                (set * 1000 / ohm).min(limits::VOLTAGE_STAGE_LIMITER_UA.into())
            }
        };
        ua as u32 // at most 150 000
    }

    /// Smallest and largest plausible current at `amplitude`, µA: below, the
    /// electrode is off; above, it is shorted. A current stage must reach half
    /// of what it is set to; a voltage stage must see 100 Ω to 20 kΩ.
    #[must_use]
    pub fn plausible_ua(&self, amplitude: Amplitude) -> (u32, u32) {
        match self.0 {
            StageSpec::Current { .. } => (amplitude.0 / 2, amplitude.0.saturating_mul(3) / 2),
            StageSpec::Voltage { .. } => (amplitude.0 / 20, amplitude.0.saturating_mul(10)),
        }
    }

    /// Amplitude of the electrode check: sub-threshold, 1 mA or 2 V.
    #[must_use]
    pub const fn check_amplitude(&self) -> Amplitude {
        match self.0 {
            StageSpec::Current { .. } => Amplitude(1_000),
            StageSpec::Voltage { .. } => Amplitude(2_000),
        }
    }
}
