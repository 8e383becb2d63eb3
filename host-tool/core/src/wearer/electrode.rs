//! One electrode of a wearer: where it is, what it moves from when on, and how hard.

use super::unit::Unit;
use firmware::muscle::{CalciumForceSpec, FatigueSpec};
use firmware::units::Amplitude;

/// An electrode and the muscle under it. Amplitudes are thousandths of the unit.
#[derive(Clone, PartialEq, Debug)]
pub struct Electrode {
    /// Its channel, 1–10.
    pub channel: u8,
    /// Where it is, in words of 1 to 200 characters.
    pub place: String,
    /// Its area, mm²: 10–20 000.
    pub area_mm2: u32,
    /// What its stage controls, and what its amplitudes are in.
    pub unit: Unit,
    /// The load with which its volts are judged, Ω; of a voltage stage.
    pub load_ohm: u32,
    /// The pulse width at which its thresholds hold, µs.
    pub width_us: u16,
    /// The pulse rate at which they were found, Hz.
    pub frequency_hz: f64,
    /// The least and the greatest pulse rate at which they are taken to hold, Hz.
    pub holds_hz: [f64; 2],
    /// The smallest amplitude that moves: I_MT.
    pub motor_threshold: Amplitude,
    /// The largest that the wearer accepts: I_PT.
    pub limit: Amplitude,
    /// The largest that the wearer accepts at once, without a rise; 0 for none.
    pub start: Amplitude,
    /// The least that is used, as an operator set it.
    pub minimum: Option<Amplitude>,
    /// The most that is used, as an operator set it.
    pub maximum: Option<Amplitude>,
    /// What it moves, in words.
    pub moves: Vec<String>,
    /// Thresholds at other widths.
    pub strength_duration: Option<StrengthDuration>,
    /// The muscle under it.
    pub muscle: Option<Muscle>,
    /// Of what is known of it, how well: 95 % intervals.
    pub intervals: Vec<Interval>,
}

/// Thresholds over pulse width: rheobase · (1 + chronaxie / width), rectangular pulses of
/// constant current (Lapicque; Geddes 2004).
#[derive(Clone, PartialEq, Debug)]
pub struct StrengthDuration {
    /// The threshold of an endless pulse, thousandths of the unit.
    pub rheobase: Amplitude,
    /// The width at which the threshold is twice that, ns.
    pub chronaxie_ns: u32,
    /// The largest that the wearer accepts at widths, µs, rising; straight between them.
    pub upper: Vec<(u16, Amplitude)>,
}

/// A muscle's model (Lee 2020, equations 2, 3 and 5).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Muscle {
    /// A, K and the time constants.
    pub force: CalciumForceSpec,
    /// The amplitude at which A holds, thousandths of the unit.
    pub reference: Amplitude,
    /// b, millionths per unit.
    pub slope_micro: u32,
    /// How it tires.
    pub fatigue: Option<FatigueSpec>,
}

/// A 95 % interval of a number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// One of [`super::INTERVALS_OF`]: the number, in its unit.
    pub of: &'static str,
    /// Its lower end.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
}

/// Why an electrode cannot be used at another pulse width.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Unfit {
    /// Nobody knows its thresholds there.
    NoCurve,
    /// This threshold, thousandths of the unit, is not below the limit that is known.
    AboveLimit(Amplitude),
}

impl StrengthDuration {
    /// How many times the amplitude at `from_us` is wanted at `to_us` for the same
    /// effect.
    #[must_use]
    pub fn factor(&self, from_us: u16, to_us: u16) -> f64 {
        let chronaxie_us = f64::from(self.chronaxie_ns) * 1e-3;
        let need = |us: u16| 1.0 + chronaxie_us / f64::from(us.max(1));
        need(to_us) / need(from_us)
    }

    /// The largest accepted at a width, if that is known: within the curve's widths.
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
    /// The electrode at another pulse width, by its strength–duration curve: thresholds,
    /// and what an operator set, are as many times as high as the curve says. So is the
    /// limit at longer pulses; at shorter ones it stays, unless the curve's `upper` knows
    /// it there. The muscle answers the same at as many times the amplitude.
    ///
    /// # Errors
    /// There is no such curve, or the threshold there is not below the limit known.
    pub fn at_width(&self, width_us: u16) -> Result<Self, Unfit> {
        if width_us == self.width_us {
            return Ok(self.clone());
        }
        let curve = self.strength_duration.as_ref().ok_or(Unfit::NoCurve)?;
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
        // No further than the muscle's curve goes.
        let limit = muscle.map_or(limit, |muscle| limit.min(muscle.reference));
        let motor_threshold = scaled(self.motor_threshold);
        if motor_threshold >= limit {
            return Err(Unfit::AboveLimit(motor_threshold));
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

    /// The haptic range of Lee 2020, section 2.4: I_MT to 1.5 · I_MT, thousandths of the
    /// unit.
    #[must_use]
    pub fn haptic_range(&self) -> [Amplitude; 2] {
        let threshold = self.motor_threshold;
        let most = threshold.get() / 2 * 3 + threshold.get() % 2;
        [threshold, Amplitude::new(most)]
    }
}
