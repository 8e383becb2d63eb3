//! The simulated finger as a simulator uses it: pulses in, angle out.

use hal_sim::body::finger::Pair;
use hal_sim::body::wearer::Participant;
use hal_sim::body::{Body, Drive, Finger, FingerSpec, FixedLoad, InvalidSpec, Load, Pulse};

fn spec() -> FingerSpec {
    FingerSpec::participant(Participant::P)
}

/// Returns a finger whose two conducted points pull 0.5 N·m by its parameters.
fn paired() -> FingerSpec {
    let pair = Pair {
        torque_nm: [0.5, 0.22],
        threshold_v: Participant::P.pair_thresholds_v(),
    };
    FingerSpec {
        pair: Some(pair),
        ..spec()
    }
}

fn noiseless() -> FingerSpec {
    FingerSpec {
        sensor_noise_deg: 0.0,
        ..spec()
    }
}

fn pulse(t_us: u64, channel: usize, volts: f64, conducted: bool) -> Pulse {
    Pulse {
        t_us,
        channel,
        drive: Drive::Volts(volts),
        width_us: 200,
        conducted,
    }
}

/// Stimulates at 50 Hz on `channels` (channel, volts) for `seconds`; the second channel follows 2
/// ms after the first.
fn hold(finger: &mut Finger, channels: &[(usize, f64)], seconds: u64, conducted: bool) {
    for period in 0..50 * seconds {
        let t_us = period * 20_000;
        for (i, (channel, volts)) in channels.iter().enumerate() {
            finger.pulse(&pulse(t_us + 2000 * i as u64, *channel, *volts, conducted));
        }
        finger.advance(t_us + 20_000);
    }
}

/// Returns the isometric torque after two seconds, averaged over one period to remove ripple.
fn torque(spec: FingerSpec, channels: &[(usize, f64)], conducted: bool) -> f64 {
    let isometric = FingerSpec {
        stiffness_nm_per_rad: 1e4,
        damping_nm_s_per_rad: 10.0,
        ..spec
    };
    let mut finger = Finger::new(isometric, 0).unwrap();
    hold(&mut finger, channels, 2, conducted);
    for (i, (channel, volts)) in channels.iter().enumerate() {
        let t_us = 2_000_000 + 2000 * i as u64;
        finger.pulse(&pulse(t_us, *channel, *volts, conducted));
    }
    let mut sum = 0.0;
    for ms in 1..=20 {
        finger.advance(2_000_000 + 1000 * ms);
        sum += finger.torque_nm();
    }
    sum / 20.0
}

#[test]
fn a_relaxed_finger_stays_at_rest() {
    let mut finger = Finger::new(noiseless(), 0).unwrap();
    finger.advance(10_000_000);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
    assert_eq!(finger.sensed_deg(), 5.0);
}

#[test]
fn a_torque_from_outside_bends_the_finger_against_its_stiffness() {
    let mut finger = Finger::new(noiseless(), 0).unwrap();
    finger.set_external_torque(0.06);
    finger.advance(5_000_000);
    // 0.06 N·m over 0.12 N·m/rad is 0.5 rad beyond the rest angle of 5°.
    let bent = 5.0 + 0.5f64.to_degrees();
    assert!((finger.angle_deg() - bent).abs() < 1e-6);
    finger.set_external_torque(0.0);
    finger.advance(10_000_000);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-6);
}

#[test]
fn one_point_at_maximum_just_reaches_the_experiments_85_degrees() {
    for channel in [(0, 28.0), (1, 36.0)] {
        let mut finger = Finger::new(spec(), 0).unwrap();
        hold(&mut finger, &[channel], 4, true);
        let angle = finger.angle_deg();
        println!("channel {}: {angle:.1} degrees", channel.0);
        assert!((85.0..90.0).contains(&angle), "{angle}");
    }
}

#[test]
fn below_threshold_nothing_moves() {
    let mut finger = Finger::new(spec(), 0).unwrap();
    hold(&mut finger, &[(0, 24.0), (2, 14.0)], 2, true);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
    // With both flexor points at the threshold of the pair there is still no torque.
    let mut finger = Finger::new(paired(), 0).unwrap();
    let [a, b] = Participant::P.pair_thresholds_v();
    hold(&mut finger, &[(0, a), (1, b)], 2, true);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
    // Between this threshold and the single threshold only a finger with a configured pair
    // responds.
    let below = [(0, 23.0), (1, 27.0)];
    let mut finger = Finger::new(paired(), 0).unwrap();
    hold(&mut finger, &below, 2, true);
    assert!(finger.angle_deg() > 20.0, "{}", finger.angle_deg());
    let mut finger = Finger::new(spec(), 0).unwrap();
    hold(&mut finger, &below, 2, true);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
}

