//! One electrode of a wearer: its position, its thresholds and the muscle under it.

use super::unit::Unit;
use firmware::muscle::{CalciumForceSpec, FatigueSpec};
use firmware::units::Amplitude;

/// An electrode of a wearer, with its thresholds and the muscle under it. Amplitudes are in
/// thousandths of the electrode's unit (mA or V).
#[derive(Clone, PartialEq, Debug)]
pub struct Electrode {
    /// Channel to which the electrode is connected, 1–10.
    pub channel: u8,
    /// Position on the body, in words of 1 to 200 characters.
    pub place: String,
    /// Area of the electrode, mm²: 10–20 000.
    pub area_mm2: u32,
    /// Unit of the amplitudes: mA for a current stage, V for a voltage stage.
    pub unit: Unit,
    /// Load with which the voltages of a voltage stage are converted to currents, to check them
    /// against current limits, Ω.
    pub load_ohm: u32,
    /// Pulse width for which the thresholds and limits hold, µs.
    pub width_us: u16,
    /// Pulse rate at which the thresholds were found, Hz.
    pub frequency_hz: f64,
    /// Lowest and highest pulse rate at which the thresholds are assumed to hold, Hz.
    pub holds_hz: [f64; 2],
    /// Motor threshold I_MT: the smallest amplitude that makes the muscle contract visibly.
    pub motor_threshold: Amplitude,
    /// Largest amplitude that the wearer accepts, I_PT. Sessions cannot exceed it.
    pub limit: Amplitude,
    /// Largest amplitude that the wearer accepts at once. A larger one must rise gradually from 0
    /// (`rise_ms`); 0 means that every amplitude must.
    pub start: Amplitude,
    /// Smallest amplitude that a session uses by default, as an operator set it.
    pub minimum: Option<Amplitude>,
    /// Largest amplitude that a session uses by default, as an operator set it.
    pub maximum: Option<Amplitude>,
    /// Amplitude at zero effort of a joint, at which the muscle does not yet move it; `None` if it
    /// is `minimum`, or else the motor threshold.
    pub joint_threshold: Option<Amplitude>,
    /// Movements that the electrode causes, in words.
    pub moves: Vec<String>,
    /// Curve of the thresholds over pulse width; `None` if the thresholds are known at one width
    /// only.
    pub strength_duration: Option<StrengthDuration>,
    /// Model of the muscle under the electrode; `None` if the muscle was not identified.
    pub muscle: Option<Muscle>,
    /// Intervals of 95 % confidence for those numbers of the electrode for which they are known.
    pub intervals: Vec<Interval>,
}

/// Strength–duration curve: the threshold at a pulse width is rheobase · (1 + chronaxie / width),
/// for rectangular pulses of constant current (Lapicque; Geddes 2004).
#[derive(Clone, PartialEq, Debug)]
pub struct StrengthDuration {
    /// Threshold of an endless pulse, thousandths of the electrode's unit.
    pub rheobase: Amplitude,
    /// Pulse width at which the threshold is twice the rheobase, ns.
    pub chronaxie_ns: u32,
    /// Largest amplitudes that the wearer accepts at other widths, as (width in µs, amplitude). The
    /// widths rise, and the amplitude is linear between them.
    pub upper: Vec<(u16, Amplitude)>,
}

/// Force and recruitment model of a muscle (Lee 2020, equations 2, 3 and 5).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Muscle {
    /// Parameters of the force model: A, K and the time constants.
    pub force: CalciumForceSpec,
    /// Amplitude at which the force scale A was measured, thousandths of the electrode's unit.
    pub reference: Amplitude,
    /// Slope b of the recruitment over amplitude, millionths per mA or V.
    pub slope_micro: u32,
    /// Fatigue of the muscle; `None` if it is unknown.
    pub fatigue: Option<FatigueSpec>,
}

/// Interval of 95 % confidence for one number of an electrode.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// Name of the number, one of [`super::INTERVALS_OF`]. Both ends of the interval are in the
    /// unit of that number in the file.
    pub of: &'static str,
    /// Lower end of the interval, at most `high`.
    pub low: f64,
    /// Upper end of the interval, at least `low`.
    pub high: f64,
}

/// Reason why an electrode cannot be used at another pulse width.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WidthError {
    /// The thresholds at that width are unknown, because there is no strength–duration curve.
    NoCurve,
    /// The threshold at that width would not be below the largest amplitude that the wearer
    /// accepts. The value is this threshold, in thousandths of the electrode's unit.
    AboveLimit(Amplitude),
}

impl StrengthDuration {
    /// Returns the factor between amplitudes of the same effect: an amplitude at the width
    /// `from_us`, multiplied by it, has the same effect at the width `to_us`.
    #[must_use]
    pub fn factor(&self, from_us: u16, to_us: u16) -> f64 {
        let chronaxie_us = f64::from(self.chronaxie_ns) * 1e-3;
        let need = |us: u16| 1.0 + chronaxie_us / f64::from(us.max(1));
        need(to_us) / need(from_us)
    }

    /// Returns the largest amplitude that the wearer accepts at a pulse width, from the points in
    /// `upper`. Returns `None` outside the widths of the points.
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
    /// Converts the electrode to another pulse width with its strength–duration curve.
    ///
    /// The threshold, and the minimum and maximum that an operator set, are multiplied by the
    /// factor of the curve. The limit is the one in `upper` of the curve, if it covers the width.
    /// Otherwise the limit is multiplied for longer pulses, and stays for shorter ones. The muscle
    /// responds to the multiplied amplitude as it did before.
    ///
    /// # Errors
    /// The electrode has no strength–duration curve, or the threshold at the new width is not below
    /// the limit there.
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
            joint_threshold: (self.joint_threshold).map(|amplitude| scaled(amplitude).min(limit)),
            muscle,
            ..self.clone()
        })
    }

    /// Returns the smallest and the largest amplitude of the haptic range of Lee 2020, section 2.4:
    /// I_MT and 1.5 · I_MT, in thousandths of the electrode's unit.
    #[must_use]
    pub fn haptic_range(&self) -> [Amplitude; 2] {
        let threshold = self.motor_threshold;
        let most = threshold.get() / 2 * 3 + threshold.get() % 2;
        [threshold, Amplitude::new(most)]
    }
}
