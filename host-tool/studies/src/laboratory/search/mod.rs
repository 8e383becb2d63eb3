//! Judges searches on simulated wearers whose true threshold is known: how often a search is wrong,
//! and by how much.

use hal_sim::random::{standard_normal, unit};
use host_core::search::{
    Finding, Milli, Probe, Rating, Search, SearchDeclaration, SearchEnd, search,
};
use serde::Deserialize;
use std::convert::Infallible;

/// Text of the preregistered declaration of the judged searches: parameters, sources and seeds.
pub const JUDGED: &str = include_str!("judged.toml");

/// How a simulated wearer responds to a level of stimulation.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curve {
    /// No movement at any level.
    Still,
    /// The joint does not move up to the threshold; above it the movement rises exponentially (Lee
    /// 2020, table 2).
    Hard,
    /// The movement is a logistic function of the level. The threshold is the level at which the
    /// movement reaches `visible_deg`.
    Logistic,
    /// The joint does not move. The wearer rates levels linearly, from 0 at `threshold` to 10 at
    /// `span` above it.
    Rated,
}

/// Random wearers on whom a search is judged. Their parameters are uniform between both ends of
/// each range.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Readable name of the case, for tables.
    pub name: String,
    /// How the wearers respond to a level.
    pub curve: Curve,
    /// Range of the true threshold, in the unit of the search's levels.
    pub threshold: [f64; 2],
    /// Range of the distance from the threshold to the level of full movement, in the unit of the
    /// levels. For a logistic curve, the range of its width.
    pub span: [f64; 2],
    /// Largest movement of the joint, °.
    pub full_deg: f64,
    /// Range of the noise at rest: standard deviation of a window's mean angle, °, or of a rating,
    /// points. Uniform in the logarithm.
    pub noise: [f64; 2],
    /// Correlation between the noise of successive windows, 0 to below 1.
    pub correlation: f64,
    /// Range of the coefficient of variation with which the movement varies between presentations
    /// of one level.
    pub contraction: [f64; 2],
    /// Pulse rate of all channels together, Hz; it determines how many pulses a search needs.
    pub pulses_hz: f64,
    /// Source of these values: a publication, or "assumed".
    pub source: String,
    /// The search that is judged on these wearers.
    pub search: SearchDeclaration,
}

/// All cases of a judged run; the searches of every case use the same seeds.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchCases {
    /// Seed of the first search; each further search uses the next number.
    pub first_seed: u64,
    /// Number of searches per case.
    pub searches: u64,
    /// Kinds of random wearer, at least one, each with its search.
    #[serde(rename = "case")]
    pub cases: Vec<Case>,
}

impl SearchCases {
    /// Parses a declaration of judged searches.
    ///
    /// # Errors
    /// Returns the first mistake in the text.
    pub fn parse(text: &str) -> Result<Self, toml::de::Error> {
        toml::from_str(text)
    }
}

/// Results over all searches of one case.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct SearchCounts {
    /// Number of searches, one per random wearer.
    pub searches: u64,
    /// Number of searches with a positive answer more than one step below the true threshold.
    pub early: u64,
    /// Number of searches with a negative answer more than one step above the true threshold,
    /// although the threshold is at least one step below the highest level. For ratings, a negative
    /// answer means that the wearer accepted the level.
    pub missed: u64,
    /// Number of searches whose true threshold is at least one step below the highest level.
    pub findable: u64,
    /// Number of findable searches that found a value within one step of the true threshold.
    pub within: u64,
    /// Number of findable searches whose interval contains the true threshold.
    pub covered: u64,
    /// Largest distance of a findable search's value from the true threshold, in steps between
    /// levels.
    pub worst_steps: f64,
    /// Total number of pulses in all searches.
    pub pulses: u64,
    /// Total number of presentations in all searches.
    pub presentations: u64,
}

impl SearchCounts {
    /// Returns the share of wrong searches, early or missed, 0 to 1.
    #[must_use]
    pub fn false_share(&self) -> f64 {
        (self.early + self.missed) as f64 / self.searches.max(1) as f64
    }

    /// Returns the share of findable searches whose value is within one step of the true threshold,
    /// 0 to 1.
    #[must_use]
    pub fn within_share(&self) -> f64 {
        self.within as f64 / self.findable.max(1) as f64
    }
}

/// Runs the search of `case` on `searches` random wearers, with seeds from `first_seed` on.
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
    /// Number of normal random numbers generated so far, from which the next one follows.
    drawn: u64,
    /// Noise in the latest window, in standard deviations; the next window's noise is correlated
    /// with it.
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
            noise: libm::exp(between(2, case.noise.map(libm::log))),
            contraction: between(3, case.contraction),
            seed,
            drawn: 8,
            latest: 0.0,
            pulses: 0,
        }
    }

    /// Returns the true threshold in the unit of the levels; infinite if the wearer has none.
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

    /// Returns the movement at a level without noise, °.
    fn movement(&self, level: f64) -> f64 {
        let full = self.case.full_deg;
        match self.case.curve {
            Curve::Still | Curve::Rated => 0.0,
            Curve::Hard => {
                let x = ((level - self.threshold) / self.span).clamp(0.0, 1.0);
                full * libm::expm1(CURVATURE * x) / libm::expm1(CURVATURE)
            }
            Curve::Logistic => {
                let visible = self.case.search.visible_deg.unwrap_or(1.0);
                let middle = self.threshold + self.span * libm::log(full / visible - 1.0);
                full / (1.0 + libm::exp((middle - level) / self.span))
            }
        }
    }

    fn normal(&mut self) -> f64 {
        self.drawn += 1;
        standard_normal(self.seed, self.drawn)
    }

    /// Returns the mean angles of `count` windows: `deg` plus correlated noise, °.
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

/// Exponent b of the recruitment curve F = a·exp(b·I), where I goes from 0 at the threshold to 1 at
/// the tolerable maximum. Mean of Lee 2020, table 2.
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
