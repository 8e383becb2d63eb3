//! Judges searches on simulated wearers whose true threshold is known: how often a search is wrong,
//! and by how much.

use super::declaration::{Rating, SearchDeclaration};
use super::milli::Milli;
use super::plan::Search;
use super::stair::{Finding, Probe, SearchEnd, search};
use hal_sim::random::{standard_normal, unit};
use serde::Deserialize;
use std::convert::Infallible;

/// Preregistered declaration of the judged run: parameters, sources and seeds.
pub const JUDGED: &str = include_str!("judged.toml");

/// Response of a simulated joint to a level.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curve {
    /// No movement at any level.
    Still,
    /// No movement up to the threshold, and an exponential rise above it (Lee 2020, table 2).
    Hard,
    /// Logistic; the threshold is the level at which the movement reaches `visible_deg`.
    Logistic,
    /// No movement; the wearer rates levels linearly, 0 at `threshold` and 10 at `span` above it.
    Rated,
}

/// Random wearers whose parameters are uniform between the ends of each range.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Readable name.
    pub name: String,
    /// Response of the joint to a level.
    pub curve: Curve,
    /// Range of the true threshold, in the search's unit.
    pub threshold: [f64; 2],
    /// Range of the distance from threshold to full movement; for a logistic curve, of its width w.
    pub span: [f64; 2],
    /// Full movement, degrees.
    pub full_deg: f64,
    /// Range of the standard deviation of a window's mean at rest, degrees; uniform in the
    /// logarithm. For ratings, in points.
    pub noise: [f64; 2],
    /// Correlation of the noise of successive windows, 0 to below 1.
    pub correlation: f64,
    /// Range of the coefficient of variation of the movement between contractions.
    pub contraction: [f64; 2],
    /// Pulse rate of all channels together, Hz.
    pub pulses_hz: f64,
    /// Source of the values.
    pub source: String,
    /// The search to judge.
    pub search: SearchDeclaration,
}

/// The cases of a judged run; every case uses the same seeds.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCases {
    /// The first seed; the others follow.
    pub first_seed: u64,
    /// Number of searches per case.
    pub searches: u64,
    /// At least one case.
    #[serde(rename = "case")]
    pub cases: Vec<Case>,
}

impl SearchCases {
    /// Parses a declaration.
    ///
    /// # Errors
    /// Returns the first mistake in the text.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }
}

/// Counts over the searches of one case.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SearchCounts {
    /// Number of searches.
    pub searches: u64,
    /// Searches that ended more than one step below the true threshold.
    pub early: u64,
    /// Searches that found nothing although the true threshold is at least one step below the
    /// highest level; for ratings, those that accepted more than one step above it.
    pub missed: u64,
    /// Searches whose threshold lies within the levels.
    pub findable: u64,
    /// Findable searches whose value is within one step of the true threshold.
    pub within: u64,
    /// Findable searches whose interval contains the true threshold.
    pub covered: u64,
    /// Largest distance of a value from the true threshold, steps.
    pub worst_steps: f64,
    /// Total number of pulses in all searches.
    pub pulses: u64,
    /// Total number of presentations in all searches.
    pub presentations: u64,
}

impl SearchCounts {
    /// Returns the share of wrong searches: early or missed.
    #[must_use]
    pub fn false_share(&self) -> f64 {
        (self.early + self.missed) as f64 / self.searches.max(1) as f64
    }

    /// Returns the share of values within one step of the true threshold, among findable searches.
    #[must_use]
    pub fn within_share(&self) -> f64 {
        self.within as f64 / self.findable.max(1) as f64
    }
}

/// Runs one search on each wearer of `case`.
///
/// # Errors
/// Returns every mistake in the case's search.
pub fn judge(case: &Case, first_seed: u64, searches: u64) -> Result<SearchCounts, Vec<String>> {
    let stair = Search::new(case.search.clone())?;
    let top = stair.levels().last().unwrap_or_default().units();
    let step = stair.step().units();
    let mut tally = SearchCounts::default();
    for seed in first_seed..first_seed + searches {
        let mut wearer = Wearer::draw(case, seed);
        let truth = wearer.truth();
        let finding = search(&stair, &mut wearer, |_| {});
        tally.searches += 1;
        tally.pulses += finding.pulses;
        tally.presentations += finding.trail.len() as u64;
        tally.count(&finding, truth, top, step);
    }
    Ok(tally)
}

