//! The one path of all angle measurements: from the board's converter or from
//! the host, with one check of age and range.

use crate::arithmetic::division::quotient;
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, Micros};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A measurement may lie this far outside a joint's range, 20°, before it counts
/// as a broken sensor: a glove's noise and a passive push stay within.
const READING_MARGIN_MDEG: i32 = 20_000;
/// A measurement's time may be this far ahead of the device's, µs: the error
/// of a host's clock offset.
pub const CLOCK_ERROR_US: i32 = 5_000;

/// Where an angle is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum SensorSource {
    /// By the board's converter, linear between two calibrated codes at least
    /// 100 apart; the code may fall with flexion.
    Adc {
        /// Code at 0°; 0…4095.
        code_at_0: u16,
        /// Code at 100°; 0…4095.
        code_at_100: u16,
    },
    /// By the host, which sends measurements.
    Host,
}

impl SensorSource {
    /// Of [`Self::Adc::code_at_0`].
    pub const CODE_AT_0: Range = Range::new("code_at_0", 0, 4095);
    /// Of [`Self::Adc::code_at_100`].
    pub const CODE_AT_100: Range = Range::new("code_at_100", 0, 4095);
    /// How far the two are apart.
    pub const CODE_SPAN: Range = Range::new("code_at_100 - code_at_0", 100, 4095);
    /// Age at which the last measurement is stale.
    pub const STALE_AFTER_MS: Range = Range::new("stale_after_ms", 2, 500);

    /// Checks the calibration.
    pub(crate) fn check(self) -> Result<(), OutOfRange> {
        let Self::Adc {
            code_at_0,
            code_at_100,
        } = self
        else {
            return Ok(());
        };
        Self::CODE_AT_0.check(code_at_0)?;
        Self::CODE_AT_100.check(code_at_100)?;
        Self::CODE_SPAN.check(code_at_0.abs_diff(code_at_100))
    }
}

/// Why an angle cannot be relied on: control without a believable angle is
/// refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SensorFault {
    /// No measurement has arrived yet.
    Absent,
    /// The latest measurement is older than the limit.
    Stale {
        /// The limit, ms.
        limit_ms: u16,
    },
    /// The latest measurement is more than 20° outside the joint's range.
    OutOfRange {
        /// What was measured, hundredths of a degree.
        centideg: i16,
    },
}

/// Why a measurement was not taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeasurementError {
    /// This angle is measured with the board's converter.
    NotFromHost,
    /// Its time is more than 5 ms ahead of the device's.
    InTheFuture,
    /// A measurement of the same or a later time is known.
    OutOfOrder,
}

/// A validated angle sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    source: SensorSource,
    stale_after_us: u32,
    /// Lowest and highest believable measurement.
    believable: (Angle, Angle),
}

/// What a sensor remembers: the latest measurement.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SensorState(Option<Measured>);

#[derive(Clone, Copy, Debug)]
struct Measured {
    at: Micros,
    angle: Angle,
    /// Set once and for all, so that a wrapped clock cannot freshen it.
    stale: bool,
}

impl Sensor {
    /// Checks calibration and age. `range` are the lowest and the highest angle
    /// of the joint, m°, within ±180 000.
    pub(crate) fn of_joint(
        source: SensorSource,
        stale_after_ms: u16,
        range: (i32, i32),
    ) -> Result<Self, OutOfRange> {
        source.check()?;
        SensorSource::STALE_AFTER_MS.check(stale_after_ms)?;
        let (min, max) = range;
        Ok(Self {
            source,
            stale_after_us: u32::from(stale_after_ms) * 1000,
            believable: (
                Angle::from_millideg(min.saturating_sub(READING_MARGIN_MDEG)),
                Angle::from_millideg(max.saturating_add(READING_MARGIN_MDEG)),
            ),
        })
    }

    /// Takes a measurement from the host, made at `at`.
    ///
    /// # Errors
    /// [`MeasurementError`]; the state is unchanged then. A measurement that
    /// is too old or out of range is taken and becomes the next tick's fault.
    pub(crate) fn take_from_host(
        &self,
        state: &mut SensorState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        match self.source {
            SensorSource::Host => self.measured(state, now, at, angle),
            SensorSource::Adc { .. } => Err(MeasurementError::NotFromHost),
        }
    }

    /// The measurement control may rely on at `now`. `reading` is the board's
    /// own measurement of this instant; it is ignored if the host measures.
    #[inline]
    pub(crate) fn angle(
        &self,
        state: &mut SensorState,
        now: Micros,
        reading: Option<Angle>,
    ) -> Result<Angle, SensorFault> {
        if let (SensorSource::Adc { .. }, Some(angle)) = (self.source, reading) {
            // Fails only if this instant was measured before: then it is known.
            let _ = self.measured(state, now, now, angle);
        }
        self.grow_stale(state, now);
        let Measured { angle, stale, .. } = state.0.ok_or(SensorFault::Absent)?;
        if stale {
            // stale_after_us is a u16 of milliseconds.
            let limit_ms = (self.stale_after_us / 1000) as u16;
            return Err(SensorFault::Stale { limit_ms });
        }
        if angle < self.believable.0 || angle > self.believable.1 {
            return Err(SensorFault::OutOfRange {
                centideg: angle.to_centideg(),
            });
        }
        Ok(angle)
    }

    /// The angle for a converter code; `None` if the host measures. Linear,
    /// extrapolated beyond the two calibrated codes, 0…4095 or not; saturating.
    pub(crate) fn angle_from_code(&self, code: u16) -> Option<Angle> {
        let SensorSource::Adc {
            code_at_0,
            code_at_100,
        } = self.source
        else {
            return None;
        };
        // 2^16 · 100 · 2^16 < 2^39; the span is 100 or more by validation.
        let way = u64::from(code.abs_diff(code_at_0)) * (100 << 16);
        let size = quotient(way, code_at_100.abs_diff(code_at_0).into()).unwrap_or(u32::MAX);
        let is_negative = (code < code_at_0) != (code_at_100 < code_at_0);
        let bits = if is_negative {
            -i64::from(size)
        } else {
            size.into()
        };
        Some(Angle::new(I16F16::from_bits(
            bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        )))
    }

    #[inline]
    fn measured(
        &self,
        state: &mut SensorState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        let lead = (at - now).us();
        if lead > CLOCK_ERROR_US {
            return Err(MeasurementError::InTheFuture);
        }
        self.grow_stale(state, now);
        let at = if lead > 0 { now } else { at };
        let known = state.0.filter(|m| !m.stale);
        if known.is_some_and(|m| !m.at.is_before(at)) {
            return Err(MeasurementError::OutOfOrder);
        }
        state.0 = Some(Measured {
            at,
            angle,
            stale: false,
        });
        Ok(())
    }

    /// Marks the latest measurement once its age passes the limit. A negative
    /// age is one beyond half the clock's range.
    fn grow_stale(&self, state: &mut SensorState, now: Micros) {
        if let Some(m) = &mut state.0 {
            let age = (now - m.at).us();
            m.stale |= age < 0 || age.cast_unsigned() > self.stale_after_us;
        }
    }
}
