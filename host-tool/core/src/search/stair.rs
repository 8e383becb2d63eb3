//! Runs the ascending staircase: asks before each level, rests, stimulates, and evaluates the
//! answer.

use super::declaration::{Kind, Observer};
use super::milli::Milli;
use super::plan::Search;
use crate::statistics::Verdict;

/// A wearer on whom a search runs: simulated with a known threshold, on a simulator, or on a board.
pub trait Probe {
    /// Error that ends a search early.
    type Error;

    /// Asks before each presentation, repeats included, whether the level may be raised from `from`
    /// to `to`; `false` ends the search. A simulated wearer always agrees; on a board the operator
    /// is asked.
    ///
    /// # Errors
    /// Fails if the device fails or a signal interrupts the search.
    fn may_raise(&mut self, from: Milli, to: Milli) -> Result<bool, Self::Error>;

    /// Rests without stimulation for the declared time. With `has_baseline`, returns the mean angle
    /// in each of the last windows, °, as many as the baseline has; otherwise an empty list.
    ///
    /// # Errors
    /// Fails if the device fails or a signal interrupts the search.
    fn rest(&mut self, has_baseline: bool) -> Result<Vec<f64>, Self::Error>;

    /// Stimulates at `level` until the end of the last window. With `has_windows`, returns the mean
    /// angle in each window, °; otherwise an empty list.
    ///
    /// # Errors
    /// Fails if the device fails or a signal interrupts the search.
    fn present(&mut self, level: Milli, has_windows: bool) -> Result<Vec<f64>, Self::Error>;

    /// Returns the wearer's rating of `level`, which was presented last, 0 to 10.
    ///
    /// # Errors
    /// Fails if the device fails or a signal interrupts the search.
    fn rating(&mut self, level: Milli) -> Result<u8, Self::Error>;

    /// Returns whether the operator saw the joint move at `level`, which was presented last; `None`
    /// if the sensor decides.
    ///
    /// # Errors
    /// Fails if the device fails or a signal interrupts the search.
    fn observed_movement(&mut self, level: Milli) -> Result<Option<bool>, Self::Error>;

    /// Returns the number of pulses that were emitted so far.
    fn pulses(&self) -> u64;
}

/// Answer to one presentation: whether the joint moved, or how the wearer rated it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Answer {
    /// Decision of the movement detector.
    Measured(Verdict),
    /// Answer of the operator: whether the joint moved.
    Seen(bool),
    /// The wearer's rating, then the highest rating that still counts as accepted.
    Rated(u8, u8),
}

impl Answer {
    /// Returns whether the answer is positive: the joint moved, or the wearer rated the level as
    /// too high.
    #[must_use]
    pub fn is_positive(&self) -> bool {
        match self {
            Self::Measured(verdict) => verdict.is_movement(),
            Self::Seen(moved) => *moved,
            Self::Rated(rating, accepted) => rating > accepted,
        }
    }
}

/// One presentation of a level, with its answer.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// Level at which the wearer was stimulated.
    pub level: Milli,
    /// Number of earlier presentations of the same level.
    pub repeat: u32,
    /// Whether the joint moved, or how the wearer rated the level.
    pub answer: Answer,
    /// Number of pulses that the presentation needed.
    pub pulses: u64,
}

/// Reason why a search ended.
#[derive(Clone, PartialEq, Debug)]
pub enum SearchEnd<E> {
    /// A level with a confirmed positive answer was found.
    Found,
    /// The highest level was reached without a confirmed positive answer.
    Limit,
    /// The operator did not allow this level.
    Refused(Milli),
    /// The device failed, or a signal interrupted the search.
    Failed(E),
}

/// Result of a search, complete or not.
#[derive(Clone, PartialEq, Debug)]
pub struct Finding<E> {
    /// Estimate: the middle between `low` and `high`, which is the transition point of the method
    /// of limits (Gescheider 1997, ch. 3). `None` if nothing was found.
    pub value: Option<Milli>,
    /// Highest level with a negative answer; 0 if there is none. For comfort and maximum it is the
    /// highest level that the wearer accepted, and thus the level to set.
    pub low: Milli,
    /// Lowest level with a confirmed positive answer; `None` if there is none. For the other kinds
    /// of search it is the level to set.
    pub high: Option<Milli>,
    /// Number of pulses that the search needed.
    pub pulses: u64,
    /// All presentations in their order.
    pub trail: Vec<Step>,
    /// Reason why the search ended.
    pub ended: SearchEnd<E>,
}

impl<E> Finding<E> {
    /// Returns the level that should be set for the wearer: the highest accepted one for comfort
    /// and maximum, otherwise the lowest one that moves the joint. `None` if nothing was found or
    /// accepted.
    #[must_use]
    pub fn level_to_set(&self, search: &Search) -> Option<Milli> {
        match search.declaration().kind.is_rated() {
            true => self.high.and(Some(self.low)).filter(|low| low.0 > 0),
            false => self.high,
        }
    }
}

/// Raises the level on `probe` until a positive answer is confirmed, or the search ends otherwise.
/// `tell` is called after every presentation.
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
