//! The simulated elbow: motion by its equations, muscles that pull in the right direction, and a
//! person whose speed and strength are limited.

use hal_sim::body::elbow::{VoluntaryApproach, YieldSpec};
use hal_sim::body::{Body, Drive, Elbow, ElbowSpec, InvalidElbow, Load, Pulse};

fn pulse(t_us: u64, channel: usize, ma: f64, width_us: u32) -> Pulse {
    Pulse {
        t_us,
        channel,
        drive: Drive::Milliamps(ma),
        width_us,
        conducted: false,
    }
}

/// Returns an elbow without voluntary effort.
fn passive_elbow() -> ElbowSpec {
    let mut spec = ElbowSpec::default();
    spec.person.push_nm = 0.0;
    spec
}

/// Returns the angles at each millisecond under trains at 50 Hz on both channels.
fn elbow_angles(spec: ElbowSpec, triceps_ma: f64, biceps_ma: f64, ms: u64) -> Vec<f64> {
    let mut arm = Elbow::new(spec, 1).unwrap();
    (0..ms)
        .map(|t| {
            if t % 20 == 0 {
                arm.pulse(&pulse(t * 1000, 0, triceps_ma, 35));
                arm.pulse(&pulse(t * 1000, 1, biceps_ma, 25));
            }
            arm.advance((t + 1) * 1000);
            arm.angle_deg()
        })
        .collect()
}

#[test]
fn a_released_arm_swings_as_its_equation_says() {
    // I θ″ + b θ′ + k (θ − rest) = 0 from 60° with rest 70°, underdamped.
    let spec = ElbowSpec {
        damping_nm_s_per_rad: 0.2,
        stiffness_nm_per_rad: 5.0,
        ..passive_elbow()
    };
    let (i, b, k) = (0.06f64, 0.2, 5.0);
    let (decay, rate) = (b / (2.0 * i), (k / i - (b / (2.0 * i)).powi(2)).sqrt());
    for (ms, angle) in elbow_angles(spec, 0.0, 0.0, 1500).iter().enumerate() {
        let t = (ms + 1) as f64 * 1e-3;
        let swing = (rate * t).cos() + decay / rate * (rate * t).sin();
        let exact = 70.0 - 10.0 * (-decay * t).exp() * swing;
        // Phase error of the midpoint rule: (ωh)²/12 rad per rad.
        assert!((angle - exact).abs() < 2e-3, "{t} {angle} {exact}");
    }
}

#[test]
fn triceps_extends_biceps_flexes_and_neither_below_threshold() {
    let end = |triceps, biceps| {
        *elbow_angles(passive_elbow(), triceps, biceps, 3000)
            .last()
            .unwrap()
    };
    let rest = end(0.0, 0.0);
    assert!((rest - 70.0).abs() < 0.5, "{rest}");
    assert!(end(60.0, 0.0) < rest - 20.0);
    assert!(end(0.0, 60.0) > rest + 20.0);
    assert!((end(24.0, 19.0) - rest).abs() < 1e-9);
    // The joint does not pass its stops.
    assert_eq!(end(80.0, 0.0), 0.0);
}

#[test]
fn force_answers_after_the_delay_and_not_before() {
    let spec = ElbowSpec {
        rest_deg: 60.0,
        electromechanical_delay_us: 40_000,
        ..passive_elbow()
    };
    let angles = elbow_angles(spec, 60.0, 0.0, 100);
    assert!(angles[..40].iter().all(|a| (a - 60.0).abs() < 1e-9));
    assert!(angles[60] < 60.0);
}

#[test]
fn full_stimulation_gives_the_torque_of_the_specification() {
    let spec = ElbowSpec {
        stops_deg: [59.0, 145.0],
        ..passive_elbow()
    };
    let torque = spec.triceps.torque_nm;
    let mut arm = Elbow::new(spec, 1).unwrap();
    let mut sum = 0.0;
    for t in 0..4000 {
        if t % 20 == 0 {
            arm.pulse(&pulse(t * 1000, 0, 80.0, 35));
        }
        arm.advance((t + 1) * 1000);
        if t >= 3000 {
            sum += arm.torques_nm()[0] / 1000.0;
        }
    }
    assert!((sum - torque).abs() < 0.002 * torque, "{sum}");
}

#[test]
fn a_person_moves_at_the_speed_meant_and_pushes_with_the_strength_given() {
    for speed_deg_per_s in [15.0, 55.0] {
        let mut spec = ElbowSpec {
            stops_deg: [0.0, 90.0],
            ..ElbowSpec::default()
        };
        spec.person.approaches = vec![VoluntaryApproach {
            at_s: 0.5,
            speed_deg_per_s,
            for_s: 6.0,
        }];
        let push = spec.person.push_nm;
        let mut arm = Elbow::new(spec, 1).unwrap();
        arm.advance(500_000);
        assert!((arm.angle_deg() - 60.0).abs() < 0.5);
        let mut ms = 500;
        while arm.angle_deg() < 75.0 {
            ms += 1;
            arm.advance(ms * 1000);
            assert!(arm.rate_deg_per_s() < speed_deg_per_s + 2.0);
        }
        let error = (arm.rate_deg_per_s() - speed_deg_per_s).abs();
        assert!(error < 2.0, "{speed_deg_per_s}: {error}");
        // At the stop the person exerts the full strength and no more, at either speed.
        arm.advance(6_000_000);
        assert!((arm.angle_deg() - 90.0).abs() < 1e-9);
        assert_eq!(arm.voluntary_nm(), push);
        // And back.
        arm.advance(12_000_000);
        assert!((arm.angle_deg() - 60.0).abs() < 0.5);
    }
}

