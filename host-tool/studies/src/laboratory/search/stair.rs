//! The ascending stair: level by level, each asked for, rested for and answered.

use super::declaration::{Kind, Observer};
use super::milli::Milli;
use super::plan::Search;
use host_core::statistics::Verdict;

/// Whom a search is made on: declared numbers, a simulator or a board.
pub trait Probe {
    /// What ends a search early.
    type Error;

    /// Asked before each presentation, repeats included; what refuses ends the search. A simulator agrees by itself, a board's operator is
    /// asked.
    ///
    /// # Errors
    /// The device or a signal.
    fn may_raise(&mut self, from: Milli, to: Milli) -> Result<bool, Self::Error>;

    /// Rests as declared, nothing stimulated; gives the sensor's means over the last
    /// windows, as many as the baseline has, if `has_baseline`.
    ///
    /// # Errors
    /// The device or a signal.
    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, Self::Error>;

    /// Stimulates at `level` until the last window is over; gives the sensor's means
    /// over the windows, if `has_windows`.
    ///
    /// # Errors
    /// The device or a signal.
    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, Self::Error>;

    /// What the person says of the level just given, 0 to 10.
    ///
    /// # Errors
    /// The device or a signal.
    fn rating(&mut self, level: Milli) -> Result<u8, Self::Error>;

    /// Whether who watches saw the joint move; nothing where the sensor decides.
    ///
    /// # Errors
    /// The device or a signal.
    fn observed_movement(&mut self, level: Milli) -> Result<Option<bool>, Self::Error>;

    /// Pulses given so far.
    fn pulses(&self) -> u64;
}

/// What came of one presentation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Answer {
    /// The detector's.
    Measured(Verdict),
    /// The operator's: whether it moved.
    Seen(bool),
    /// The person's, and the highest that is still accepted.
    Rated(u8, u8),
}

impl Answer {
    /// Whether that is what the search looks for.
    #[must_use]
    pub fn is_positive(&self) -> bool {
        match self {
            Self::Measured(verdict) => verdict.is_movement(),
            Self::Seen(moved) => *moved,
            Self::Rated(rating, accepted) => rating > accepted,
        }
    }
}

/// One presentation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// Its level.
    pub level: Milli,
    /// How often the level was given before.
    pub repeat: u32,
    /// What was said of it.
    pub answer: Answer,
    /// Its pulses.
    pub pulses: u64,
}

/// Why a search ended.
#[derive(Clone, PartialEq, Debug)]
pub enum SearchEnd<E> {
    /// It found what it looked for.
    Found,
    /// It came to its limit and found nothing.
    Limit,
    /// Going up to this level was not allowed.
    Refused(Milli),
    /// The device, or a signal.
    Failed(E),
}

/// What a search found, complete or not.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding<E> {
    /// Estimate: the middle of the interval, the transition point of the method of
    /// limits (Gescheider 1997, ch. 3). Nothing if it was not found.
    pub value: Option<Milli>,
    /// Highest level at which it was not; 0 if there is none. Of comfort and maximum:
    /// the highest accepted, the one to set.
    pub low: Milli,
    /// Lowest level at which it was, confirmed. Of the others the one to set.
    pub high: Option<Milli>,
    /// Cost.
    pub pulses: u64,
    /// Every presentation.
    pub trail: Vec<Step>,
    /// Why it ended.
    pub ended: SearchEnd<E>,
}

impl<E> Finding<E> {
    /// The level to set: of comfort and maximum the highest accepted, of the others
    /// the lowest that moves. Nothing if it was not found, or nothing was accepted.
    #[must_use]
    pub fn level_to_set(&self, search: &Search) -> Option<Milli> {
        match search.declaration().kind.is_rated() {
            true => self.high.and(Some(self.low)).filter(|low| low.0 > 0),
            false => self.high,
        }
    }
}

/// Climbs `search`'s levels on `probe` until what it looks for is found and
/// confirmed; `tell` hears every presentation.
pub fn search<P: Probe>(
    search: &Search,
    probe: &mut P,
    mut tell: impl FnMut(&Step),
) -> Finding<P::Error> {
    let before = probe.pulses();
    let mut finding = Finding {
        value: None,
        low: Milli(0),
        high: None,
        pulses: 0,
        trail: Vec::new(),
        ended: SearchEnd::Limit,
    };
    finding.ended = climb(search, probe, &mut finding, &mut tell).unwrap_or_else(SearchEnd::Failed);
    finding.pulses = probe.pulses() - before;
    let low = finding.low;
    finding.value = finding.high.map(|high| Milli(low.0 + (high.0 - low.0) / 2));
    finding
}

fn climb<P: Probe>(
    search: &Search,
    probe: &mut P,
    finding: &mut Finding<P::Error>,
    tell: &mut impl FnMut(&Step),
) -> Result<SearchEnd<P::Error>, P::Error> {
    // What was too much is not given again to be sure of it.
    let confirm = match search.declaration().kind {
        Kind::Maximum => 0,
        _ => search.declaration().confirm,
    };
    for level in search.levels() {
        let mut is_confirmed = true;
        for repeat in 0..=confirm {
            // A repeat begins from rest, and is allowed like any other.
            let from = if repeat == 0 { finding.low } else { Milli(0) };
            if !probe.may_raise(from, level)? {
                return Ok(SearchEnd::Refused(level));
            }
            let pulses = probe.pulses();
            let answer = answer(search, probe, level)?;
            let step = Step {
                level,
                repeat,
                answer,
                pulses: probe.pulses() - pulses,
            };
            tell(&step);
            finding.trail.push(step);
            is_confirmed = answer.is_positive();
            if !is_confirmed {
                break;
            }
        }
        if is_confirmed {
            finding.high = Some(level);
            return Ok(SearchEnd::Found);
        }
        finding.low = level;
    }
    Ok(SearchEnd::Limit)
}

fn answer<P: Probe>(search: &Search, probe: &mut P, level: Milli) -> Result<Answer, P::Error> {
    let declared = search.declaration();
    let is_measured = declared.needs_baseline();
    let baseline = probe.rest(is_measured)?;
    let windows = probe.present(level, is_measured)?;
    if let Some(accepted) = declared.rating {
        return Ok(Answer::Rated(probe.rating(level)?, accepted));
    }
    if declared.observer == Observer::Eye
        && let Some(moved) = probe.observed_movement(level)?
    {
        return Ok(Answer::Seen(moved));
    }
    let verdict = declared.detector().judge(&baseline, &windows);
    Ok(Answer::Measured(verdict))
}
