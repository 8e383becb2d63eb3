//! Breaks a measured angle: replaces, delays or drops its measurements.

use super::measured::MeasuredBits;
use hal_sim::body::{BrokenSensor, SensorFault};
use hal_sim::random::Random;

/// Time within which the device must detect a wrong or missing measurement, µs: two control ticks
/// plus the next reading at 50 Hz.
pub(super) const SOON_US: u64 = 22_000;
/// Interval at which the board's converter reads the angle, µs.
const TICK_US: u64 = 1_000;

/// The randomly chosen fault of one measured angle of a session.
pub(super) struct BrokenAngle<'k> {
    kind: &'k str,
    pub angle: MeasuredBits,
    /// Number of the angle with which this one is swapped, for that kind of fault.
    other: Option<u8>,
    pub fault: Option<SensorFault>,
    /// Delay with which the measurement arrives, µs: 0 if it is not delayed, `None` if it never
    /// arrives.
    late_us: Option<u64>,
    pub moment_us: u64,
}

impl<'k> BrokenAngle<'k> {
    /// Chooses at random how `angle` breaks at `moment_us`; `angles` are all angles of the session,
    /// with one of which it may be swapped.
    pub fn draw(
        (kind, moment_us): (&'k str, u64),
        angle: MeasuredBits,
        angles: &[MeasuredBits],
        random: &mut Random,
    ) -> Self {
        let mut drawn = Self {
            kind,
            angle,
            other: None,
            fault: None,
            late_us: Some(0),
            moment_us,
        };
        drawn.choose_fault(angles, random);
        drawn
    }

    fn choose_fault(&mut self, angles: &[MeasuredBits], random: &mut Random) {
        let off = random.log_between(5.0, 200.0) * [-1.0, 1.0][random.below(2) as usize];
        let age_us = random.log_between(5e3, 4e5) as u64;
        let far = 1e6_f64.copysign(off);
        let fault = match self.kind {
            "stuck" => SensorFault::Stuck,
            // An outlier is one reading: the first from a host, or those of one tick from a
            // converter.
            "outlier" if self.angle.is_converted() => SensorFault::Outlier(off, TICK_US),
            "outlier" => SensorFault::Outlier(off, 0),
            "step" => SensorFault::Step(off),
            "drift" => SensorFault::Drift(off),
            "code" => SensorFault::Says(far),
            "delayed" => SensorFault::Delayed(age_us),
            // A converter's reading has no time stamp, and an open wire reads the smallest value.
            "late" if self.angle.is_converted() => SensorFault::Delayed(age_us),
            "stopped" if self.angle.is_converted() => SensorFault::Says(-1e6),
            "late" => {
                self.late_us = Some(age_us);
                return;
            }
            "stopped" => {
                self.late_us = None;
                return;
            }
            _ => {
                let others = angles
                    .iter()
                    .filter(|measurement| measurement.index != self.angle.index);
                let others: Vec<u8> = others.map(|measurement| measurement.index).collect();
                if others.is_empty() {
                    SensorFault::Reversed(self.angle.middle_deg())
                } else {
                    self.other = Some(others[random.below(others.len() as u64) as usize]);
                    return;
                }
            }
        };
        self.fault = Some(fault);
    }

    /// Returns the delay, µs, the number of the angle and the value with which a measurement
    /// arrives, or `None` if it never arrives. Measurements before the fault arrive unchanged.
    pub fn replace_measurement(
        &self,
        t_us: u64,
        joint: u8,
        deg: f64,
        broken: &mut BrokenSensor,
    ) -> Option<(u64, u8, f64)> {
        let is_broken = t_us >= self.moment_us;
        if let Some(other) = self.other.filter(|_| is_broken) {
            let swapped = match joint {
                own if own == self.angle.index => other,
                own if own == other => self.angle.index,
                own => own,
            };
            return Some((0, swapped, deg));
        }
        if joint != self.angle.index {
            return Some((0, joint, deg));
        }
        match self.fault {
            Some(_) => Some((0, joint, broken.read(t_us, deg))),
            None if is_broken => Some((self.late_us?, joint, deg)),
            None => Some((0, joint, deg)),
        }
    }

    /// Returns whether the device must detect the fault. `reported_deg` is the smallest and the largest
    /// angle reported since the fault, °.
    pub fn must_be_detected(&self, reported_deg: Option<[f64; 2]>) -> bool {
        let late_us = self.late_us.unwrap_or(u64::MAX);
        let is_late = late_us > self.angle.stale_us + SOON_US;
        is_late || reported_deg.is_some_and(|range_deg| self.angle.is_beyond(range_deg))
    }

    pub fn in_words(&self, file: &str) -> String {
        let Self { kind, angle, .. } = self;
        let mut text = format!("{kind}: {file}, angle {}", angle.index);
        if let Some(fault) = self.fault {
            text += &format!(", {fault:.2?}");
        }
        if let Some(other) = self.other {
            text += &format!(" with {other}");
        }
        match self.late_us {
            Some(0) | None => text,
            Some(us) => format!("{text}, {us} us"),
        }
    }
}
