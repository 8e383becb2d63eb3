//! Angle sensors: measurements from the board's converter or from the host.
//!
//! All angle measurements pass through [`Sensor`], which checks their age and range.

use crate::arithmetic::division::quotient;
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, Micros};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Distance from the joint's range, m°, beyond which a measurement is a sensor fault (20°).
///
/// A glove's noise and a passive push stay within it.
const READING_MARGIN_MDEG: i32 = 20_000;
/// Largest accepted lead of a measurement's time over the device's time, µs.
///
/// It allows for the error of the clock offset that a host estimates.
pub const CLOCK_ERROR_US: i32 = 5_000;

/// Source of a joint's angle measurements.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum SensorSource {
    /// The board's analogue-to-digital converter.
    ///
    /// The angle is linear in the code, through two calibrated codes that are at least 100
    /// apart. The code may fall with flexion.
    Adc {
        /// Converter code at 0°; 0…4095.
        code_at_0: u16,
        /// Converter code at 100°; 0…4095.
        code_at_100: u16,
    },
    /// The host, which sends measurements.
    Host,
}

impl SensorSource {
    /// Range of [`Self::Adc::code_at_0`].
    pub const CODE_AT_0: Range = Range::new("code_at_0", 0, 4095);
    /// Range of [`Self::Adc::code_at_100`].
    pub const CODE_AT_100: Range = Range::new("code_at_100", 0, 4095);
    /// Range of the absolute difference of the two calibrated codes.
    pub const CODE_SPAN: Range = Range::new("code_at_100 - code_at_0", 100, 4095);
    /// Range of the age beyond which the latest measurement is stale, ms.
    pub const STALE_AFTER_MS: Range = Range::new("stale_after_ms", 2, 500);

    /// Checks the range and the difference of the calibrated codes.
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

/// Reason why no plausible angle is available, without which control is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SensorFault {
    /// No measurement has arrived yet.
    Absent,
    /// The latest measurement is older than the limit.
    Stale {
        /// Largest age allowed, ms.
        limit_ms: u16,
    },
    /// The latest measurement is more than 20° outside the joint's range.
    OutOfRange {
        /// The measured angle, hundredths of a degree.
        centideg: i16,
    },
}

/// Reason why a measurement from the host was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeasurementError {
    /// The board's converter measures this angle, not the host.
    NotFromHost,
    /// The measurement's time is more than 5 ms ahead of the device's time.
    InTheFuture,
    /// The device already has a measurement of the same or a later time.
    OutOfOrder,
}

/// A validated angle sensor of one joint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor {
    source: SensorSource,
    stale_after_us: u32,
    /// Lowest and highest plausible measurement.
    plausible: (Angle, Angle),
}

/// State of a sensor: the latest measurement, or none before the first.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SensorState(Option<Measurement>);

/// An accepted measurement and the time at which it was made.
#[derive(Clone, Copy, Debug)]
struct Measurement {
    at: Micros,
    angle: Angle,
    /// Whether the age has passed the limit. Never reset, so that the measurement does not
    /// seem recent again when the clock wraps.
    stale: bool,
}

impl Sensor {
    /// Creates the sensor of a joint after checking the calibration and the age limit.
    ///
    /// `range` is the lowest and the highest angle of the joint, m°, within ±180 000.
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
            plausible: (
                Angle::from_millideg(min.saturating_sub(READING_MARGIN_MDEG)),
                Angle::from_millideg(max.saturating_add(READING_MARGIN_MDEG)),
            ),
        })
    }

    /// Stores a measurement from the host, made at `at`.
    ///
    /// A measurement that is too old or out of range is stored too; the next control tick
    /// reports it as a [`SensorFault`].
    ///
    /// # Errors
    /// [`MeasurementError`] if the measurement is refused. It then does not replace the
    /// latest one.
    pub(crate) fn take_from_host(
        &self,
        state: &mut SensorState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        match self.source {
            SensorSource::Host => self.store(state, now, at, angle),
            SensorSource::Adc { .. } => Err(MeasurementError::NotFromHost),
        }
    }

    /// Returns the angle that control may use at `now`.
    ///
    /// `reading` is the board's own measurement at `now`. It is ignored if the host measures
    /// the angle.
    #[inline]
    pub(crate) fn angle(
        &self,
        state: &mut SensorState,
        now: Micros,
        reading: Option<Angle>,
    ) -> Result<Angle, SensorFault> {
        if let (SensorSource::Adc { .. }, Some(angle)) = (self.source, reading) {
            // Fails only if a measurement of this time is already stored.
            let _ = self.store(state, now, now, angle);
        }
        self.mark_if_stale(state, now);
        let Measurement { angle, stale, .. } = state.0.ok_or(SensorFault::Absent)?;
        if stale {
            // `stale_after_us` was computed from a u16 of milliseconds.
            let limit_ms = (self.stale_after_us / 1000) as u16;
            return Err(SensorFault::Stale { limit_ms });
        }
        if angle < self.plausible.0 || angle > self.plausible.1 {
            return Err(SensorFault::OutOfRange {
                centideg: angle.to_centideg(),
            });
        }
        Ok(angle)
    }

    /// Returns the angle for a converter code, or `None` if the host measures the angle.
    ///
    /// The angle is linear in the code, also beyond the two calibrated codes and the converter's
    /// 0…4095. It saturates.
    pub(crate) fn angle_from_code(&self, code: u16) -> Option<Angle> {
        let SensorSource::Adc {
            code_at_0,
            code_at_100,
        } = self.source
        else {
            return None;
        };
        // The product is less than 2^16 · 100 · 2^16 < 2^39. Validation ensures that the
        // span is at least 100.
        let scaled_offset = u64::from(code.abs_diff(code_at_0)) * (100 << 16);
        let magnitude =
            quotient(scaled_offset, code_at_100.abs_diff(code_at_0).into()).unwrap_or(u32::MAX);
        let is_negative = (code < code_at_0) != (code_at_100 < code_at_0);
        let bits = if is_negative {
            -i64::from(magnitude)
        } else {
            magnitude.into()
        };
        Some(Angle::new(I16F16::from_bits(
            bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        )))
    }

    /// Stores a measurement made at `at` if it is later than the latest one that is not stale.
    ///
    /// A time that is ahead of `now` by no more than [`CLOCK_ERROR_US`] counts as `now`.
    #[inline]
    fn store(
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
        self.mark_if_stale(state, now);
        let at = if lead > 0 { now } else { at };
        let latest = state.0.filter(|measurement| !measurement.stale);
        if latest.is_some_and(|measurement| !measurement.at.is_before(at)) {
            return Err(MeasurementError::OutOfOrder);
        }
        state.0 = Some(Measurement {
            at,
            angle,
            stale: false,
        });
        Ok(())
    }

    /// Marks the latest measurement as stale if its age exceeds the limit.
    ///
    /// A negative age means that the age exceeds half the clock's range.
    fn mark_if_stale(&self, state: &mut SensorState, now: Micros) {
        if let Some(measurement) = &mut state.0 {
            let age = (now - measurement.at).us();
            measurement.stale |= age < 0 || age.cast_unsigned() > self.stale_after_us;
        }
    }
}
