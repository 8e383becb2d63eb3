//! Thresholds of the bench at many widths, and the law fitted through them.

use super::declared::{RampsDeclaration, Thresholds};
use super::error::RampsError;
use super::person::{RampsWearer, Setting};
use super::test::micros;
use hal_sim::body::bench::{CellSide, IsometricElbow};
use hal_sim::body::{Body, Drive, Pulse};
use host_core::statistics::student_t_p;
use serde::{Deserialize, Serialize};

/// A threshold as it was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// µs.
    pub width_us: u32,
    /// Lowest current that answers, mA.
    pub current_ma: f64,
}

/// I = rheobase·(1 + chronaxie/width) through thresholds (Weiss; Geddes 2004), with 95 %
/// intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrengthDurationFit {
    /// mA.
    pub rheobase_ma: f64,
    /// Its interval.
    pub rheobase_within: [f64; 2],
    /// µs.
    pub chronaxie_us: f64,
    /// Its interval.
    pub chronaxie_within: [f64; 2],
}

/// Longest search at one width: nothing above what the protocol puts out.
const MOST_MA: f64 = 80.0;
/// The level of an interval.
const LEVEL: f64 = 0.95;

/// A pair of electrodes of somebody at the middle angle, whose cell can be read.
struct Bench<'d> {
    declared: &'d RampsDeclaration,
    arm: IsometricElbow,
    channel: usize,
    now_ms: u64,
}

impl Bench<'_> {
    /// Mean torque of the second half of a step, above that of as long without pulses, N·m.
    fn step(&mut self, current_ma: f64, width_us: u32) -> f64 {
        let half_ms = micros(self.declared.strength_duration.step_s) / 2_000;
        let lever_m = self.arm.spec().cell.lever_m;
        // Whatever still acts has gone by then.
        self.pass(2 * half_ms, None);
        let rest_n = self.pass(half_ms, None);
        self.pass(half_ms, Some((current_ma, width_us)));
        lever_m * (self.pass(half_ms, Some((current_ma, width_us))) - rest_n)
    }

    /// Mean of the cell over so many milliseconds.
    fn pass(&mut self, ms: u64, pulse: Option<(f64, u32)>) -> f64 {
        let period_ms = (1e3 / self.declared.protocol.frequency_hz).round() as u64;
        let mut sum = 0.0;
        for _ in 0..ms {
            if let Some((ma, width_us)) = pulse.filter(|_| self.now_ms.is_multiple_of(period_ms)) {
                self.arm.pulse(&Pulse {
                    t_us: self.now_ms * 1_000,
                    channel: self.channel,
                    drive: Drive::Milliamps(ma),
                    width_us,
                    conducted: false,
                });
            }
            self.now_ms += 1;
            self.arm.advance(self.now_ms * 1_000);
            sum += self.arm.instrument_n().unwrap_or_default();
        }
        sum / ms as f64
    }

    /// The lowest current that answers at this width, by coarse steps, then by fine ones.
    fn search(&mut self, width_us: u32) -> Option<f64> {
        let asked = &self.declared.strength_duration;
        let (coarse_ma, step_ma, detected_nm) = (asked.coarse_ma, asked.step_ma, asked.detected_nm);
        let mut ma = coarse_ma;
        while self.step(ma, width_us) < detected_nm {
            ma += coarse_ma;
            if ma > MOST_MA {
                return None;
            }
        }
        let steps = (coarse_ma / step_ma).round() as u32;
        let fine = (1..steps).map(|index| ma - coarse_ma + step_ma * f64::from(index));
        for lower_ma in fine {
            if self.step(lower_ma, width_us) >= detected_nm {
                return Some(lower_ma);
            }
        }
        Some(ma)
    }
}

impl RampsWearer {
    /// Thresholds of one of their pairs at every width at which there is one below 80 mA.
    ///
    /// # Errors
    /// E691: a bench that cannot be.
    pub fn thresholds(
        &self,
        declared: &RampsDeclaration,
        pair: usize,
    ) -> Result<Vec<Threshold>, RampsError> {
        let setting = Setting {
            holds: if pair == 0 {
                CellSide::Extension
            } else {
                CellSide::Flexion
            },
            ..Setting::exact(90.0)
        };
        let spec = self.rig_spec(setting);
        let mut bench = Bench {
            declared,
            channel: spec.channels[pair.min(1)],
            arm: IsometricElbow::new(spec, self.seed(1_000 + pair as u64))?,
            now_ms: 0,
        };
        let widths = declared.strength_duration.widths_us.iter();
        let found = widths.filter_map(|&width_us| {
            let current_ma = bench.search(width_us)?;
            Some(Threshold {
                width_us,
                current_ma,
            })
        });
        Ok(found.collect())
    }
}

