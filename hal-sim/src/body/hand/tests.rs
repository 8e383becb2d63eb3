//! A whole hand: what currents make of it.

use super::network::Terminal::{self, Driven, Floating, Grounded};
use super::spec::{A, B};
use super::*;

/// A hand whose points lie over the index finger's two bellies, in the middle of all
/// ranges. Thresholds such that some 20 V move something.
fn hand() -> Hand {
    let spec = HandSpec::nominal(0.42, 0.25, 7);
    let at =
        |along: f64, around: f64| HandSpec::round(along * spec.forearm_m, around * spec.around_m);
    let points = [at(0.40, 0.03), at(0.66, 0.02), at(0.72, 0.45)];
    let mut hand = Hand::new(spec, points).unwrap();
    hand.factor = 300.0;
    hand
}

const REST: [Terminal; 3] = [Grounded, Grounded, Floating];

/// Negative pulses of 200 µs: when each point's begins, and its volts.
fn period(pulses: &[(u32, usize, f64)]) -> Vec<Segment> {
    let (mut all, mut now_us) = (Vec::new(), 0);
    for &(begin_us, point, volts) in pulses {
        let mut driven = REST;
        driven[point] = Driven(-volts);
        for (terminals, until_us) in [(REST, begin_us), (driven, begin_us + 200)] {
            all.push(Segment {
                terminals,
                lasts_us: until_us - now_us,
            });
            now_us = until_us;
        }
    }
    all.push(Segment {
        terminals: REST,
        lasts_us: 20_000 - now_us,
    });
    all.retain(|segment| segment.lasts_us > 0);
    all
}

fn index_nm(hand: &mut Hand, pulses: &[(u32, usize, f64)]) -> f64 {
    hand.respond(&period(pulses)).unwrap().index_nm()
}

#[test]
fn more_volts_never_pull_less() {
    let mut hand = hand();
    let torques: Vec<f64> = (0..12)
        .map(|step| index_nm(&mut hand, &[(0, A, 4.0 * f64::from(step))]))
        .collect();
    assert_eq!(torques[0], 0.0);
    assert!(torques.is_sorted(), "{torques:?}");
    assert!(torques[11] > 0.05, "{torques:?}");
}

/// A nerve that spiked does not answer 2 ms later; it does 10 ms later.
#[test]
fn a_second_pulse_within_the_refractory_time_adds_nothing_at_the_same_point() {
    let mut hand = hand();
    let one = index_nm(&mut hand, &[(0, A, 30.0)]);
    let soon = index_nm(&mut hand, &[(0, A, 30.0), (2_000, A, 30.0)]);
    let late = index_nm(&mut hand, &[(0, A, 30.0), (10_000, A, 30.0)]);
    assert!((soon / one - 1.0).abs() < 0.02, "{one} {soon}");
    assert!(late > 1.05 * one, "{one} {late}");
}

/// Two points recruit what each does, and more; nothing here says how much.
#[test]
fn two_points_pull_at_least_as_much_as_the_stronger() {
    let mut hand = hand();
    let [a, b] = [A, B].map(|point| index_nm(&mut hand, &[(0, point, 24.0)]));
    let both = index_nm(&mut hand, &[(0, A, 24.0), (10_000, B, 24.0)]);
    assert!(both >= a.max(b), "{a} {b} {both}");
}

#[test]
fn skin_that_moves_back_is_where_it_was() {
    let mut hand = hand();
    let before = index_nm(&mut hand, &[(0, A, 24.0)]);
    hand.shift(90.0, [0.001, 0.0]);
    assert_ne!(index_nm(&mut hand, &[(0, A, 24.0)]), before);
    hand.shift(0.0, [0.0; 2]);
    assert_eq!(index_nm(&mut hand, &[(0, A, 24.0)]), before);
}

/// Each mechanism does something, so that an ablation takes something away: at 44 V, where
/// the limiter holds, or below it.
#[test]
fn each_mechanism_changes_what_is_recruited() {
    let base = hand();
    let at = |volts: f64, spec: &dyn Fn(&mut HandSpec)| {
        let mut changed = base.spec().clone();
        spec(&mut changed);
        let [a, b, e, _] = *base.pads();
        let mut hand = Hand::new(changed, [a, b, e]).unwrap();
        hand.factor = base.factor;
        let pulses = [(0, A, volts), (1_000, B, volts)];
        hand.respond(&period(&pulses)).unwrap().torques.flexors_nm
    };
    let [low, high] = [16.0, 44.0].map(|volts| at(volts, &|_| ()));
    assert_ne!(at(16.0, &|s| s.skin.farad_per_cm2 = 0.0), low);
    assert_ne!(at(44.0, &|s| s.limiter_a = f64::INFINITY), high);
    assert_ne!(at(16.0, &|s| s.skin.half_a_per_cm2 = f64::INFINITY), low);
    assert_ne!(at(16.0, &|s| s.return_factor = 27.0), low);
    assert_ne!(at(16.0, &|s| s.rule = Rule::Potential), low);
}
