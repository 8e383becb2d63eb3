//! The coupling that gives point B and the extensor's point the thresholds that a wearer
//! was found to have.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::voltages::{bent_deg, extended_deg};
use hal_sim::body::hand::Hand;
use hal_sim::body::hand::digits::VISIBLE_DEG;
use hal_sim::body::hand::spec::{B, E};

/// Between which factors a coupling is looked for. Assumed, and wide: what the half-space
/// says of two places of a drawn forearm differs up to tenfold, where table 7's thresholds
/// of A and B differ by less than half. Nothing but thresholds is fitted by it.
const COUPLINGS: [f64; 2] = [0.02, 50.0];
/// Steps of the first look, for a stronger coupling need not bend a finger further: others
/// are reached as well.
const LOOKS: u32 = 12;
const BISECTIONS: u32 = 12;

/// Gives `hand` couplings of B and E at which each is visible from these volts on, where
/// they are known, the weakest that will do; `false` where none of the range does.
///
/// # Errors
/// Its circuit cannot be solved.
pub(super) fn fit(
    hand: &mut Hand,
    b_v: Option<f64>,
    extensor_v: Option<f64>,
) -> Result<bool, TwoPointsError> {
    let alone = Pattern::isolated_point(B);
    let is_fitted = match b_v {
        None => true,
        Some(volts) => weakest(hand, B, |hand| {
            Ok(bent_deg(hand, alone, [volts; 2])? >= VISIBLE_DEG)
        })?,
    };
    let Some(volts) = extensor_v.filter(|_| is_fitted) else {
        return Ok(is_fitted);
    };
    weakest(hand, E, |hand| {
        Ok(extended_deg(hand, volts)?.0 >= VISIBLE_DEG)
    })
}

fn weakest(
    hand: &mut Hand,
    point: usize,
    is_visible: impl Fn(&mut Hand) -> Result<bool, TwoPointsError>,
) -> Result<bool, TwoPointsError> {
    let [low, high] = COUPLINGS;
    let step = (high / low).powf(1.0 / f64::from(LOOKS));
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
