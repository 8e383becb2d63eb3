//! A validated virtual wall and its output at each control tick.

use super::spec::{CoContraction, PreWall, Side, WallError, WallSpec};
use crate::arithmetic::division::quotient;
use crate::control::differentiator::{Differentiator, DifferentiatorState};
use crate::control::sensor::{Sensor, SensorState};
use crate::control::{Amplitudes, MeasurementError, SensorFault};
use crate::units::{Amplitude, Angle, AngularRate, Micros};

/// Period of the wall, which runs at every control tick, ms.
const STEP_MS: u8 = 1;

/// A validated wall. It is immutable; everything that changes is in a [`WallState`].
///
/// ```
/// use firmware::control::SensorSource;
/// use firmware::haptics::{Side, Wall, WallSpec, WallState};
/// use firmware::units::{Amplitude, Angle, Micros};
///
/// let wall = Wall::new(&WallSpec {
///     at_mdeg: 90_000,
///     side: Side::Flexion,
///     channel: 0,
///     max: Amplitude::new(20_000),
///     stiffness: 4_000,
///     damping: 0,
///     cutoff_mhz: 10_000,
///     pre_wall: None,
///     co_contraction: None,
///     angle_min_mdeg: 0,
///     angle_max_mdeg: 150_000,
///     sensor: SensorSource::Adc { code_at_0: 500, code_at_100: 2_500 },
///     stale_after_ms: 10,
/// })
/// .unwrap();
/// let mut state = WallState::default();
/// // 2° inside: two times 4 mA.
/// let inside = Some(Angle::from_centideg(9_200));
/// let orders = wall.tick(&mut state, Micros::new(1_000), inside).unwrap();
/// assert_eq!(orders.amplitudes[0], (0, Amplitude::new(8_000)));
/// ```
#[derive(Clone, Debug)]
pub struct Wall {
    at: Angle,
    side: Side,
    channel: u8,
    /// Maximum amplitude. By validation all amplitudes and gains are at most 200 000.
    max: u32,
    stiffness: u32,
    damping: u32,
    differentiator: Differentiator,
    pre_wall: Option<Ramp>,
    co_contraction: Option<CoContraction>,
    sensor: Sensor,
}

/// A pre-wall with its slope.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    /// Depth in Q15.16 degrees, above 0.
    depth: i32,
    begin: u32,
    end: u32,
    /// Amplitude per degree, Q.16: (end − begin)/depth, below 2^21 · 2^16.
    slope: u64,
}

/// State of a wall. Every stimulation must begin with a fresh state.
#[derive(Clone, Debug, Default)]
pub struct WallState {
    sensor: SensorState,
    differentiator: DifferentiatorState,
}

/// Output of a wall in one tick.
#[derive(Clone, PartialEq, Debug)]
pub struct WallOrders {
    /// Amplitudes of the wall's channel and, after it, of the antagonist's.
    pub amplitudes: Amplitudes,
    /// Whether the amplitude was clamped to the wall's maximum.
    pub limiting: bool,
    /// Angle at which the wall stands.
    pub wall: Angle,
    /// Latest measured angle.
    pub measured: Angle,
    /// Depth of the limb inside the wall; negative in front of it.
    pub penetration: Angle,
}

impl Wall {
    /// Validates a specification.
    ///
    /// # Errors
    /// Returns [`WallError`] with the first offending field and its range.
    pub fn new(spec: &WallSpec) -> Result<Self, WallError> {
        spec.check()?;
        let range = (spec.angle_min_mdeg, spec.angle_max_mdeg);
        Ok(Self {
            at: Angle::from_millideg(spec.at_mdeg),
            side: spec.side,
            channel: spec.channel,
            max: spec.max.get(),
            stiffness: spec.stiffness,
            damping: spec.damping,
            differentiator: Differentiator::new(spec.cutoff_mhz, STEP_MS)?,
            pre_wall: spec.pre_wall.map(Ramp::new),
            co_contraction: spec.co_contraction,
            sensor: Sensor::of_joint(spec.sensor, spec.stale_after_ms, range)?,
        })
    }

    /// Accepts a measurement from the host, made at `at`.
    ///
    /// # Errors
    /// Returns [`MeasurementError`] if the measurement is refused. The state is then unchanged. A
    /// measurement that is too old or out of range is accepted and causes the next tick's fault.
    pub fn accept_measurement(
        &self,
        state: &mut WallState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        self.sensor
            .take_from_host(&mut state.sensor, now, at, angle)
    }