impl SearchCounts {
    fn count<E>(&mut self, finding: &Finding<E>, truth: f64, top: f64, step: f64) {
        let is_found = matches!(finding.ended, SearchEnd::Found);
        let high = finding.high.map_or(f64::INFINITY, Milli::units);
        self.early += u64::from(high < truth - step);
        self.missed += u64::from(truth <= top - step && finding.low.units() > truth + step);
        if truth > top - step {
            return;
        }
        self.findable += 1;
        let value = finding.value.unwrap_or(finding.low).units();
        let off = (value - truth).abs() / step;
        self.within += u64::from(is_found && off <= 1.0);
        self.covered += u64::from(finding.low.units() < truth && truth <= high);
        self.worst_steps = self.worst_steps.max(off);
    }
}

/// A random wearer with a known threshold.
struct Wearer<'a> {
    case: &'a Case,
    threshold: f64,
    span: f64,
    noise: f64,
    contraction: f64,
    seed: u64,
    /// Number of normal deviates used so far.
    drawn: u64,
    /// Noise of the latest window, in standard deviations.
    latest: f64,
    pulses: u64,
}

impl<'a> Wearer<'a> {
    fn draw(case: &'a Case, seed: u64) -> Self {
        let between = |index: u64, [low, high]: [f64; 2]| low + (high - low) * unit(seed, index);
        Self {
            case,
            threshold: between(0, case.threshold),
            span: between(1, case.span),
            noise: between(2, case.noise.map(f64::ln)).exp(),
            contraction: between(3, case.contraction),
            seed,
            drawn: 8,
            latest: 0.0,
            pulses: 0,
        }
    }

    /// Returns the true threshold in the search's unit; infinite if there is none.
    fn truth(&self) -> f64 {
        match self.case.curve {
            Curve::Still => f64::INFINITY,
            Curve::Hard | Curve::Logistic => self.threshold,
            // Ratings are rounded, so they exceed the accepted one from half a point above it.
            Curve::Rated => {
                let accepted = f64::from(self.case.search.rating.unwrap_or(0));
                self.threshold + self.span * (accepted + 0.5) / 10.0
            }
        }
    }

    /// Returns the movement without noise, degrees.
    fn movement(&self, level: f64) -> f64 {
        let full = self.case.full_deg;
        match self.case.curve {
            Curve::Still | Curve::Rated => 0.0,
            Curve::Hard => {
                let x = ((level - self.threshold) / self.span).clamp(0.0, 1.0);
                full * (CURVATURE * x).exp_m1() / CURVATURE.exp_m1()
            }
            Curve::Logistic => {
                let visible = self.case.search.visible_deg.unwrap_or(1.0);
                let middle = self.threshold + self.span * (full / visible - 1.0).ln();
                full / (1.0 + ((middle - level) / self.span).exp())
            }
        }
    }

    fn normal(&mut self) -> f64 {
        self.drawn += 1;
        standard_normal(self.seed, self.drawn)
    }

    /// Returns noisy sensor means around `deg`.
    fn windows(&mut self, count: u32, deg: f64) -> Vec<f64> {
        let rho = self.case.correlation;
        (0..count)
            .map(|_| {
                self.latest = rho * self.latest + (1.0 - rho * rho).sqrt() * self.normal();
                deg + self.noise * self.latest
            })
            .collect()
    }
}

/// Exponent b of F = a·exp(b·I) from threshold to tolerable maximum, mean of Lee 2020, table 2.
const CURVATURE: f64 = 1.2;

impl Probe for Wearer<'_> {
    type Error = Infallible;

    fn may_raise(&mut self, _: Milli, _: Milli) -> Result<bool, Infallible> {
        Ok(true)
    }

    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, Infallible> {
        self.latest = self.normal();
        let count = self.case.search.baseline_windows;
        Ok(self.windows(if has_baseline { count } else { 0 }, 0.0))
    }

    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, Infallible> {
        let search = &self.case.search;
        let (count, long_ms) = (search.windows, search.windows * search.window_ms);
        let seconds = f64::from(search.settle_ms + long_ms) * 1e-3;
        self.pulses += (seconds * self.case.pulses_hz).round() as u64;
        let strength = 1.0 + self.contraction * self.normal();
        let deg = strength.max(0.0) * self.movement(level.units());
        Ok(self.windows(if has_windows { count } else { 0 }, deg))
    }

    fn rating(&mut self, level: Milli) -> Result<u8, Infallible> {
        let person = Rating {
            none: self.threshold,
            ten: self.threshold + self.span,
            noise: self.noise,
        };
        let deviate = self.normal();
        Ok(person.rate(level, deviate))
    }

    fn observed_movement(&mut self, _: Milli) -> Result<Option<bool>, Infallible> {
        Ok(None)
    }

    fn pulses(&self) -> u64 {
        self.pulses
    }
}