#[test]
fn a_rounding_error_at_the_threshold_changes_nothing() {
    // Controllers rest the antagonist exactly on its threshold, and a DAC rounds, so the relaxation
    // must not differ between the two sides of it.
    let relaxing = |volts: f64| {
        let mut finger = Finger::new(spec(), 0).unwrap();
        hold(&mut finger, &[(0, 28.0)], 1, true);
        for period in 50..60 {
            finger.pulse(&pulse(20_000 * period, 0, volts, true));
            finger.advance(20_000 * (period + 1));
        }
        finger.angle_deg()
    };
    assert!((relaxing(24.0 - 1e-9) - relaxing(24.0 + 1e-9)).abs() < 1e-6);
}

#[test]
fn two_points_pull_as_one_unless_the_scene_says_what_they_pull() {
    let points = [(0, 28.0), (1, 36.0)];
    let single = torque(spec(), &points[..1], true);
    let unsaid = torque(spec(), &points, true);
    let pair = torque(paired(), &points, true);
    let isolated = torque(paired(), &points, false);
    println!("torque: one {single:.4}, pair {pair:.4}, isolated {isolated:.4} N·m");
    // At rest, 5 of 100 degrees, a muscle has lost 1.25 % of its torque.
    assert!((single / (0.22 * 0.9875) - 1.0).abs() < 0.001, "{single}");
    // Of two rippling forces 2 ms apart, the larger counts fully.
    assert!((unsaid / single - 1.0).abs() < 0.02, "{unsaid}");
    assert!((pair / (0.5 * 0.9875) - 1.0).abs() < 0.01, "{pair}");
    assert!((isolated / single - 1.0).abs() < 0.02);
}

#[test]
fn the_extensor_extends() {
    let mut finger = Finger::new(spec(), 0).unwrap();
    hold(&mut finger, &[(2, 26.0)], 1, true);
    assert_eq!(finger.angle_deg(), 0.0);
    assert!(finger.torque_nm() < 0.0);
}

#[test]
fn the_first_pulse_acts_after_the_electromechanical_delay() {
    let mut finger = Finger::new(spec(), 0).unwrap();
    finger.pulse(&pulse(500, 0, 28.0, true));
    finger.advance(25_000);
    assert_eq!(finger.torque_nm(), 0.0);
    finger.advance(26_000);
    assert!(finger.torque_nm() > 0.0);
}

#[test]
fn stops_hold_under_full_two_point_stimulation() {
    let mut finger = Finger::new(paired(), 0).unwrap();
    for period in 0..200u64 {
        let t_us = period * 20_000;
        finger.pulse(&pulse(t_us, 0, 28.0, true));
        finger.pulse(&pulse(t_us + 2000, 1, 36.0, true));
        for ms in 1..=20 {
            finger.advance(t_us + 1000 * ms);
            assert!((0.0..=100.0).contains(&finger.angle_deg()));
            assert!((0.0..=100.0).contains(&finger.sensed_deg()));
        }
    }
    assert_eq!(finger.angle_deg(), 100.0);
    finger.advance(8_000_000);
    assert!((finger.angle_deg() - 5.0).abs() < 0.01, "relaxes again");
}

#[test]
fn equal_seeds_repeat_to_the_bit_and_calls_of_advance_do_not_matter() {
    let run = |seed: u64, often: bool| {
        let mut finger = Finger::new(spec(), seed).unwrap();
        let mut seen = Vec::new();
        for period in 0..100u64 {
            let t_us = period * 20_000 + 137;
            if often {
                finger.advance(t_us - 100);
            }
            finger.pulse(&pulse(t_us, 0, 26.0, true));
            finger.pulse(&pulse(t_us + 2003, 1, 30.0, true));
            if often {
                for us in 0..20 {
                    finger.advance(period * 20_000 + 999 * us);
                    finger.sensed_deg();
                }
            }
            finger.advance((period + 1) * 20_000);
            seen.push((finger.angle_deg().to_bits(), finger.sensed_deg().to_bits()));
        }
        seen
    };
    assert_eq!(run(1, false), run(1, false));
    assert_eq!(run(1, false), run(1, true));
    let (first, two) = (run(1, false), run(2, false));
    assert!(first.iter().zip(&two).all(|(a, b)| a.0 == b.0));
    assert!(first.iter().zip(&two).any(|(a, b)| a.1 != b.1));
}