    /// Returns the angle at which the wall stands.
    #[must_use]
    pub const fn wall_angle(&self) -> Angle {
        self.at
    }

    /// Converts a converter code into an angle for [`Wall::tick`]. Returns `None` if the host
    /// measures the angle.
    #[must_use]
    pub fn angle_from_code(&self, code: u16) -> Option<Angle> {
        self.sensor.angle_from_code(code)
    }

    /// Runs one control tick; call this function every millisecond. `reading` is the board's own
    /// measurement of this instant; it is ignored if the host measures the angle. The wall needs no
    /// setpoint: it stands from the first tick on.
    ///
    /// # Errors
    /// Returns [`SensorFault`] instead of orders while there is no recent, plausible measurement.
    /// No fault is latched here; `safety` does that.
    pub fn tick(
        &self,
        state: &mut WallState,
        now: Micros,
        reading: Option<Angle>,
    ) -> Result<WallOrders, SensorFault> {
        let measured = self.sensor.angle(&mut state.sensor, now, reading)?;
        let penetration = self.penetration(measured);
        let rate = self
            .differentiator
            .step(&mut state.differentiator, penetration);
        let wanted = self.unclamped_amplitude(penetration, rate);
        let max = i64::from(self.max);
        // 0…max, so it fits.
        let amplitude = Amplitude::new(wanted.clamp(0, max) as u32);
        let mut amplitudes = Amplitudes::new();
        // Uses two of three slots, so push cannot fail.
        let _ = amplitudes.push((self.channel, amplitude));
        if let Some(other) = self.co_contraction {
            let is_inside = penetration > Angle::default();
            let amplitude = if is_inside {
                other.amplitude
            } else {
                Amplitude::ZERO
            };
            let _ = amplitudes.push((other.channel, amplitude));
        }
        Ok(WallOrders {
            amplitudes,
            limiting: wanted > max,
            wall: self.at,
            measured,
            penetration,
        })
    }

    fn penetration(&self, measured: Angle) -> Angle {
        match self.side {
            Side::Flexion => measured - self.at,
            Side::Extension => self.at - measured,
        }
    }

    /// Returns the amplitude at this penetration and rate before any clamp; 0 or below if the wall
    /// cannot be felt there.
    fn unclamped_amplitude(&self, penetration: Angle, rate: AngularRate) -> i64 {
        let depth = penetration.get().to_bits();
        let elastic = match self.pre_wall {
            _ if depth > 0 => {
                let base = self.pre_wall.map_or(0, |ramp| ramp.end);
                // depth < 2^31 and stiffness < 2^18: below 2^33 after the shift.
                i64::from(base) + ((i64::from(depth) * i64::from(self.stiffness)) >> 16)
            }
            Some(ramp) => match ramp.at(depth) {
                Some(amplitude) => amplitude,
                None => return 0,
            },
            None => return 0,
        };
        // |rate| < 2^31, damping < 2^15.
        let damped = (i64::from(rate.get().to_bits()) * i64::from(self.damping)) >> 16;
        elastic + damped // |sum| < 2^34
    }
}

impl Ramp {
    fn new(pre: PreWall) -> Self {
        // Validated: 100…45 000 m°, so 6553…2^22 in Q15.16.
        let depth = Angle::from_millideg(pre.depth_mdeg.cast_signed())
            .get()
            .to_bits();
        let (begin, end) = (pre.begin.get(), pre.end.get());
        let way = u64::from(end.saturating_sub(begin)) << 16;
        // way < 2^34 over at least 6553 is below 2^22; that in Q.16 fits u64.
        let slope = quotient(way << 10, depth.unsigned_abs()).map_or(0, |q| u64::from(q) << 6);
        Self {
            depth,
            begin,
            end,
            slope,
        }
    }

    /// Returns the amplitude at a `depth` of at most 0, or `None` in front of the ramp.
    fn at(&self, depth: i32) -> Option<i64> {
        // Both are within 2^31; the sum that remains is 0…2^22.
        let along = u64::try_from(i64::from(depth) + i64::from(self.depth)).ok()?;
        if along == 0 {
            return None;
        }
        // slope < 2^38, along <= 2^22.
        let risen = (self.slope * along) >> 32;
        Some(i64::from(self.begin) + risen as i64)
    }
}
