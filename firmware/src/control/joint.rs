//! One joint: its setpoint track, its sensor, its law and its points.

use super::feed_forward::FeedForward;
use super::law::{Effort, Law, LawState};
use super::mapping::{Amplitudes, Mapping};
use super::setpoint::{HoldPolicy, SetpointError, SetpointTrack};
use super::spec::{JointSpec, SensorSource, SpecError};
use crate::division::quotient;
use crate::units::{Angle, AngularRate, Micros};
use fixed::types::I16F16;

/// A measurement may lie this far outside the range of setpoints, 20°, before
/// it counts as a broken sensor: a glove's noise and a passive push stay within.
const READING_MARGIN_MDEG: i32 = 20_000;
/// A measurement's time may be this far ahead of the device's, µs: the error
/// of a host's clock offset.
pub const CLOCK_ERROR_US: i32 = 5_000;

/// A validated joint. Immutable; everything that changes is a [`JointState`].
#[derive(Clone, Debug)]
pub struct Joint {
    law: Law,
    law_period_us: u32,
    mapping: Mapping,
    hold: HoldPolicy,
    angle_mdeg: (i32, i32),
    /// Lowest and highest setpoint.
    range: (Angle, Angle),
    /// Lowest and highest believable measurement.
    believable: (Angle, Angle),
    sensor: SensorSource,
    stale_after_us: u32,
    feed_forward: Option<FeedForward>,
}

/// What a joint remembers. Begin every stimulation with a fresh one.
#[derive(Clone, Debug, Default)]
pub struct JointState {
    track: SetpointTrack,
    measured: Option<Measured>,
    law: LawState,
    effort: Option<Effort>,
    law_due: Micros,
}

#[derive(Clone, Copy, Debug)]
struct Measured {
    at: Micros,
    angle: Angle,
    /// Set once and for all, so that a wrapped clock cannot freshen it.
    stale: bool,
}

/// What a joint asks for in one tick.
#[derive(Clone, PartialEq, Debug)]
pub struct Orders {
    /// One amplitude for every channel of the joint, flexors first.
    pub amplitudes: Amplitudes,
    /// An amplitude was clamped to the wearer's maximum.
    pub limiting: bool,
    /// The angle wanted now.
    pub target: Angle,
    /// The latest angle measured.
    pub measured: Angle,
    /// What the law answered, before any clamp.
    pub effort: Effort,
}

/// Why there are no orders: control without a believable angle is refused.
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
    /// This joint measures with the board's converter.
    NotFromHost,
    /// Its time is more than 5 ms ahead of the device's.
    InTheFuture,
    /// A measurement of the same or a later time is known.
    OutOfOrder,
}

impl Joint {
    /// Validates a specification.
    ///
    /// # Errors
    /// [`SpecError`] names the first offending field and what it allows.
    pub fn new(spec: &JointSpec) -> Result<Self, SpecError> {
        spec.check()?;
        let (min, max) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
        Ok(Self {
            law: spec.law()?,
            law_period_us: u32::from(spec.law_period_ms) * 1000,
            mapping: spec.mapping()?,
            hold: spec.hold,
            angle_mdeg: (min, max),
            range: (from_mdeg(min), from_mdeg(max)),
            // |min|, |max| <= 180 000 by check().
            believable: (
                from_mdeg(min - READING_MARGIN_MDEG),
                from_mdeg(max + READING_MARGIN_MDEG),
            ),
            sensor: spec.sensor,
            stale_after_us: u32::from(spec.stale_after_ms) * 1000,
            feed_forward: spec
                .wearer
                .map(|wearer| FeedForward::new(&wearer, min, max))
                .transpose()?,
        })
    }

    /// The nominal wearer's inverse, if the spec has one.
    #[must_use]
    pub const fn feed_forward(&self) -> Option<&FeedForward> {
        self.feed_forward.as_ref()
    }

    /// Takes a setpoint valid from `at`; see [`SetpointTrack::accept`].
    ///
    /// # Errors
    /// [`SetpointError`]; the state is unchanged then.
    pub fn setpoint(
        &self,
        state: &mut JointState,
        now: Micros,
        at: Micros,
        angle: Angle,
        rate: Option<AngularRate>,
    ) -> Result<(), SetpointError> {
        if angle < self.range.0 || angle > self.range.1 {
            let (min_mdeg, max_mdeg) = self.angle_mdeg;
            return Err(SetpointError::OutOfRange { min_mdeg, max_mdeg });
        }
        state.track.accept(now, at, angle, rate)
    }

    /// Takes a measurement from the host, made at `at`.
    ///
    /// # Errors
    /// [`MeasurementError`]; the state is unchanged then. A measurement that
    /// is too old or out of range is taken and becomes the next tick's fault.
    pub fn measurement(
        &self,
        state: &mut JointState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        match self.sensor {
            SensorSource::Host => self.measured(state, now, at, angle),
            SensorSource::Adc { .. } => Err(MeasurementError::NotFromHost),
        }
    }