/// The law through thresholds: linear in 1/width. A threshold lies between the step that
/// answers and the one below, so half a step is taken off. Nothing of fewer than four.
#[must_use]
pub fn fit_law(thresholds: &[Threshold], step_ma: f64) -> Option<StrengthDurationFit> {
    let n = thresholds.len() as f64;
    if thresholds.len() < 4 {
        return None;
    }
    let points = thresholds.iter();
    let points: Vec<(f64, f64)> = points
        .map(|threshold| {
            (
                1.0 / f64::from(threshold.width_us),
                threshold.current_ma - 0.5 * step_ma,
            )
        })
        .collect();
    let (sx, sy) = points
        .iter()
        .fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
    let (mx, my) = (sx / n, sy / n);
    let (xx, xy) = points.iter().fold((0.0, 0.0), |sum, point| {
        let x = point.0 - mx;
        (sum.0 + x * x, sum.1 + x * (point.1 - my))
    });
    let slope = xy / xx; // widths differ
    let rheobase_ma = my - slope * mx;
    if rheobase_ma <= 0.0 || slope <= 0.0 {
        return None;
    }
    let left = points
        .iter()
        .map(|point| (point.1 - rheobase_ma - slope * point.0).powi(2));
    // Steps alone leave step²/12; residuals by chance smaller do not make it more certain.
    let variance = (left.sum::<f64>() / (n - 2.0)).max(step_ma * step_ma / 12.0);
    let t = student_quantile(n - 2.0)?;
    let var_slope = variance / xx;
    let var_rheobase = variance * (1.0 / n + mx * mx / xx);
    let covariance = -variance * mx / xx;
    let chronaxie_us = slope / rheobase_ma;
    // Of the logarithm of a ratio, to first order.
    let var_log = var_slope / (slope * slope) + var_rheobase / rheobase_ma.powi(2)
        - 2.0 * covariance / (slope * rheobase_ma);
    let (by, factor) = (t * var_rheobase.sqrt(), (t * var_log.max(0.0).sqrt()).exp());
    Some(StrengthDurationFit {
        rheobase_ma,
        rheobase_within: [rheobase_ma - by, rheobase_ma + by],
        chronaxie_us,
        chronaxie_within: [chronaxie_us / factor, chronaxie_us * factor],
    })
}

/// Of Student's t, two-sided, by halving.
fn student_quantile(df: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, 1_000.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        match student_t_p(middle, df).ok()? > 1.0 - LEVEL {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(high)
}

impl StrengthDurationFit {
    /// Threshold at this width, mA.
    #[must_use]
    pub fn threshold_ma(&self, width_us: f64) -> f64 {
        self.rheobase_ma * (1.0 + self.chronaxie_us / width_us)
    }
}

impl Thresholds {
    /// The recommended maximum at this width, mA: the law through the two assumed points.
    #[must_use]
    pub fn upper_ma(&self, width_us: f64) -> f64 {
        let [(d1, i1), (d2, i2)] = [self.upper.first(), self.upper.last()]
            .map(|pair| pair.map_or((1.0, 0.0), |&(d, i)| (f64::from(d), i)));
        // i = b + b·c/d through both.
        let slope = (i1 - i2) / (1.0 / d1 - 1.0 / d2);
        let rheobase = i1 - slope / d1;
        (rheobase + slope / width_us).min(self.upper_most_ma)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(rheobase: f64, chronaxie: f64, up: f64) -> Vec<Threshold> {
        let widths = [25, 35, 45, 60, 80, 100, 150, 200, 250, 300];
        let at = |width_us: u32| {
            let exact = rheobase * (1.0 + chronaxie / f64::from(width_us));
            // The lowest step at or above it.
            let current_ma = (exact / up).ceil() * up;
            Threshold {
                width_us,
                current_ma,
            }
        };
        widths.map(at).to_vec()
    }

    #[test]
    fn the_law_comes_back_through_steps() {
        let within = |[low, high]: [f64; 2], value: f64| low <= value && value <= high;
        let (mut all, mut rheobases, mut chronaxies) = (0, 0, 0);
        for (rheobase, chronaxie) in (0..600).map(|index| {
            let (tenths, fives) = (f64::from(index % 24), f64::from(index / 24));
            (3.0 + 0.21 * tenths, 100.0 + 10.3 * fives)
        }) {
            let found = fit_law(&law(rheobase, chronaxie, 0.5), 0.5).unwrap();
            all += 1;
            rheobases += usize::from(within(found.rheobase_within, rheobase));
            chronaxies += usize::from(within(found.chronaxie_within, chronaxie));
            assert!(
                (found.chronaxie_us / chronaxie - 1.0).abs() < 0.15,
                "{found:?}"
            );
        }
        // 95 % intervals, and somewhat more: the floor of the variance makes them longer.
        for covered in [rheobases, chronaxies] {
            let share = covered as f64 / f64::from(all);
            assert!((0.95..1.0).contains(&share), "{share}");
        }
    }

    #[test]
    fn too_few_thresholds_are_no_law() {
        assert_eq!(fit_law(&law(4.0, 200.0, 0.5)[..3], 0.5), None);
    }

    /// Table of Student: 2.306 with eight degrees of freedom.
    #[test]
    fn the_quantile_is_the_tables() {
        assert!((student_quantile(8.0).unwrap() - 2.306).abs() < 5e-4);
    }

    /// By hand: b = 27.1 mA, c = 88 µs; above 80 mA nothing.
    #[test]
    fn the_upper_curve_goes_through_what_was_put_out() {
        let upper = super::super::declared::RampsDeclaration::load_embedded()
            .unwrap()
            .strength_duration;
        assert!((upper.upper_ma(300.0) - 35.0).abs() < 1e-9);
        assert!((upper.upper_ma(45.0) - 80.0).abs() < 1e-9);
        assert_eq!(upper.upper_ma(25.0), 80.0);
        assert!((upper.upper_ma(1e9) - 27.06).abs() < 0.05);
    }
}
