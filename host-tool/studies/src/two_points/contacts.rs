//! The contact that gives point B and the extensor's point the thresholds that a wearer
//! was found to have.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::voltages::{bent_deg, extended_deg};
use hal_sim::body::hand::Hand;
use hal_sim::body::hand::digits::VISIBLE_DEG;
use hal_sim::body::hand::spec::{B, E};

/// Between which factors of the skin's impedance a contact is looked for. Assumed: sites
/// of a wearer differ by as much as wearers do in the population's range, tenfold. It was
/// 0.3 to 3 before any draw was seen; of twelve draws at seed 7 none had one then.
const CONTACTS: [f64; 2] = [0.1, 10.0];
const BISECTIONS: u32 = 12;

/// Gives `hand` contacts under B and E at which it is visible from these volts on, the
/// worst that will do; `false` where none of the range does.
///
/// # Errors
/// Its circuit cannot be solved.
pub(super) fn fit(hand: &mut Hand, [b_v, e_v]: [f64; 2]) -> Result<bool, TwoPointsError> {
    let alone = Pattern::alone(B);
    let bends = |hand: &mut Hand| Ok(bent_deg(hand, alone, [b_v; 2])? >= VISIBLE_DEG);
    let extends = |hand: &mut Hand| Ok(extended_deg(hand, e_v)?.0 >= VISIBLE_DEG);
    Ok(bisect(hand, B, bends)? && bisect(hand, E, extends)?)
}

fn bisect(
    hand: &mut Hand,
    point: usize,
    is_visible: impl Fn(&mut Hand) -> Result<bool, TwoPointsError>,
) -> Result<bool, TwoPointsError> {
    let with = |hand: &Hand, contact: f64| {
        let mut spec = hand.spec().clone();
        spec.contact[point] = contact;
        let [a, b, e, _] = *hand.pads();
        let mut other = Hand::new(spec, [a, b, e])?;
        other.factor = hand.factor;
        Ok::<_, TwoPointsError>(other)
    };
    let [mut low, mut high] = CONTACTS;
    if !is_visible(&mut with(hand, low)?)? || is_visible(&mut with(hand, high)?)? {
        return Ok(false);
    }
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        match is_visible(&mut with(hand, middle)?)? {
            true => low = middle,
            false => high = middle,
        }
    }
    *hand = with(hand, low)?;
    Ok(true)
}
