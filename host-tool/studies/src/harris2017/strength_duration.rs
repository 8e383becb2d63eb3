//! Searches thresholds with the test rig at many pulse widths and fits a strength–duration law
//! through them.

use super::declared::{RampsDeclaration, Thresholds};
use super::error::RampsError;
use super::person::{RampsWearer, Setting};
use super::test::micros;
use hal_sim::body::bench::{CellSide, IsometricElbow};
use hal_sim::body::{Body, Drive, Pulse};
use host_core::statistics::student_t_p;
use serde::{Deserialize, Serialize};

/// Threshold at one pulse width.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    pub width_us: u32,
    /// Smallest current that causes a response, mA.
    pub current_ma: f64,
}

/// Fit of I = rheobase·(1 + chronaxie/width) through thresholds (Weiss; Geddes 2004), with 95 %
/// intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StrengthDurationFit {
    pub rheobase_ma: f64,
    /// 95 % interval of the rheobase, mA.
    pub rheobase_within: [f64; 2],
    pub chronaxie_us: f64,
    /// 95 % interval of the chronaxie, µs.
    pub chronaxie_within: [f64; 2],
}

/// Largest current of the search, mA: the largest of the protocol.
const MOST_MA: f64 = 80.0;
/// Confidence level of the intervals.
const LEVEL: f64 = 0.95;

/// Test rig with a wearer's electrode pair at the middle angle and a load cell.
struct Bench<'d> {
    declared: &'d RampsDeclaration,
    arm: IsometricElbow,
    channel: usize,
    now_ms: u64,
}

impl Bench<'_> {
    /// Returns the mean torque in the second half of a step, N·m, minus the mean torque over an
    /// equal time without pulses.
    fn step(&mut self, current_ma: f64, width_us: u32) -> f64 {
        let half_ms = micros(self.declared.strength_duration.step_s) / 2_000;
        let lever_m = self.arm.spec().cell.lever_m;
        // Lets the effect of earlier pulses fade.
        self.pass(2 * half_ms, None);
        let rest_n = self.pass(half_ms, None);
        self.pass(half_ms, Some((current_ma, width_us)));
        lever_m * (self.pass(half_ms, Some((current_ma, width_us))) - rest_n)
    }

    /// Returns the mean of the cell over `ms` milliseconds, N, with or without pulses.
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

    /// Returns the smallest current that causes a response at this width, mA, by coarse and then
    /// fine steps; `None` if there is none up to 80 mA.
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
    /// Measures the thresholds of one electrode pair at every width that has one below 80 mA.
    ///
    /// # Errors
    /// Returns E691 if the test rig is invalid.
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

/// Fits the law through thresholds; it is linear in 1/width. Half a step is subtracted, because the
/// true threshold lies between the first step with a response and the one below. Returns `None` for
/// fewer than four thresholds, or if the fit is not positive.
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
    let slope = xy / xx; // The widths differ, so `xx` is not 0.
    let rheobase_ma = my - slope * mx;
    if rheobase_ma <= 0.0 || slope <= 0.0 {
        return None;
    }
    let left = points
        .iter()
        .map(|point| (point.1 - rheobase_ma - slope * point.0).powi(2));
    // Rounding to steps alone has the variance step²/12. Smaller residuals are chance and must not
    // narrow the intervals.
    let variance = (left.sum::<f64>() / (n - 2.0)).max(step_ma * step_ma / 12.0);
    let t = student_quantile(n - 2.0)?;
    let var_slope = variance / xx;
    let var_rheobase = variance * (1.0 / n + mx * mx / xx);
    let covariance = -variance * mx / xx;
    let chronaxie_us = slope / rheobase_ma;
    // Variance of the logarithm of the ratio, to first order.
    let var_log = var_slope / (slope * slope) + var_rheobase / rheobase_ma.powi(2)
        - 2.0 * covariance / (slope * rheobase_ma);
    let (by, factor) = (
        t * var_rheobase.sqrt(),
        libm::exp(t * var_log.max(0.0).sqrt()),
    );
    Some(StrengthDurationFit {
        rheobase_ma,
        rheobase_within: [rheobase_ma - by, rheobase_ma + by],
        chronaxie_us,
        chronaxie_within: [chronaxie_us / factor, chronaxie_us * factor],
    })
}

/// Returns the two-sided quantile of Student's t at [`LEVEL`] for `df` degrees of freedom.
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
    /// Returns the threshold at this width, mA.
    #[must_use]
    pub fn threshold_ma(&self, width_us: f64) -> f64 {
        self.rheobase_ma * (1.0 + self.chronaxie_us / width_us)
    }
}

impl Thresholds {
    /// Returns the recommended maximum at this width, mA: the law through the first and last
    /// assumed point, up to its bound.
    #[must_use]
    pub fn upper_ma(&self, width_us: f64) -> f64 {
        let [(d1, i1), (d2, i2)] = [self.upper.first(), self.upper.last()]
            .map(|pair| pair.map_or((1.0, 0.0), |&(d, i)| (f64::from(d), i)));
        // Solves i = b + b·c/d for both points.
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
            // Smallest step at or above the exact threshold.
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
        // The lower bound of the variance makes the intervals wider than 95 %.
        for covered in [rheobases, chronaxies] {
            let share = covered as f64 / f64::from(all);
            assert!((0.95..1.0).contains(&share), "{share}");
        }
    }

    #[test]
    fn too_few_thresholds_are_no_law() {
        assert_eq!(fit_law(&law(4.0, 200.0, 0.5)[..3], 0.5), None);
    }

    /// Table of Student's t: 2.306 with eight degrees of freedom.
    #[test]
    fn the_quantile_is_the_tables() {
        assert!((student_quantile(8.0).unwrap() - 2.306).abs() < 5e-4);
    }

    /// Computed by hand: b = 27.1 mA, c = 88 µs, bounded at 80 mA.
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
