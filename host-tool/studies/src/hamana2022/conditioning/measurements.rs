//! Further measurements on a wearer that could tell the mechanisms apart
//! (`hamana-participants.toml`).

use crate::hamana2022::TwoPointsError;
use crate::hamana2022::pattern::{PERIOD_US, Pattern, Points, WIDTH_US};
use crate::hamana2022::voltages::bent_deg_of;
use crate::hamana2022::wearers::Wearer;
use hal_sim::body::hand::digits::VISIBLE_DEG;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::body::hand::{Hand, Segment};

/// Phase difference at which two points know nothing of each other, µs.
const APART_US: u32 = 10_000;
/// Phase difference of the default pattern, µs.
const LATE_US: u32 = 2_000;
/// Widths whose thresholds are compared, µs.
const WIDTHS_US: [u32; 2] = [50, WIDTH_US];
/// Voltages at which the load is measured, V, and time within the pulse, s.
const LOADS_V: [f64; 2] = [8.0, 32.0];
const LOAD_AT_S: f64 = 100e-6;
/// Time from one pulse to the next of a pair, µs.
const INTERVAL_US: u32 = 1_000;
/// Range of voltages in which a threshold is searched, V, and number of bisections.
const VOLTS: [f64; 2] = [1.0, 400.0];
const BISECTIONS: u32 = 16;

/// Names of the measurements, in the order of [`measure`].
pub const NAMES: [&str; 7] = [
    "one-point-conducted",
    "two-points-conducted",
    "facilitation",
    "chronaxie",
    "load",
    "selectivity-gap",
    "short-interval",
];

/// Measures a wearer without noise; `None` where a quantity has no value.
///
/// # Errors
/// Fails if the circuit of the hand cannot be solved.
pub fn measure(wearer: &Wearer) -> Result<[Option<f64>; NAMES.len()], TwoPointsError> {
    let mut hand = wearer.hand.clone();
    let most_v = wearer.voltages.most_v;
    let mut respond =
        |points: Points, isolated: bool| hand.respond(&Pattern { points, isolated }.period(most_v));
    let apart = |after_us| Points::Two { first: A, after_us };
    let [a, b] = [
        respond(Points::One(A), true)?.index_nm(),
        respond(Points::One(B), true)?.index_nm(),
    ];
    let [a_conducted, b_conducted] = [
        respond(Points::One(A), false)?.index_nm(),
        respond(Points::One(B), false)?.index_nm(),
    ];
    let both = respond(apart(APART_US), true)?.index_nm();
    let both_conducted = respond(apart(APART_US), false)?.index_nm();
    let [zero, late] = [
        respond(apart(0), false)?.individuation(),
        respond(apart(LATE_US), false)?.individuation(),
    ];
    let thresholds = [
        threshold_v(&mut hand, WIDTHS_US[0])?,
        threshold_v(&mut hand, WIDTHS_US[1])?,
    ];
    let loads = [
        hand.load_at_ohm(A, (LOADS_V[0], LOAD_AT_S))?,
        hand.load_at_ohm(A, (LOADS_V[1], LOAD_AT_S))?,
    ];
    let [single, pair] = [
        hand.respond(&pulses(most_v[A], WIDTH_US, 1))?.index_nm(),
        hand.respond(&pulses(most_v[A], WIDTH_US, 2))?.index_nm(),
    ];
    let ratio = |above: f64, below: f64| {
        let is_positive = above > 0.0 && below > 0.0;
        is_positive.then(|| above / below)
    };
    let ratios = [ratio(a_conducted, a), ratio(b_conducted, b)];
    Ok([
        ratios[0].zip(ratios[1]).map(|(a, b)| (a * b).sqrt()),
        ratio(both_conducted, both),
        ratio(both, a + b),
        thresholds[0]
            .zip(thresholds[1])
            .and_then(|(short, long)| ratio(short, long)),
        ratio(loads[0], loads[1]),
        zero.zip(late).map(|(zero, late)| late - zero),
        ratio(pair, single),
    ])
}

/// Returns a period with `count` pulses of A, between which A is grounded and the others float.
fn pulses(volts: f64, width_us: u32, count: u32) -> Vec<Segment> {
    let segment = |terminal, lasts_us| Segment {
        terminals: [terminal, Terminal::Floating, Terminal::Floating],
        lasts_us,
    };
    let mut period = Vec::new();
    for number in 0..count {
        let until_us = match number + 1 == count {
            true => PERIOD_US,
            false => (number + 1) * INTERVAL_US,
        };
        period.push(segment(Terminal::Driven(-volts), width_us));
        let rest_us = until_us - number * INTERVAL_US - width_us;
        period.push(segment(Terminal::Grounded, rest_us));
    }
    period
}

/// Returns the voltage of A that visibly bends the index finger with pulses of this width, V; `None`
/// if no voltage in the range does.
fn threshold_v(hand: &mut Hand, width_us: u32) -> Result<Option<f64>, TwoPointsError> {
    let mut is_visible = |volts: f64| -> Result<bool, TwoPointsError> {
        Ok(bent_deg_of(hand, &pulses(volts, width_us, 1))? >= VISIBLE_DEG)
    };
    let [mut low, mut high] = VOLTS;
    if !is_visible(high)? {
        return Ok(None);
    }
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        match is_visible(middle)? {
            true => high = middle,
            false => low = middle,
        }
    }
    Ok(Some(high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hamana2022::conditioning::{Declaration, Mechanism};

    /// Measurements and changes of the model are those of the declaration, in its order.
    #[test]
    fn what_is_declared_is_measured() {
        let declaration = Declaration::load_embedded().unwrap();
        let measured = declaration.measurements.iter().map(|own| &*own.id);
        assert!(measured.eq(NAMES));
        let changes = Mechanism::ALL.into_iter().map(Mechanism::name);
        let changes = changes.filter(|name| !["default", "earlier"].contains(name));
        let declared = declaration.mechanisms.iter().map(|own| &*own.name);
        assert!(changes.eq(declared));
    }
}
