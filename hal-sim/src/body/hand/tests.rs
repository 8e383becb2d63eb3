//! Tests of the whole hand: response to given terminal voltages.

use super::network::Terminal::{self, Driven, Floating, Grounded};
use super::spec::{A, B};
use super::*;
use crate::body::{Body, Drive, Lead, Load};

/// Returns a hand whose points lie over the two bellies of the index finger, with the middle of all
/// ranges. With its threshold factor, about 20 V cause a movement.
fn hand() -> Hand {
    let spec = HandSpec::nominal(0.42, 0.25, 7);
    let at = |along: f64, around: f64| {
        HandSpec::round_pad(along * spec.forearm_m, around * spec.around_m)
    };
    let points = [at(0.40, 0.03), at(0.66, 0.02), at(0.72, 0.45)];
    let mut hand = Hand::new(spec, points).unwrap();
    hand.factor = 300.0;
    hand
}

/// Returns `hand` in motion after `seconds` of `period` on channels 2, 5 and 0, advanced every
/// `every_us`.
fn moved(hand: &Hand, period: &[Segment], seconds: u64, every_us: u64) -> MovingHand {
    let channels = [2, 5, 0];
    let mut moving = MovingHand::new(hand, channels, 3).unwrap();
    let (mut at_us, mut asked_us) = (0, 0);
    while at_us < seconds * 1_000_000 {
        for segment in period {
            while asked_us + every_us < at_us {
                asked_us += every_us;
                moving.advance(asked_us);
            }
            for (channel, terminal) in channels.into_iter().zip(segment.terminals) {
                let lead = match terminal {
                    Driven(v) => Lead::Cathodic(Drive::Volts(-v)),
                    Grounded => Lead::Grounded,
                    Floating => Lead::Floating,
                };
                moving.set_lead(at_us, channel, lead);
            }
            at_us += u64::from(segment.lasts_us);
        }
    }
    moving.advance(at_us);
    moving
}

/// A hand that is at rest after its first period is not simulated again, and responds as if it were.
#[test]
fn a_hand_at_rest_repeats_itself() {
    let mut hand = hand();
    for terminal in [Driven(-22.0), Driven(-30.0), Driven(-40.0)] {
        for other in [Grounded, Floating] {
            let segment = |first, lasts_us| Segment {
                terminals: [first, other, Floating],
                lasts_us,
            };
            let period = [segment(terminal, 200), segment(Grounded, 19_800)];
            let short = hand.respond(&period).unwrap();
            assert_eq!(short, hand.respond_in_full(&period).unwrap());
        }
    }
}

/// Hands at the places of a solved forearm respond as hands that are solved alone.
#[test]
fn hands_of_places_are_those_of_their_electrodes() {
    let alone = hand();
    let [a, b, e, _] = *alone.pads();
    let spec = alone.spec().clone();
    let mut places = Places::new(&spec, vec![e, b, a]).unwrap();
    let coupled = HandSpec {
        coupling: [1.0, 1.5, 0.5],
        ..spec
    };
    for coupled in [alone.spec().clone(), coupled] {
        let mut alone = Hand::new(coupled.clone(), [a, b, e]).unwrap();
        let mut placed = places.hand(coupled, [2, 1, 0]).unwrap();
        (alone.factor, placed.factor) = (300.0, 300.0);
        for point in [A, B] {
            let period = period(&[(0, point, 24.0)]);
            let responses = [&mut alone, &mut placed].map(|hand| hand.respond(&period).unwrap());
            let [alone, placed] = responses.map(|response| response.index_nm());
            assert!(
                alone > 0.0 && (alone - placed).abs() < 1e-9,
                "{alone} {placed}"
            );
        }
    }
}

/// The estimated factor is that at which a pulse just bends the finger.
#[test]
fn a_factor_is_estimated_from_one_pulse() {
    let mut hand = hand();
    let period = period(&[(0, A, 24.0)]);
    let factor = hand.estimated_factor(&period[0], 5.0).unwrap().unwrap();
    let mut bends = |factor: f64| {
        hand.factor = factor;
        let deg = hand.respond(&period).unwrap().angles_deg()[digits::INDEX];
        deg - digits::REST_DEG[digits::INDEX] >= 5.0
    };
    assert!(bends(0.999 * factor) && !bends(1.001 * factor), "{factor}");
}

