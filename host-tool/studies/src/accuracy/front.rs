//! Error and cost of every setting, and the Pareto front.

use super::cases::Case;
use super::cost::Cost;
use super::errors;
use crate::bench::{BenchError, Row};
use methods::bench::{MADE, OUTPUTS_US, RUN_US};
use methods::muscle::{Reading, Setting};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest error allowed for the device's model, %.
pub const WANTED_PCT: f64 = 0.02;

/// A setting at one interval of reading, with its error and its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub setting: Setting,
    /// Time between two readings, µs.
    pub output_us: u32,
    /// Largest error over all cases, % of peak; infinite if the method diverges.
    pub error_pct: f64,
    /// Core clock cycles per simulated second and muscle.
    pub cycles_per_s: u64,
    /// Core clock cycles of the most expensive reading, with the pulses since the previous one.
    pub worst_tick: u64,
    /// Whether the error is below 100 % and no other point of the same `output_us` is better in
    /// error or cost without being worse in the other.
    pub on_front: bool,
}

/// Returns the settings in the image's order, each with its interval of reading, µs.
fn settings() -> impl Iterator<Item = (Setting, u32)> {
    OUTPUTS_US
        .into_iter()
        .flat_map(|output_us| Setting::all(output_us).map(move |s| (s, output_us)))
}

/// Returns the error of every setting in the image's order; `step` receives the finished part.
pub fn all_errors(cases: &[Case], step: impl Fn(f64) + Sync) -> Vec<f64> {
    let settings: Vec<_> = settings().collect();
    let done = AtomicUsize::new(0);
    let error = |(setting, output_us): &(Setting, u32)| {
        let error = errors::worst_error_pct(cases, *setting, *output_us);
        let done = done.fetch_add(1, Ordering::Relaxed);
        step(done as f64 / settings.len() as f64);
        error
    };
    settings.par_iter().map(error).collect()
}

/// Points of all settings, with related measurements.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Points in the image's order.
    pub points: Vec<Point>,
    /// Core clock cycles of the shipped model at the corner of its ranges, per second and in its
    /// worst tick, for each interval of reading.
    pub corners: Vec<[u64; 2]>,
    /// Core clock cycles of constructing a muscle (constants and tables) for some settings.
    pub makes: Vec<(Setting, u64)>,
    /// Names of the settings whose forces differ between chip and computer in any bit.
    pub differing: Vec<String>,
}

/// Measures all errors and costs; `step` receives the finished part.
pub fn measure(cases: &[Case], step: impl Fn(f64) + Sync) -> Result<Chart, BenchError> {
    // First, because an image may be missing.
    let chip = Cost::on_chip()?;
    step(0.65);
    let errors = all_errors(cases, |part| step(0.65 + part * 0.3));
    Ok(Chart::new(&errors, &chip, &Cost::on_host()))
}

/// Returns the cycles of one simulated second.
fn per_second(row: &Row) -> u64 {
    (row.mean * 1_000_000 + u64::from(RUN_US) / 2) / u64::from(RUN_US)
}

impl Chart {
    /// Combines the measurements, all in the image's order.
    pub fn new(errors: &[f64], chip: &Cost, host: &Cost) -> Self {
        let all = |cost: &Cost| [&cost.runs[..], &cost.corners].concat();
        let pairs = all(chip).into_iter().zip(all(host));
        let differing = pairs.filter(|(c, h)| c.checksum != h.checksum || c.name != h.name);
        let points = settings().zip(errors).zip(&chip.runs);
        let points = points.map(|(((setting, output_us), error_pct), row)| Point {
            setting,
            output_us,
            error_pct: *error_pct,
            cycles_per_s: per_second(row),
            worst_tick: row.max,
            on_front: false,
        });
        let mut chart = Self {
            differing: differing.map(|(c, _)| c.name.clone()).collect(),
            points: points.collect(),
            corners: (chip.corners.iter().map(|row| [per_second(row), row.max])).collect(),
            makes: MADE
                .into_iter()
                .zip(chip.makes.iter().map(|row| row.mean))
                .collect(),
        };
        chart.mark_front();
        chart
    }

    fn mark_front(&mut self) {
        const USELESS_PCT: f64 = 100.0;
        let beats = |a: &Point, b: &Point| {
            a.output_us == b.output_us
                && a.cycles_per_s <= b.cycles_per_s
                && a.error_pct <= b.error_pct
                && (a.cycles_per_s < b.cycles_per_s || a.error_pct < b.error_pct)
        };
        let all = self.points.clone();
        for point in &mut self.points {
            let is_of_use = point.error_pct < USELESS_PCT;
            point.on_front = is_of_use && !all.iter().any(|other| beats(other, point));
        }
    }

    /// Returns the points that are read every `output_us`.
    pub fn read_every(&self, output_us: u32) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(move |p| p.output_us == output_us)
    }

    /// Returns the cheapest point whose error is at most [`WANTED_PCT`].
    pub fn cheapest(&self, output_us: u32) -> Option<&Point> {
        self.read_every(output_us)
            .filter(|p| p.error_pct <= WANTED_PCT)
            .min_by_key(|p| p.cycles_per_s)
    }

    /// Returns the point of a setting whose force is read every `output_us`.
    pub fn point(&self, setting: Setting, output_us: u32) -> Option<&Point> {
        self.read_every(output_us).find(|p| p.setting == setting)
    }

    /// Returns the committed table; docs/methods.md explains its columns.
    pub fn csv(&self) -> String {
        let mut text = "method,arithmetic,step_us,output_us,error_pct,cycles_per_s,front,kind,\
                        reading,worst_tick_cycles\n"
            .to_owned();
        for point in &self.points {
            let Point {
                setting, output_us, ..
            } = point;
            let step = match setting.step_us {
                Setting::WHOLE_US => String::new(),
                us => us.to_string(),
            };
            text.push_str(&format!(
                "{},{},{step},{output_us},{},{},{},{},{},{}\n",
                setting.method.name(),
                setting.number.name(),
                digits(point.error_pct),
                point.cycles_per_s,
                u8::from(point.on_front),
                if setting.method.is_tuned() {
                    "tuned"
                } else {
                    "generic"
                },
                match setting.reading {
                    Reading::Steps => "steps",
                    Reading::Cubic => "cubic",
                },
                point.worst_tick
            ));
        }
        text
    }
}

/// Formats three significant digits; infinity is `inf`.
pub fn digits(error_pct: f64) -> String {
    format!("{error_pct:.2e}")
}