#[test]
fn an_electrode_that_falls_off_excites_nothing_and_time_may_be_cut_anywhere() {
    let mut arm = Elbow::new(passive_elbow(), 1).unwrap();
    arm.loads_mut()[0] = Load::Open;
    arm.pulse(&pulse(0, 0, 80.0, 35));
    arm.advance(300_000);
    assert_eq!(arm.torques_nm(), [0.0, 0.0]);
    let run = |cuts: &[u64]| {
        let mut arm = Elbow::new(ElbowSpec::random(3, 7), 5).unwrap();
        for t in 0..10 {
            arm.pulse(&pulse(t * 20_000, 0, 60.0, 35));
            for cut in cuts {
                arm.advance(t * 20_000 + cut);
            }
            arm.advance((t + 1) * 20_000);
        }
        (arm.angle_deg(), arm.sensed_deg(), arm.torques_nm())
    };
    assert_eq!(run(&[]), run(&[1, 999, 7_300, 7_301]));
}

#[test]
fn every_drawn_arm_can_be_and_a_wrong_number_is_named() {
    for index in 0..500 {
        Elbow::new(ElbowSpec::random(1, index), 1).unwrap();
    }
    assert_eq!(ElbowSpec::random(2, 3), ElbowSpec::random(2, 3));
    assert_ne!(ElbowSpec::random(2, 3), ElbowSpec::random(2, 4));
    let refused = |change: fn(&mut ElbowSpec)| {
        let mut spec = ElbowSpec::default();
        change(&mut spec);
        Elbow::new(spec, 1).unwrap_err()
    };
    let expected = InvalidElbow("inertia_kg_m2");
    assert_eq!(refused(|s| s.inertia_kg_m2 = 0.0), expected);
    assert_eq!(refused(|s| s.triceps.max_ma = 1.0), InvalidElbow("triceps"));
    assert_eq!(refused(|s| s.rest_deg = 200.0), InvalidElbow("rest_deg"));
    let expected = InvalidElbow("push_nm");
    assert_eq!(refused(|s| s.person.push_nm = f64::NAN), expected);
    assert_eq!(
        refused(|s| {
            let approach = VoluntaryApproach {
                at_s: 1.0,
                speed_deg_per_s: 10.0,
                for_s: 2.0,
            };
            s.person.approaches = vec![approach; 2];
        }),
        InvalidElbow("approaches")
    );
}

/// Returns the effort of a person who holds the arm at its stop and yields to a train from 1 s to 2
/// s.
fn voluntary(yields: Option<YieldSpec>) -> Vec<f64> {
    let mut spec = ElbowSpec {
        stops_deg: [0.0, 70.0],
        ..ElbowSpec::default()
    };
    spec.person.approaches = vec![VoluntaryApproach {
        at_s: 0.0,
        speed_deg_per_s: 30.0,
        for_s: 60.0,
    }];
    spec.person.yields = yields;
    let mut arm = Elbow::new(spec, 1).unwrap();
    let after = |t: u64| {
        if (1000..2000).contains(&t) && t.is_multiple_of(20) {
            arm.pulse(&pulse(t * 1000, 1, 15.0, 25)); // felt, although no muscle pulls
        }
        arm.advance((t + 1) * 1000);
        arm.voluntary_nm()
    };
    (0..3000).map(after).collect()
}

#[test]
fn a_person_yields_a_reaction_after_what_is_felt_and_comes_back() {
    let (delay_s, to) = (0.2, 0.4);
    let yields = |at_ma| Some(YieldSpec { delay_s, to, at_ma });
    let pushed = voluntary(yields(15.0));
    let never = voluntary(None);
    // Full effort until the reaction, 0.4 of it 0.12 s later, and full effort again at the end.
    assert_eq!(pushed[..1200], never[..1200]);
    assert!(
        pushed[1201] < 1.5 && pushed[1201] > 1.48,
        "{}",
        pushed[1201]
    );
    for ms in (1330..2200).step_by(10) {
        assert!(
            (pushed[ms] - 0.4 * 1.5).abs() < 1e-12,
            "{ms} {}",
            pushed[ms]
        );
    }
    assert_eq!(pushed[2500..], never[2500..]);
    // A train below the sensory threshold changes nothing.
    assert_eq!(voluntary(yields(15.1)), never);
}

#[test]
fn a_person_who_yields_backwards_is_refused() {
    let refused = |delay_s, to, at_ma| {
        let mut spec = ElbowSpec::default();
        spec.person.yields = Some(YieldSpec { delay_s, to, at_ma });
        Elbow::new(spec, 1).err()
    };
    for (delay_s, to, at_ma) in [(-0.1, 0.5, 1.0), (0.1, 1.1, 1.0), (0.1, 0.5, f64::NAN)] {
        assert_eq!(refused(delay_s, to, at_ma), Some(InvalidElbow("yields")));
    }
    assert_eq!(refused(0.0, 0.0, 0.0), None);
}