/// Without fatigue, a hand in motion reaches the steady response.
#[test]
fn a_moving_hand_comes_to_the_steady_response() {
    let mut spec = hand().spec().clone();
    spec.motion.fatigue_floor = 1.0;
    let [a, b, e, _] = *hand().pads();
    let mut hand = Hand::new(spec, [a, b, e]).unwrap();
    hand.factor = 300.0;
    let period = period(&[(0, A, 22.0)]);
    let steady = hand.respond(&period).unwrap();
    let moving = moved(&hand, &period, 2, 1_000);
    assert_eq!(moving.uncomputed_intervals(), 0);
    let [wanted, is] =
        [steady.angles_deg(), moving.angles_deg()].map(|values| values[digits::INDEX]);
    assert!(wanted > 20.0 && wanted < 95.0, "{wanted}");
    // The ripple of the muscles within 20 ms is present in the moving hand only.
    assert!((wanted - is).abs() < 2.0, "{wanted} {is}");
}

/// The interval between calls of `advance` has no effect, up to a control period.
#[test]
fn asking_more_often_changes_nothing() {
    let hand = hand();
    let period = period(&[(0, A, 24.0), (2_000, B, 20.0)]);
    let [seldom, often] = [20_000, 137].map(|every_us| moved(&hand, &period, 1, every_us));
    assert_eq!(seldom.angles_deg(), often.angles_deg());
    assert_eq!(seldom.torques(), often.torques());
    assert_eq!(seldom.sensed_deg(), often.sensed_deg());
}

/// A finger that is flexed for long sinks because its units fatigue, and lies still at its stop.
#[test]
fn fatigue_lets_a_bent_finger_sink() {
    let hand = hand();
    let period = period(&[(0, A, 24.0)]);
    let [early, late] = [2, 12].map(|seconds| moved(&hand, &period, seconds, 1_000));
    let [before, after] = [&early, &late].map(|moving_hand| moving_hand.angle_deg());
    assert!(before < 95.0 && after < 0.9 * before, "{before} {after}");
    assert!((0.5..0.8).contains(&late.least_capacity()));
}

/// An electrode that fell off carries no current.
#[test]
fn an_open_lead_moves_nothing() {
    let hand = hand();
    let mut moving = MovingHand::new(&hand, [0, 1, 2], 3).unwrap();
    moving.loads_mut()[0] = Load::Open;
    for at_us in (0..500_000).step_by(20_000) {
        moving.set_lead(at_us, 0, Lead::Cathodic(Drive::Volts(40.0)));
        moving.set_lead(at_us + 200, 0, Lead::Grounded);
        moving.advance(at_us + 20_000);
    }
    assert_eq!(moving.angles_deg(), digits::REST_DEG);
}

const REST: [Terminal; 3] = [Grounded, Grounded, Floating];

/// Returns a period with negative pulses of 200 µs: start in µs, point, and volts.
fn period(pulses: &[(u32, usize, f64)]) -> Vec<Segment> {
    let (mut segments, mut now_us) = (Vec::new(), 0);
    for &(begin_us, point, volts) in pulses {
        let mut driven = REST;
        driven[point] = Driven(-volts);
        for (terminals, until_us) in [(REST, begin_us), (driven, begin_us + 200)] {
            segments.push(Segment {
                terminals,
                lasts_us: until_us - now_us,
            });
            now_us = until_us;
        }
    }
    segments.push(Segment {
        terminals: REST,
        lasts_us: 20_000 - now_us,
    });
    segments.retain(|segment| segment.lasts_us > 0);
    segments
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

/// A nerve that spiked does not respond 2 ms later, but does 10 ms later.
#[test]
fn a_second_pulse_within_the_refractory_time_adds_nothing_at_the_same_point() {
    let mut hand = hand();
    let single = index_nm(&mut hand, &[(0, A, 30.0)]);
    let soon = index_nm(&mut hand, &[(0, A, 30.0), (2_000, A, 30.0)]);
    let late = index_nm(&mut hand, &[(0, A, 30.0), (10_000, A, 30.0)]);
    assert!((soon / single - 1.0).abs() < 0.02, "{single} {soon}");
    assert!(late > 1.05 * single, "{single} {late}");
}

/// Two points recruit the units of both or more; the test does not specify how many.
#[test]
fn two_points_pull_at_least_as_much_as_the_stronger() {
    let mut hand = hand();
    let [a, b] = [A, B].map(|point| index_nm(&mut hand, &[(0, point, 24.0)]));
    let pair = index_nm(&mut hand, &[(0, A, 24.0), (10_000, B, 24.0)]);
    assert!(pair >= a.max(b), "{a} {b} {pair}");
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

/// Every mechanism has an effect, so that its ablation changes the result: at 44 V, where the
/// limiter acts, or below it.
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
