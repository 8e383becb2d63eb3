//! One electrode of a wearer: its position, its thresholds and the muscle under it.

use super::unit::Unit;
use firmware::muscle::{CalciumForceSpec, FatigueSpec};
use firmware::units::Amplitude;

/// An electrode and the muscle under it. Amplitudes are thousandths of the unit.
#[derive(Clone, PartialEq, Debug)]
pub struct Electrode {
    /// Channel to which the electrode is connected, 1–10.
    pub channel: u8,
    /// Position on the body, in words of 1 to 200 characters.
    pub place: String,
    /// Area of the electrode, mm²: 10–20 000.
    pub area_mm2: u32,
    /// Quantity that the output stage controls, and unit of the amplitudes.
    pub unit: Unit,
    /// Load through which the voltage is judged against current limits, Ω; for a voltage stage.
    pub load_ohm: u32,
    /// Pulse width at which the thresholds hold, µs.
    pub width_us: u16,
    /// Pulse rate at which the thresholds were found, Hz.
    pub frequency_hz: f64,
    /// Lowest and highest pulse rate at which the thresholds are assumed to hold, Hz.
    pub holds_hz: [f64; 2],
    /// Smallest amplitude that moves: the motor threshold I_MT.
    pub motor_threshold: Amplitude,
    /// Largest amplitude that the wearer accepts: I_PT.
    pub limit: Amplitude,
    /// Largest amplitude that the wearer accepts at once, without a rise; 0 for none.
    pub start: Amplitude,
    /// Smallest amplitude that is used, as an operator set it.
    pub minimum: Option<Amplitude>,
    /// Largest amplitude that is used, as an operator set it.
    pub maximum: Option<Amplitude>,
    /// Movements that the electrode causes, in words.
    pub moves: Vec<String>,
    /// Thresholds at other pulse widths.
    pub strength_duration: Option<StrengthDuration>,
    /// Model of the muscle under the electrode.
    pub muscle: Option<Muscle>,
    /// 95 % intervals of the numbers for which they are known.
    pub intervals: Vec<Interval>,
}

/// Thresholds over pulse width: rheobase · (1 + chronaxie / width), for rectangular pulses of
/// constant current (Lapicque; Geddes 2004).
#[derive(Clone, PartialEq, Debug)]
pub struct StrengthDuration {
    /// Threshold of an endless pulse, thousandths of the unit.
    pub rheobase: Amplitude,
    /// Pulse width at which the threshold is twice the rheobase, ns.
    pub chronaxie_ns: u32,
    /// Largest amplitudes that the wearer accepts, as (width in µs, amplitude) with rising widths;
    /// linear in between.
    pub upper: Vec<(u16, Amplitude)>,
}

/// Model of a muscle (Lee 2020, equations 2, 3 and 5).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Muscle {
    /// Parameters of the force model: A, K and the time constants.
    pub force: CalciumForceSpec,
    /// Amplitude at which A holds, thousandths of the unit.
    pub reference: Amplitude,
    /// Slope b of the recruitment, millionths per unit.
    pub slope_micro: u32,
    /// Fatigue of the muscle, if it is known.
    pub fatigue: Option<FatigueSpec>,
}

/// A 95 % interval of one number of an electrode.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// Name of the number, one of [`super::INTERVALS_OF`], in whose unit the interval is.
    pub of: &'static str,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// Reason why an electrode cannot be used at another pulse width.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WidthError {
    /// The thresholds at that width are unknown, because there is no strength–duration curve.
    NoCurve,
    /// This threshold, thousandths of the unit, is not below the known limit.
    AboveLimit(Amplitude),
}

impl StrengthDuration {
    /// Returns the factor by which the amplitude at `from_us` must be multiplied at `to_us` for the
    /// same effect.
    #[must_use]
    pub fn factor(&self, from_us: u16, to_us: u16) -> f64 {
        let chronaxie_us = f64::from(self.chronaxie_ns) * 1e-3;
        let need = |us: u16| 1.0 + chronaxie_us / f64::from(us.max(1));
        need(to_us) / need(from_us)
    }

    /// Returns the largest accepted amplitude at a pulse width, or `None` outside the widths of the
    /// curve.
    #[must_use]
    pub fn upper_at(&self, width_us: u16) -> Option<Amplitude> {
        let next = self.upper.partition_point(|&(us, _)| us < width_us);
        let &(to_us, to) = self.upper.get(next)?;
        if to_us == width_us {
            return Some(to);
        }
        let &(from_us, from) = self.upper.get(next.checked_sub(1)?)?;
        let part = f64::from(width_us - from_us) / f64::from(to_us - from_us);
        let (from, to) = (f64::from(from.get()), f64::from(to.get()));
        Some(Amplitude::new((from + part * (to - from)).floor() as u32)) // between two u32
    }
}

impl Electrode {
    /// Returns the electrode at another pulse width, by its strength–duration curve. Thresholds,
    /// and the amplitudes that an operator set, are multiplied by the factor of the curve. The
    /// limit is multiplied too for longer pulses; for shorter ones it stays, unless `upper` of the
    /// curve gives it there. The muscle responds in the same way at the multiplied amplitude.
    ///
    /// # Errors
    /// There is no such curve, or the threshold at that width is not below the known limit.
    pub fn at_width(&self, width_us: u16) -> Result<Self, WidthError> {
        if width_us == self.width_us {
            return Ok(self.clone());
        }
        let curve = self.strength_duration.as_ref().ok_or(WidthError::NoCurve)?;
        let factor = curve.factor(self.width_us, width_us);
        let times = |amplitude: Amplitude, factor: f64| f64::from(amplitude.get()) * factor;
        let scaled = |amplitude| Amplitude::new(times(amplitude, factor).round() as u32); // saturates
        let lower = |amplitude| Amplitude::new(times(amplitude, factor.min(1.0)).floor() as u32);
        let lowered = lower(self.limit);
        let muscle = self.muscle.map(|muscle| Muscle {
            reference: scaled(muscle.reference),
            slope_micro: (f64::from(muscle.slope_micro) / factor).round() as u32, // saturates
            ..muscle
        });
        let limit = curve.upper_at(width_us).unwrap_or(lowered);
        // The limit must stay within the range of the muscle's curve.
        let limit = muscle.map_or(limit, |muscle| limit.min(muscle.reference));
        let motor_threshold = scaled(self.motor_threshold);
        if motor_threshold >= limit {
            return Err(WidthError::AboveLimit(motor_threshold));
        }
        Ok(Self {
            width_us,
            motor_threshold,
            limit,
            start: lower(self.start).min(limit),
            minimum: self.minimum.map(|amplitude| scaled(amplitude).min(limit)),
            maximum: self.maximum.map(|amplitude| scaled(amplitude).min(limit)),
            muscle,
            ..self.clone()
        })
    }

    /// Returns the haptic range of Lee 2020, section 2.4: I_MT to 1.5 · I_MT, thousandths of the
    /// unit.
    #[must_use]
    pub fn haptic_range(&self) -> [Amplitude; 2] {
        let threshold = self.motor_threshold;
        let most = threshold.get() / 2 * 3 + threshold.get() % 2;
        [threshold, Amplitude::new(most)]
    }
}