    /// The one path of all measurements.
    fn measured(
        &self,
        state: &mut JointState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        let lead = at.since(now);
        if lead > CLOCK_ERROR_US {
            return Err(MeasurementError::InTheFuture);
        }
        self.grow_stale(state, now);
        let at = if lead > 0 { now } else { at };
        let known = state.measured.filter(|m| !m.stale);
        if known.is_some_and(|m| !m.at.is_before(at)) {
            return Err(MeasurementError::OutOfOrder);
        }
        state.measured = Some(Measured {
            at,
            angle,
            stale: false,
        });
        Ok(())
    }

    /// Marks the latest measurement once its age passes the limit. A negative
    /// age is one beyond half the clock's range.
    fn grow_stale(&self, state: &mut JointState, now: Micros) {
        if let Some(m) = &mut state.measured {
            let age = now.since(m.at);
            m.stale |= age < 0 || age.cast_unsigned() > self.stale_after_us;
        }
    }

    /// The angle for a converter code, for [`Joint::tick`]; `None` if this
    /// joint's sensor is the host. Linear, extrapolated beyond the two
    /// calibrated codes, 0…4095 or not; saturating.
    #[must_use]
    pub fn angle_from_code(&self, code: u16) -> Option<Angle> {
        let SensorSource::Adc {
            code_at_0,
            code_at_100,
        } = self.sensor
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
        Some(Angle(I16F16::from_bits(
            bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        )))
    }

    /// One control tick, to be called every millisecond. `reading` is the
    /// board's own measurement of this instant; it is ignored if the sensor is
    /// the host.
    ///
    /// The law runs in the first tick and then every period; its effort is held
    /// in between, so the first measurement after a setpoint is answered within
    /// a period. Until the first setpoint is due nobody has asked for anything:
    /// every amplitude is zero, the target is the measured angle, the law rests.
    ///
    /// # Errors
    /// [`SensorFault`] instead of orders while there is no fresh, believable
    /// measurement. Nothing is latched here; `safety` does that.
    pub fn tick(
        &self,
        state: &mut JointState,
        now: Micros,
        reading: Option<Angle>,
    ) -> Result<Orders, SensorFault> {
        if let (SensorSource::Adc { .. }, Some(angle)) = (self.sensor, reading) {
            // Fails only if this instant was measured before: then it is known.
            let _ = self.measured(state, now, now, angle);
        }
        let measured = self.believed(state, now)?;
        let Some(target) = state.track.value_at(now, self.hold) else {
            return Ok(Orders {
                amplitudes: self.mapping.silence(),
                limiting: false,
                target: measured,
                measured,
                effort: self.law.rest(),
            });
        };
        let target = at_most(at_least(target, self.range.0), self.range.1);
        let effort = match state.effort {
            Some(effort) if self.is_waiting(state.law_due, now) => effort,
            held => {
                let error = Angle(target.0.saturating_sub(measured.0));
                let effort = self.law.step(&mut state.law, error);
                state.law_due = self.next_due(state.law_due, now, held.is_some());
                state.effort = Some(effort);
                effort
            }
        };
        let (amplitudes, limiting) = self.mapping.amplitudes(effort);
        Ok(Orders {
            amplitudes,
            limiting,
            target,
            measured,
            effort,
        })
    }

    /// The measurement control may rely on.
    fn believed(&self, state: &mut JointState, now: Micros) -> Result<Angle, SensorFault> {
        self.grow_stale(state, now);
        let Measured { angle, stale, .. } = state.measured.ok_or(SensorFault::Absent)?;
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

    /// Whether the next step lies ahead, within a period: any further is a
    /// wrapped clock.
    fn is_waiting(&self, due: Micros, now: Micros) -> bool {
        let ahead = due.since(now);
        ahead > 0 && ahead.cast_unsigned() <= self.law_period_us
    }

    /// One period after the last due time, so that the rate does not drift; one
    /// period from now at the start and after a gap.
    fn next_due(&self, due: Micros, now: Micros, running: bool) -> Micros {
        let next = due.plus(self.law_period_us);
        if running && now.is_before(next) {
            next
        } else {
            now.plus(self.law_period_us)
        }
    }
}

/// From m° within ±200 000; exact to one bit, rounded towards 0.
fn from_mdeg(mdeg: i32) -> Angle {
    // 2e5 · 2^16 / 1000 < 2^24.
    Angle(I16F16::from_bits((i64::from(mdeg) * 65_536 / 1000) as i32))
}

fn at_least(a: Angle, low: Angle) -> Angle {
    if a < low { low } else { a }
}

fn at_most(a: Angle, high: Angle) -> Angle {
    if a > high { high } else { a }
}
