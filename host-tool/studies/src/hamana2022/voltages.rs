//! Thresholds and greatest voltages, found as Hamana 2022 found them (III-A2, III-C1).

use super::error::TwoPointsError;
use super::pattern::{PERIOD_US, Pattern, WIDTH_US};
use hal_sim::body::hand::digits::{INDEX, REST_DEG, VISIBLE_DEG, normalised};
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::pools::DIGITS;
use hal_sim::body::hand::spec::{A, B, E};
use hal_sim::body::hand::{Hand, Segment};
use serde::{Deserialize, Serialize};

/// Steps of the search, and its end, V: what the stimulator gives is assumed, for the
/// paper's greatest is 40 V.
pub(super) const STEP_V: f64 = 2.0;
pub(super) const MOST_V: f64 = 44.0;
/// Above this the index finger counts as alone (III-A2).
pub const SELECTIVE: f64 = 0.8;
/// Steps of r (III-C1).
const STEPS_OF_R: u32 = 10;
/// Part of the wrist's extensors at which it is barely extended. Assumed.
const BARELY: f64 = 0.1;
/// Between which factors of all thresholds a wearer's is looked for, and how closely.
const FACTORS: [f64; 2] = [1e-9, 1e9];
const BISECTIONS: u32 = 24;

/// What a search finds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Voltages {
    /// Lowest that visibly bends the index finger, at A and B, V.
    pub threshold_v: [f64; 2],
    /// Highest at which it is alone, V.
    pub most_v: [f64; 2],
    /// The least part of both at which the usual pattern visibly bends it.
    pub ratio: Option<f64>,
}

/// The index finger's angle above rest, °.
pub(super) fn bent_deg(
    hand: &mut Hand,
    pattern: Pattern,
    volts: [f64; 2],
) -> Result<f64, TwoPointsError> {
    let response = hand.respond(&pattern.period(volts))?;
    Ok(response.angles_deg()[INDEX] - REST_DEG[INDEX])
}

/// How far the extensor's point at these volts, the others floating, extends the index
/// finger, °; and what it makes of the wrist's extensors, as a part of all they have.
pub(super) fn extended_deg(hand: &mut Hand, volts: f64) -> Result<(f64, f64), TwoPointsError> {
    let with = |terminal, lasts_us| {
        let mut terminals = [Terminal::Floating; 3];
        terminals[E] = terminal;
        Segment {
            terminals,
            lasts_us,
        }
    };
    let response = hand.respond(&[
        with(Terminal::Driven(-volts), WIDTH_US),
        with(Terminal::Grounded, PERIOD_US - WIDTH_US),
    ])?;
    let extended = REST_DEG[INDEX] - response.angles_deg()[INDEX];
    Ok((extended, response.wrist))
}

/// Threshold and greatest voltage of the extensor's point, up to `end_v`: from where on it visibly
/// extends the index finger, and up to where the wrist is barely extended (Hamana 2022,
/// III-C1). `None` where nothing extends it, or the wrist comes first.
///
/// # Errors
/// Its circuit cannot be solved.
pub fn search_extensor(hand: &mut Hand, end_v: f64) -> Result<Option<[f64; 2]>, TwoPointsError> {
    let mut found: Option<[f64; 2]> = None;
    let mut volts = STEP_V;
    while volts <= end_v {
        let (extended, wrist) = extended_deg(hand, volts)?;
        if wrist > BARELY {
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

/// Makes `hand` one whose point A is visible from `threshold_v` on.
///
/// # Errors
/// Its circuit cannot be solved.
pub fn calibrate(hand: &mut Hand, threshold_v: f64) -> Result<(), TwoPointsError> {
    let [mut low, mut high] = FACTORS;
    for _ in 0..BISECTIONS {
        hand.factor = (low * high).sqrt();
        match bent_deg(hand, Pattern::alone(A), [threshold_v; 2])? >= VISIBLE_DEG {
            true => low = hand.factor,
            false => high = hand.factor,
        }
    }
    hand.factor = low;
    Ok(())
}

impl Voltages {
    /// Of this hand, up to `end_v`; `None` where a point has none: nothing moves up to the greatest
    /// voltage, or the index finger is not alone when it does.
    ///
    /// # Errors
    /// Its circuit cannot be solved.
    pub fn search(hand: &mut Hand, end_v: f64) -> Result<Option<Self>, TwoPointsError> {
        let mut found = [[0.0; 2]; 2];
        for point in [A, B] {
            let Some(of_point) = search_point(hand, point, end_v)? else {
                return Ok(None);
            };
            found[point] = of_point;
        }
        let most_v = found.map(|values| values[1]);
        let mut ratio = None;
        for step in 1..=STEPS_OF_R {
            let r = f64::from(step) / f64::from(STEPS_OF_R);
            let bent = bent_deg(hand, Pattern::usual(), most_v.map(|v| r * v))?;
            if bent >= VISIBLE_DEG {
                ratio = Some(r);
                break;
            }
        }
        Ok(Some(Self {
            threshold_v: found.map(|values| values[0]),
            most_v,
            ratio,
        }))
    }
}

/// A step of the search at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Searched {
    /// At the point, V.
    pub volts: f64,
    /// Free digits above rest, as parts of their ranges (equation 2).
    pub flexed: [f64; DIGITS],
    /// Equation 1; `None` where the index finger does not move.
    pub individuation: Option<f64>,
}

/// Every step of the search at `point` up to `end_v`, beyond its greatest voltage too.
///
/// # Errors
/// Its circuit cannot be solved.
pub fn searched(
    hand: &mut Hand,
    point: usize,
    end_v: f64,
) -> Result<Vec<Searched>, TwoPointsError> {
    let (mut all, mut volts) = (Vec::new(), STEP_V);
    while volts <= end_v {
        let response = hand.respond(&Pattern::alone(point).period([volts; 2]))?;
        all.push(Searched {
            volts,
            flexed: normalised(&response.angles_deg()),
            individuation: response.individuation(),
        });
        volts += STEP_V;
    }
    Ok(all)
}

/// Threshold and greatest voltage of one point.
fn search_point(
    hand: &mut Hand,
    point: usize,
    end_v: f64,
) -> Result<Option<[f64; 2]>, TwoPointsError> {
    let mut found: Option<[f64; 2]> = None;
    let mut volts = STEP_V;
    while volts <= end_v {
        let response = hand.respond(&Pattern::alone(point).period([volts; 2]))?;
        let bent = response.angles_deg()[INDEX] - REST_DEG[INDEX];
        let is_visible = bent >= VISIBLE_DEG;
        let is_alone = response
            .individuation()
            .is_some_and(|individuation| individuation > SELECTIVE);
        match &mut found {
            None if is_visible && is_alone => found = Some([volts; 2]),
            // It is visible, but others move too.
            None if is_visible => return Ok(None),
            None => {}
            Some(found) if is_alone => found[1] = volts,
            Some(_) => break,
        }
        volts += STEP_V;
    }
    Ok(found)
}
