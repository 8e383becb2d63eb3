//! Searches thresholds and largest voltages with the procedure of Hamana 2022 (III-A2, III-C1).

use super::error::TwoPointsError;
use super::pattern::{PERIOD_US, Pattern, WIDTH_US};
pub use hal_sim::body::hand::digits::SELECTIVE;
use hal_sim::body::hand::digits::{
    INDEX, REST_DEG, VISIBLE_DEG, WRIST_BARELY_EXTENDED, normalised,
};
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::pools::DIGITS;
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::hand::{Hand, Segment};
use serde::{Deserialize, Serialize};

/// Step by which the searches raise the voltage, V.
pub(super) const STEP_V: f64 = 2.0;
/// Largest voltage of the searches in random wearers, V. Assumed; the largest voltage in the paper
/// is 40 V.
pub(super) const MOST_V: f64 = 44.0;
/// Number of steps in which the ratio r rises to 1 (III-C1).
const RATIO_STEPS: u32 = 10;
/// Smallest and largest factor of all thresholds that [`calibrate`] considers.
const FACTOR_RANGE: [f64; 2] = [1e-9, 1e9];
/// Number of bisections of [`FACTOR_RANGE`] in [`calibrate`].
const BISECTIONS: u32 = 24;

/// Voltages of A and B that [`Voltages::search`] finds on one hand.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Voltages {
    /// Lowest voltages at A and B that visibly bend the index finger, V.
    pub threshold_v: [f64; 2],
    /// Highest voltages at A and B at which the index finger moves alone, V.
    pub most_v: [f64; 2],
    /// Smallest ratio r, from 0.1 to 1, such that [`Pattern::default_two_point`] visibly bends the
    /// index finger at r times both largest voltages; `None` if no ratio suffices.
    pub ratio: Option<f64>,
}

/// Returns how far the pattern bends the index finger from rest, °. `volts` are those of A and B.
pub(super) fn bent_deg(
    hand: &mut Hand,
    pattern: Pattern,
    volts: [f64; 2],
) -> Result<f64, TwoPointsError> {
    bent_deg_of(hand, &pattern.period(volts))
}

/// Returns how far a period bends the index finger from rest, °.
pub(super) fn bent_deg_of(hand: &mut Hand, period: &[Segment]) -> Result<f64, TwoPointsError> {
    Ok(hand.respond(period)?.angles_deg()[INDEX] - REST_DEG[INDEX])
}

/// Stimulates the extensor's point at `volts` while A and B float. Returns how far the index finger
/// extends from rest, °, and the force of the wrist's extensors as a fraction of their full force.
pub(super) fn extended_deg(hand: &mut Hand, volts: f64) -> Result<(f64, f64), TwoPointsError> {
    let segment = |terminal, lasts_us| {
        let mut terminals = [Terminal::Floating; 3];
        terminals[E] = terminal;
        Segment {
            terminals,
            lasts_us,
        }
    };
    let response = hand.respond(&[
        segment(Terminal::Driven(-volts), WIDTH_US),
        segment(Terminal::Grounded, PERIOD_US - WIDTH_US),
    ])?;
    let extended = REST_DEG[INDEX] - response.angles_deg()[INDEX];
    Ok((extended, response.wrist))
}

/// Searches threshold and largest voltage of the extensor's point up to `end_v`, V (Hamana 2022,
/// III-C1). The threshold is the lowest voltage that visibly extends the index finger; at the
/// largest voltage the wrist is still at most barely extended. Returns `None` if no voltage extends
/// the index finger, or if the wrist extends first.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub fn search_extensor(hand: &mut Hand, end_v: f64) -> Result<Option<[f64; 2]>, TwoPointsError> {
    let mut found: Option<[f64; 2]> = None;
    let mut volts = STEP_V;
    while volts <= end_v {
        let (extended, wrist) = extended_deg(hand, volts)?;
        if wrist > WRIST_BARELY_EXTENDED {
            break;
        }
        match &mut found {
            Some(found) => found[1] = volts,
            None if extended >= VISIBLE_DEG => found = Some([volts; 2]),
            None => {}
        }
        volts += STEP_V;
    }
    Ok(found)
}

/// Scales the thresholds of `hand` so that point A visibly bends the index finger from
/// `threshold_v` on, V.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub fn calibrate(hand: &mut Hand, threshold_v: f64) -> Result<(), TwoPointsError> {
    let [mut low, mut high] = FACTOR_RANGE;
    for _ in 0..BISECTIONS {
        hand.factor = (low * high).sqrt();
        match bent_deg(hand, Pattern::isolated_point(A), [threshold_v; 2])? >= VISIBLE_DEG {
            true => low = hand.factor,
            false => high = hand.factor,
        }
    }
    hand.factor = low;
    Ok(())
}

/// Largest relative distance of a factor that [`calibrate_fast`] takes from the exact one.
const NEAR: f64 = 1e-3;

