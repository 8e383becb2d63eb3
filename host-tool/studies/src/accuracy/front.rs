//! Error and cost of every setting, and the Pareto front.

use super::cases::Case;
use super::cost::Cost;
use super::errors;
use crate::bench::{BenchError, Row};
use methods::bench::{MADE, OUTPUTS_US, RUN_US};
use methods::muscle::Setting;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Largest error allowed for the device's model, % of the peak force.
pub const WANTED_PCT: f64 = 0.02;

/// A setting (integration method, number format and step) read at one interval, with its error and
/// its cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub setting: Setting,
    /// Time between two readings, µs.
    pub output_us: u32,
    /// Largest error over all cases, % of the case's peak force; infinite if the method diverges.
    pub error_pct: f64,
    /// Core clock cycles per simulated second and muscle.
    pub cycles_per_s: u64,
    /// Core clock cycles of the most expensive reading, with the pulses since the previous one.
    pub worst_tick: u64,
    /// Whether the error is below 100 % and no other point of the same `output_us` is better in
    /// error or cost without being worse in the other.
    pub on_front: bool,
}

/// Returns each pair of a setting and the interval at which its force is read, µs, in the order in
/// which the image measures them.
pub fn settings() -> impl Iterator<Item = (Setting, u32)> {
    OUTPUTS_US
        .into_iter()
        .flat_map(|output_us| Setting::all(output_us).map(move |s| (s, output_us)))
}

/// Returns the error of every setting, % of the peak force, in the order in which the image
/// measures them. `step` receives the finished part, 0 to 1.
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

/// Points of all settings, with the costs and differences that the report also shows.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Points in the order in which the image measures them.
    pub points: Vec<Point>,
    /// Core clock cycles of the shipped model with the parameters at which it is most expensive:
    /// per second, and in its most expensive reading. One pair for each reading interval.
    pub corners: Vec<[u64; 2]>,
    /// Settings of [`MADE`], each with the core clock cycles that it takes to compute the constants
    /// and tables of a muscle.
    pub makes: Vec<(Setting, u64)>,
    /// Names of the settings whose forces are not bit-identical on chip simulator and computer.
    pub differing: Vec<String>,
}

/// Measures all costs, then all errors; `step` receives the finished part, 0 to 1.
pub fn measure(cases: &[Case], step: impl Fn(f64) + Sync) -> Result<Chart, BenchError> {
    // First, because an image may be missing.
    let chip = Cost::on_chip()?;
    step(0.65);
    let errors = all_errors(cases, |part| step(0.65 + part * 0.3));
    Ok(Chart::new(&errors, &chip, &Cost::on_host()))
}

/// Returns the core clock cycles per simulated second, rounded, from the mean of a run.
fn per_second(row: &Row) -> u64 {
    (row.mean * 1_000_000 + u64::from(RUN_US) / 2) / u64::from(RUN_US)
}

impl Chart {
    /// Combines errors and costs to points and marks the Pareto front. `errors` and both costs must
    /// be in the order in which the image measures the settings.
    pub fn new(errors: &[f64], chip: &Cost, host: &Cost) -> Self {
        let rows = |cost: &Cost| [&cost.runs[..], &cost.corners].concat();
        let pairs = rows(chip).into_iter().zip(rows(host));
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
        let points = self.points.clone();
        for point in &mut self.points {
            let is_of_use = point.error_pct < USELESS_PCT;
            point.on_front = is_of_use && !points.iter().any(|other| beats(other, point));
        }
    }

    /// Returns the points whose force is read every `output_us`.
    pub fn read_every(&self, output_us: u32) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(move |p| p.output_us == output_us)
    }

    /// Returns the point with the fewest cycles per second among those whose error is at most
    /// [`WANTED_PCT`]; `None` if there is none.
    pub fn cheapest(&self, output_us: u32) -> Option<&Point> {
        self.read_every(output_us)
            .filter(|p| p.error_pct <= WANTED_PCT)
            .min_by_key(|p| p.cycles_per_s)
    }

    /// Returns the point of `setting` whose force is read every `output_us`; `None` if this pair is
    /// not measured.
    pub fn point(&self, setting: Setting, output_us: u32) -> Option<&Point> {
        self.read_every(output_us).find(|p| p.setting == setting)
    }

    /// Formats the points as the table that is committed in docs/charts; docs/evidence/methods.md explains
    /// its columns.
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
                if setting.is_tuned() {
                    "tuned"
                } else {
                    "generic"
                },
                setting.reading.name(),
                point.worst_tick
            ));
        }
        text
    }
}

/// Formats an error with three significant digits; infinity is `inf`.
pub fn digits(error_pct: f64) -> String {
    format!("{error_pct:.2e}")
}
