//! Runs the ascending staircase: asks before each level, rests, stimulates, and evaluates the
//! answer.

use super::declaration::{Kind, Observer};
use super::milli::Milli;
use super::plan::Search;
use host_core::statistics::Verdict;

/// The subject of a search: a simulated wearer with a known threshold, a simulator or a board.
pub trait Probe {
    /// Error that ends a search early.
    type Error;

    /// Asks before each presentation, repeats included, whether the level may be raised; `false`
    /// ends the search. A simulator agrees, a board's operator is asked.
    ///
    /// # Errors
    /// Fails if the device fails or a signal arrives.
    fn may_raise(&mut self, from: Milli, to: Milli) -> Result<bool, Self::Error>;

    /// Rests without stimulation for the configured time. Returns the sensor's mean over each of
    /// the last windows, as many as the baseline has, if `has_baseline`.
    ///
    /// # Errors
    /// Fails if the device fails or a signal arrives.
    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, Self::Error>;

    /// Stimulates at `level` until the end of the last window. Returns the sensor's mean over each
    /// window, if `has_windows`.
    ///
    /// # Errors
    /// Fails if the device fails or a signal arrives.
    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, Self::Error>;

    /// Returns the wearer's rating of the last level, 0 to 10.
    ///
    /// # Errors
    /// Fails if the device fails or a signal arrives.
    fn rating(&mut self, level: Milli) -> Result<u8, Self::Error>;

    /// Returns whether the operator saw the joint move; `None` if the sensor decides.
    ///
    /// # Errors
    /// Fails if the device fails or a signal arrives.
    fn observed_movement(&mut self, level: Milli) -> Result<Option<bool>, Self::Error>;

    /// Returns the number of pulses emitted so far.
    fn pulses(&self) -> u64;
}

/// Result of one presentation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Answer {
    /// Decision of the detector.
    Measured(Verdict),
    /// The operator's answer: whether the joint moved.
    Seen(bool),
    /// The wearer's rating, and the highest rating that is still accepted.
    Rated(u8, u8),
}

impl Answer {
    /// Returns whether the search found what it looks for.
    #[must_use]
    pub fn is_positive(&self) -> bool {
        match self {
            Self::Measured(verdict) => verdict.is_movement(),
            Self::Seen(moved) => *moved,
            Self::Rated(rating, accepted) => rating > accepted,
        }
    }
}

/// One presentation of a level.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// Stimulated level.
    pub level: Milli,
    /// Number of earlier presentations of this level.
    pub repeat: u32,
    /// Result of the presentation.
    pub answer: Answer,
    /// Pulses of the presentation.
    pub pulses: u64,
}

/// Reason why a search ended.
#[derive(Clone, PartialEq, Debug)]
pub enum SearchEnd<E> {
    /// The search found a level.
    Found,
    /// The search reached its limit and found nothing.
    Limit,
    /// The operator refused to raise to this level.
    Refused(Milli),
    /// The device failed, or a signal arrived.
    Failed(E),
}

/// Result of a search, complete or not.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding<E> {
    /// Estimate: the midpoint of the interval, which is the transition point of the method of
    /// limits (Gescheider 1997, ch. 3). `None` if nothing was found.
    pub value: Option<Milli>,
    /// Highest level with a negative answer; 0 if there is none. For comfort and maximum it is the
    /// highest accepted level, which is the one to set.
    pub low: Milli,
    /// Lowest level with a confirmed positive answer. For the other kinds it is the one to set.
    pub high: Option<Milli>,
    /// Number of pulses that the search needed.
    pub pulses: u64,
    /// All presentations in their order.
    pub trail: Vec<Step>,
    /// Reason why the search ended.
    pub ended: SearchEnd<E>,
}

impl<E> Finding<E> {
    /// Returns the level to set: the highest accepted one for comfort and maximum, otherwise the
    /// lowest one that moves the joint. `None` if nothing was found or accepted.
    #[must_use]
    pub fn level_to_set(&self, search: &Search) -> Option<Milli> {
        match search.declaration().kind.is_rated() {
            true => self.high.and(Some(self.low)).filter(|low| low.0 > 0),
            false => self.high,
        }
    }
}

/// Raises the level on `probe` until the quantity that `search` determines is found and confirmed;
/// calls `tell` after every presentation.
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
    // A level that was too high is never repeated for confirmation.
    let confirm = match search.declaration().kind {
        Kind::Maximum => 0,
        _ => search.declaration().confirm,
    };
    for level in search.levels() {
        let mut is_confirmed = true;
        for repeat in 0..=confirm {
            // A repeat starts from rest and needs permission as any other presentation does.
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