/// Scales the thresholds of `hand` as [`calibrate`] does, to one part in a thousand: takes the
/// estimated factor if the finger moves visibly just below it and not just above it.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub(super) fn calibrate_fast(hand: &mut Hand, threshold_v: f64) -> Result<(), TwoPointsError> {
    let pattern = Pattern::isolated_point(A);
    let period = pattern.period([threshold_v; 2]);
    let estimated = period
        .first()
        .map(|pulse| hand.estimated_factor(pulse, VISIBLE_DEG))
        .transpose()?
        .flatten();
    if let Some(factor) = estimated {
        let mut is_visible = |factor: f64| -> Result<bool, TwoPointsError> {
            hand.factor = factor;
            Ok(bent_deg(hand, pattern, [threshold_v; 2])? >= VISIBLE_DEG)
        };
        let (below, above) = (factor * (1.0 - 0.5 * NEAR), factor * (1.0 + 0.5 * NEAR));
        if !is_visible(above)? && is_visible(below)? {
            return Ok(());
        }
    }
    calibrate(hand, threshold_v)
}

impl Voltages {
    /// Searches the voltages of points A and B up to `end_v`, V. Returns `None` if a point has no
    /// threshold: nothing moves visibly up to `end_v`, or the index finger does not move alone when
    /// it first moves.
    ///
    /// # Errors
    /// Fails if the hand's circuit cannot be solved.
    pub fn search(hand: &mut Hand, end_v: f64) -> Result<Option<Self>, TwoPointsError> {
        let mut voltages = [[0.0; 2]; 2];
        for point in [A, B] {
            let Some(found) = search_point(hand, point, end_v)? else {
                return Ok(None);
            };
            voltages[point] = found;
        }
        let most_v = voltages.map(|[_, most_v]| most_v);
        let mut ratio = None;
        for step in 1..=RATIO_STEPS {
            let r = f64::from(step) / f64::from(RATIO_STEPS);
            let bent = bent_deg(hand, Pattern::default_two_point(), most_v.map(|v| r * v))?;
            if bent >= VISIBLE_DEG {
                ratio = Some(r);
                break;
            }
        }
        Ok(Some(Self {
            threshold_v: voltages.map(|[threshold_v, _]| threshold_v),
            most_v,
            ratio,
        }))
    }
}

/// Response at one step of the search at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SearchStep {
    /// Voltage at the point, V.
    pub volts: f64,
    /// Flexion of the free digits above rest, as fractions of their ranges (equation 2).
    pub flexed: [f64; DIGITS],
    /// Individuation index (equation 1); `None` if the paper's rule excludes this step.
    pub individuation: Option<f64>,
}

/// Returns the response at every step of the search at `point` up to `end_v`, V, including steps
/// above the point's largest voltage.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub fn search_steps(
    hand: &mut Hand,
    point: usize,
    end_v: f64,
) -> Result<Vec<SearchStep>, TwoPointsError> {
    let (mut steps, mut volts) = (Vec::new(), STEP_V);
    while volts <= end_v {
        let response = hand.respond(&Pattern::isolated_point(point).period([volts; 2]))?;
        steps.push(SearchStep {
            volts,
            flexed: normalised(&response.angles_deg()),
            individuation: response.individuation(),
        });
        volts += STEP_V;
    }
    Ok(steps)
}

/// Returns whether the point alone visibly bends the index finger at `volts`, and whether the index
/// finger counts as moving alone.
pub(super) fn visible_and_alone(
    hand: &mut Hand,
    point: usize,
    volts: f64,
) -> Result<[bool; 2], TwoPointsError> {
    let response = hand.respond(&Pattern::isolated_point(point).period([volts; 2]))?;
    let bent = response.angles_deg()[INDEX] - REST_DEG[INDEX];
    let individuation = response.individuation();
    let is_alone = individuation.is_some_and(|index| index > SELECTIVE);
    Ok([bent >= VISIBLE_DEG, is_alone])
}

/// Returns the angle to which the point alone bends the index finger at `volts`, °.
pub(super) fn greatest_angle_deg(
    hand: &mut Hand,
    point: usize,
    volts: f64,
) -> Result<f64, TwoPointsError> {
    let bent = bent_deg(hand, Pattern::isolated_point(point), [volts; 2])?;
    Ok(REST_DEG[INDEX] + bent)
}

/// Searches threshold and largest voltage of one point up to `end_v`, V; `None` as in
/// [`Voltages::search`].
pub(super) fn search_point(
    hand: &mut Hand,
    point: usize,
    end_v: f64,
) -> Result<Option<[f64; 2]>, TwoPointsError> {
    let mut found: Option<[f64; 2]> = None;
    let mut volts = STEP_V;
    while volts <= end_v {
        let [is_visible, is_alone] = visible_and_alone(hand, point, volts)?;
        match &mut found {
            None if is_visible && is_alone => found = Some([volts; 2]),
            // The index finger moves visibly, but not alone.
            None if is_visible => return Ok(None),
            None => {}
            Some(found) if is_alone => found[1] = volts,
            Some(_) => break,
        }
        volts += STEP_V;
    }
    Ok(found)
}
