//! Fits the coupling factors of point B and of the extensor's point to the known thresholds of a
//! wearer.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::voltages::{bent_deg, extended_deg};
use hal_sim::body::hand::Hand;
use hal_sim::body::hand::digits::VISIBLE_DEG;
use hal_sim::body::hand::spec::{B, E};

/// Range of coupling factors that is searched. Assumed, and wide: in the half-space model, two
/// places of a random forearm differ up to tenfold, whereas the thresholds of A and B in table 7
/// differ by less than half. The factors are fitted to thresholds only.
const COUPLINGS: [f64; 2] = [0.02, 50.0];
/// Number of steps of the coarse search that precedes the bisection. Bisection alone could miss the
/// weakest coupling: a stronger coupling also reaches other fingers, so it need not bend the index
/// finger further.
const LOOKS: u32 = 12;
const BISECTIONS: u32 = 12;

/// Sets the couplings of point B and of the extensor's point in `hand`. Each becomes the weakest
/// coupling that has a visible effect at `b_v` or `extensor_v`, V; `None` leaves it unchanged.
/// Returns `false` if no coupling in the range has this threshold.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub(super) fn fit(
    hand: &mut Hand,
    b_v: Option<f64>,
    extensor_v: Option<f64>,
) -> Result<bool, TwoPointsError> {
    let is_fitted = match b_v {
        None => true,
        Some(volts) => fit_flexor(hand, B, volts)?,
    };
    let Some(volts) = extensor_v.filter(|_| is_fitted) else {
        return Ok(is_fitted);
    };
    weakest(hand, E, |hand| {
        Ok(extended_deg(hand, volts)?.0 >= VISIBLE_DEG)
    })
}

/// Sets the coupling of `point`, A or B, as [`fit`] does.
///
/// # Errors
/// Fails if the hand's circuit cannot be solved.
pub(super) fn fit_flexor(
    hand: &mut Hand,
    point: usize,
    volts: f64,
) -> Result<bool, TwoPointsError> {
    let alone = Pattern::isolated_point(point);
    weakest(hand, point, |hand| {
        Ok(bent_deg(hand, alone, [volts; 2])? >= VISIBLE_DEG)
    })
}

fn weakest(
    hand: &mut Hand,
    point: usize,
    is_visible: impl Fn(&mut Hand) -> Result<bool, TwoPointsError>,
) -> Result<bool, TwoPointsError> {
    let [low, high] = COUPLINGS;
    let step = libm::pow(high / low, 1.0 / f64::from(LOOKS));
    hand.set_coupling(point, low);
    if is_visible(hand)? {
        return Ok(false);
    }
    let (mut low, mut high) = (low, low * step);
    for _ in 0..LOOKS {
        hand.set_coupling(point, high);
        if is_visible(hand)? {
            break;
        }
        (low, high) = (high, high * step);
    }
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        hand.set_coupling(point, middle);
        match is_visible(hand)? {
            true => high = middle,
            false => low = middle,
        }
    }
    hand.set_coupling(point, high);
    is_visible(hand)
}
