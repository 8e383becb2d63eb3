//! Errors of every compared setting over all inputs that the device accepts: random muscles and
//! trains, the same for all. Muscles, rates and seed were fixed before any result was seen.
//!
//! A only scales the force, so each method is judged at the A that suits its format: the largest,
//! or in the generic fixed-point formats one with which no force exceeds half of Q7.24.

use super::cases::{Case, Random};
use super::{digits, errors, range, settings};
use methods::muscle::{Number, Setting};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Number of random muscles.
pub const MUSCLES: usize = 300;
/// Seed of muscles and trains.
const SEED: u32 = 4_801;
/// Lowest and highest pulse rate, Hz; uniform in the logarithm.
const RATES_HZ: [f64; 2] = [0.5, 200.0];
/// Largest force A·(τ1 + τ2) in the generic fixed-point formats, N, and largest A, mN/s.
const LARGEST_FORCE_N: f64 = 64.0;
const LARGEST_A_MN_PER_S: f64 = 3_900_000.0;

/// One muscle under one train, with the A for generic fixed point and the largest.
struct Scales {
    narrow: Case,
    full: Case,
}

impl Scales {
    fn new(full: Case) -> Self {
        let tau_m_s = f64::from(full.spec.tau1_us + full.spec.tau2_us) * 1e-6;
        let a = (LARGEST_FORCE_N * 1e3 / tau_m_s).min(LARGEST_A_MN_PER_S);
        Self {
            narrow: full.with_a(a as u32),
            full,
        }
    }

    fn of(&self, number: Number) -> &Case {
        match number {
            Number::Q15_16 | Number::Q7_24 => &self.narrow,
            Number::F64 | Number::F32 | Number::Micromath | Number::Device => &self.full,
        }
    }
}

/// Errors of one setting at one interval of reading, % of each train's peak; infinite beyond all
/// numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeRow {
    pub setting: Setting,
    /// Time between two readings, µs.
    pub output_us: u32,
    /// Error that half of the muscles do not exceed.
    pub median_pct: f64,
    /// Error that 95 % of the muscles do not exceed.
    pub most_pct: f64,
    /// Largest error.
    pub worst_pct: f64,
}

/// The muscles, each with its train and true force.
pub struct Sample(Vec<Scales>);

impl Sample {
    /// Generates the muscles and computes their true forces.
    #[must_use]
    pub fn new() -> Self {
        let mut random = Random(SEED);
        let trains = (0..MUSCLES).map(|_| range::random_train(&mut random, RATES_HZ));
        let trains: Vec<_> = trains.collect();
        let scales = |train| Scales::new(range::case(train));
        Self(trains.par_iter().map(scales).collect())
    }

    /// Returns the errors of a setting.
    #[must_use]
    pub fn errors(&self, setting: Setting, output_us: u32) -> RangeRow {
        let error =
            |scales: &Scales| errors::case_error_pct(scales.of(setting.number), setting, output_us);
        let mut errors: Vec<f64> = self.0.iter().map(error).collect();
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let count = (share * errors.len() as f64).ceil() as usize;
            errors[count.saturating_sub(1)]
        };
        RangeRow {
            setting,
            output_us,
            median_pct: at(0.5),
            most_pct: at(0.95),
            worst_pct: at(1.0),
        }
    }
}

impl Default for Sample {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns the errors of every setting over the sample, in the order of the chart. `step` receives
/// the finished part, 0 to 1.
pub fn all_range_errors(step: impl Fn(f64) + Sync) -> Vec<RangeRow> {
    let sample = Sample::new();
    let settings: Vec<_> = settings().collect();
    let done = AtomicUsize::new(0);
    let row = |(setting, output_us): &(Setting, u32)| {
        let row = sample.errors(*setting, *output_us);
        let done = done.fetch_add(1, Ordering::Relaxed);
        step(done as f64 / settings.len() as f64);
        row
    };
    settings.par_iter().map(row).collect()
}

/// Formats the rows as the table that is committed in docs/charts; docs/evidence/methods.md explains its
/// columns.
#[must_use]
pub fn range_csv(rows: &[RangeRow]) -> String {
    let head = "method,arithmetic,step_us,output_us,reading,median_pct,p95_pct,worst_pct\n";
    let lines = rows.iter().map(line);
    head.to_owned() + &lines.collect::<String>()
}

/// Formats one line of [`range_csv`].
#[must_use]
pub fn line(row: &RangeRow) -> String {
    let setting = row.setting;
    let step = match setting.step_us {
        Setting::WHOLE_US => String::new(),
        us => us.to_string(),
    };
    format!(
        "{},{},{step},{},{},{},{},{}\n",
        setting.method.name(),
        setting.number.name(),
        row.output_us,
        setting.reading.name(),
        digits(row.median_pct),
        digits(row.most_pct),
        digits(row.worst_pct)
    )
}
