//! Searches on wearers whose truth is declared: how often each is wrong, and by how
//! much.

use super::declaration::{Rating, SearchDeclaration};
use super::milli::Milli;
use super::plan::Search;
use super::stair::{Finding, Probe, SearchEnd, search};
use hal_sim::random::{standard_normal, unit};
use serde::Deserialize;
use std::convert::Infallible;

/// The judged run as it was declared before it: parameters, sources and seeds.
pub const JUDGED: &str = include_str!("judged.toml");

/// What a simulated joint does at a level.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curve {
    /// Nothing at any level.
    Still,
    /// Nothing up to the threshold, above it exponential (Lee 2020, table 2).
    Hard,
    /// Logistic; the threshold is where it reaches `visible_deg`.
    Logistic,
    /// Nothing; the person rates levels, evenly from `threshold` (0) on, 10 at `span`
    /// above it.
    Rated,
}

/// Wearers drawn evenly between the ends of each range.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// For people.
    pub name: String,
    /// What the joint does.
    pub curve: Curve,
    /// The truth, in the search's unit.
    pub threshold: [f64; 2],
    /// From it to full movement; of a logistic curve, its width w.
    pub span: [f64; 2],
    /// Full movement, degrees.
    pub full_deg: f64,
    /// Standard deviation of a window's mean at rest, degrees; drawn evenly over its
    /// logarithm. Of a rating: points.
    pub noise: [f64; 2],
    /// Correlation of a window's noise with that of the one before, 0 to below 1.
    pub correlation: f64,
    /// Coefficient of variation of the movement from contraction to contraction.
    pub contraction: [f64; 2],
    /// Of all channels together.
    pub pulses_hz: f64,
    /// Where these are from.
    pub source: String,
    /// The search.
    pub search: SearchDeclaration,
}

/// The cases of a judged run, each searched with the same seeds.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCases {
    /// First seed; the others follow.
    pub first_seed: u64,
    /// Searches of each case.
    pub searches: u64,
    /// One or more.
    #[serde(rename = "case")]
    pub cases: Vec<Case>,
}

impl SearchCases {
    /// Reads a declaration.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }
}

/// How a case's searches came out.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SearchCounts {
    /// How many there were.
    pub searches: u64,
    /// Those that ended more than a step below the truth.
    pub early: u64,
    /// Those that found nothing although the truth is a step or more below the highest
    /// level, or, of ratings, accepted more than a step above it.
    pub missed: u64,
    /// Those with a truth to be found.
    pub findable: u64,
    /// Of these, those whose value is within a step of it.
    pub within: u64,
    /// Of these, those whose interval has it.
    pub covered: u64,
    /// Largest distance of a value from the truth, steps.
    pub worst_steps: f64,
    /// Pulses of all searches.
    pub pulses: u64,
    /// Presentations of all searches.
    pub presentations: u64,
}

impl SearchCounts {
    /// Share of searches that are false.
    #[must_use]
    pub fn false_share(&self) -> f64 {
        (self.early + self.missed) as f64 / self.searches.max(1) as f64
    }

    /// Share of values within a step of the truth, of those to be found.
    #[must_use]
    pub fn within_share(&self) -> f64 {
        self.within as f64 / self.findable.max(1) as f64
    }
}

/// Searches each wearer of `case` once.
///
/// # Errors
/// What is wrong with its search.
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

/// A drawn wearer: a test body of declared numbers.
struct Wearer<'a> {
    case: &'a Case,
    threshold: f64,
    span: f64,
    noise: f64,
    contraction: f64,
    seed: u64,
    /// Normal deviates used so far.
    drawn: u64,
    /// Noise of the latest window, in its deviations.
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

    /// What is to be found, in the search's unit; infinite if there is nothing.
    fn truth(&self) -> f64 {
        match self.case.curve {
            Curve::Still => f64::INFINITY,
            Curve::Hard | Curve::Logistic => self.threshold,
            // Rounded ratings exceed what is accepted from half a point above it on.
            Curve::Rated => {
                let accepted = f64::from(self.case.search.rating.unwrap_or(0));
                self.threshold + self.span * (accepted + 0.5) / 10.0
            }
        }
    }

    /// Movement without noise, degrees.
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

    /// The sensor's means around `deg`.
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

/// b of F = a·exp(b·I) from threshold to tolerable maximum, mean of Lee 2020, table 2.
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
