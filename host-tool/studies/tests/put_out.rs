//! Compares the whole device's output to a hand with the intended pulses.

use hal_sim::body::hand::digits::INDEX;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::{FittedHand, Hand, MovingHand, Segment};
use hal_sim::body::{Body, Drive, Lead};
use host_core::run::DeviceName;
use host_core::session::{BodySpec, Session};
use studies::hamana2022::{Pattern, driven_v};

const SHOWN: &str = include_str!("../../sessions/hamana_exp4_two_point.toml");
/// Voltages of A and B of the wearer in the session, V.
const VOLTS: [f64; 2] = [30.0, 34.0];

fn shown() -> FittedHand {
    match Session::parse("shown.toml", SHOWN).unwrap().body {
        Some(BodySpec::Hand(hand)) => *hand,
        other => panic!("{other:?}"),
    }
}

/// All 29 patterns at the converter's exact voltages drive the same terminals at the same µs,
/// except that a point floats before its own pulse, because a device no longer grounds it. The
/// spikes of this forearm, and thus torques and angles, are bit-identical.
#[test]
fn a_device_puts_out_what_the_body_alone_is_given() {
    let fitted = shown();
    let mut hand = Hand::new(fitted.spec, fitted.points).unwrap();
    hand.factor = fitted.factor;
    for pattern in Pattern::all_two_point()
        .into_iter()
        .chain(Pattern::all_one_point())
    {
        let words = pattern.in_words();
        let put_out = pattern.play_on_device(VOLTS, &DeviceName::Native).unwrap();
        assert_eq!(pattern.find_difference(&put_out, VOLTS), None, "{words}");
        let device = hand.respond(&put_out).unwrap();
        let body = hand.respond(&pattern.period(driven_v(&put_out))).unwrap();
        assert_eq!(device, body, "{words}");
    }
}

/// Differences are reported.
#[test]
fn another_pattern_is_not_taken_for_it() {
    let usual = Pattern::default_two_point();
    let alone = Pattern::isolated_point(0)
        .play_on_device(VOLTS, &DeviceName::Native)
        .unwrap();
    assert!(
        usual
            .find_difference(&alone, VOLTS)
            .unwrap()
            .contains(" V instead of ")
    );
    let put_out = usual.play_on_device(VOLTS, &DeviceName::Native).unwrap();
    assert!(usual.find_difference(&put_out, [30.1, 34.0]).is_some());
    let isolated = Pattern {
        isolated: true,
        ..usual
    };
    let told = isolated.find_difference(&put_out, VOLTS).unwrap();
    assert!(told.contains("µs"), "{told}");
}

fn feel(hand: &mut MovingHand, channels: [usize; 3], period: &[Segment], periods: u64) {
    let mut at_us = 0;
    for segment in (0..periods).flat_map(|_| period) {
        for (channel, terminal) in channels.into_iter().zip(segment.terminals) {
            let lead = match terminal {
                Terminal::Driven(v) => Lead::Cathodic(Drive::Volts(-v)),
                Terminal::Grounded => Lead::Grounded,
                Terminal::Floating => Lead::Floating,
            };
            hand.set_lead(at_us, channel, lead);
        }
        at_us += u64::from(segment.lasts_us);
        hand.advance(at_us);
    }
}

/// Without fatigue, a moving hand reaches the same angle under three seconds of the device's pulses
/// as under the pattern alone.
#[test]
fn a_hand_in_motion_comes_to_the_same_angle() {
    let mut fitted = shown();
    fitted.spec.motion.fatigue_floor = 1.0;
    let mut hand = Hand::new(fitted.spec.clone(), fitted.points).unwrap();
    hand.factor = fitted.factor;
    for pattern in [
        Pattern::default_two_point(),
        Pattern::isolated_point(0),
        Pattern::all_one_point()[0],
    ] {
        let put_out = pattern.play_on_device(VOLTS, &DeviceName::Native).unwrap();
        let period = pattern.period(driven_v(&put_out));
        let angles = [&put_out, &period].map(|period| {
            let mut moving = fitted.to_moving_hand(1).unwrap();
            feel(&mut moving, fitted.channels, period, 150);
            assert_eq!(moving.uncomputed_intervals(), 0);
            moving.angle_deg()
        });
        assert_eq!(angles[0].to_bits(), angles[1].to_bits(), "{angles:?}");
        let steady = hand.respond(&period).unwrap().angles_deg()[INDEX];
        assert!((angles[0] - steady).abs() < 1e-3, "{angles:?} {steady}");
    }
}