#[test]
fn the_sensor_lags_quantises_and_is_noisy_as_specified() {
    let mut finger = Finger::new(spec(), 3).unwrap();
    let (mut sum, mut square) = (0.0, 0.0);
    let n = 20_000u32;
    for ms in 1..=u64::from(n) {
        finger.advance(1000 * ms);
        let reading = finger.sensed_deg();
        assert!((10.0 * reading - (10.0 * reading).round()).abs() < 1e-9);
        sum += reading - 5.0;
        square += (reading - 5.0).powi(2);
    }
    let deviation = (square / f64::from(n)).sqrt();
    assert!((sum / f64::from(n)).abs() < 0.01);
    // Quantisation adds 0.1²/12 to the variance.
    assert!(
        (deviation - (0.09f64 + 0.01 / 12.0).sqrt()).abs() < 0.006,
        "{deviation}"
    );

    let mut finger = Finger::new(noiseless(), 0).unwrap();
    hold(&mut finger, &[(0, 28.0)], 1, true);
    let (rate, behind) = (
        finger.rate_deg_per_s(),
        finger.angle_deg() - finger.sensed_deg(),
    );
    assert!(
        (behind - 0.010 * rate).abs() < 0.06 + 0.1 * behind.abs(),
        "{rate} {behind}"
    );
}

#[test]
fn an_electrode_off_stimulates_nothing() {
    let mut finger = Finger::new(spec(), 0).unwrap();
    finger.loads_mut()[0] = Load::Open;
    hold(&mut finger, &[(0, 28.0)], 1, true);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
}

#[test]
fn current_acts_as_the_voltage_that_drives_it() {
    let mut by_voltage = Finger::new(spec(), 0).unwrap();
    hold(&mut by_voltage, &[(0, 27.0)], 1, true);
    let mut by_current = Finger::new(spec(), 0).unwrap();
    for period in 0..50 {
        by_current.pulse(&Pulse {
            drive: Drive::Milliamps(13.5),
            ..pulse(period * 20_000, 0, 0.0, true)
        });
        by_current.advance((period + 1) * 20_000);
    }
    assert_eq!(by_voltage.angle_deg(), by_current.angle_deg());
    // Drier skin halves the current.
    let mut dry = Finger::new(spec(), 0).unwrap();
    dry.loads_mut()[0] = Load::Ohms(4000.0);
    hold(&mut dry, &[(0, 27.0)], 1, true);
    assert!(dry.angle_deg() < by_voltage.angle_deg());
}

#[test]
fn a_tiring_muscle_approaches_its_floor() {
    let tiring = FingerSpec {
        fatigue_floor: 0.5,
        fatigue_time_s: 1.0,
        ..spec()
    };
    let (mut fresh, mut tired) = (
        Finger::new(spec(), 0).unwrap(),
        Finger::new(tiring, 0).unwrap(),
    );
    hold(&mut fresh, &[(0, 28.0)], 10, true);
    hold(&mut tired, &[(0, 28.0)], 10, true);
    // Angle at which 0.12 N·m/rad balances the remaining torque and its ripple.
    let balance = |capacity: f64| {
        let per_degree = 0.12f64.to_radians();
        let torque = 0.22 * capacity;
        (torque + 5.0 * per_degree) / (per_degree + torque * 0.25 / 100.0)
    };
    assert!((fresh.angle_deg() - balance(1.0)).abs() < 1.0);
    assert!((tired.angle_deg() - balance(0.5)).abs() < 1.0);
}

#[test]
fn impossible_fingers_are_refused_by_name() {
    let refused = |change: fn(&mut FingerSpec)| {
        let mut spec = spec();
        change(&mut spec);
        Finger::new(spec, 0).err()
    };
    assert_eq!(refused(|_| ()), None);
    let expected = Some(InvalidSpec("inertia_kg_m2"));
    assert_eq!(refused(|s| s.inertia_kg_m2 = 0.0), expected);
    assert_eq!(refused(|s| s.muscle.k = -1.0), Some(InvalidSpec("muscle")));
    let expected = Some(InvalidSpec("flexor_a, flexor_b, extensor"));
    assert_eq!(refused(|s| s.flexor_a.channel = 10), expected);
    let expected = Some(InvalidSpec("pair"));
    for torque_nm in [[0.2, 0.22], [0.5, 0.2], [f64::NAN, 0.22]] {
        let mut spec = paired();
        spec.pair = spec.pair.map(|pair| Pair { torque_nm, ..pair });
        assert_eq!(Finger::new(spec, 0).err(), expected, "{torque_nm:?}");
    }
    assert_eq!(Finger::new(paired(), 0).err(), None);
}

#[test]
fn a_still_body_is_still() {
    let mut still = FixedLoad::new(30.0);
    still.pulse(&pulse(0, 0, 28.0, true));
    still.advance(1_000_000);
    assert_eq!(still.angle_deg(), 30.0);
    assert_eq!(still.sensed_deg(), 30.0);
    assert_eq!(still.loads()[9], Load::NOMINAL);
}
