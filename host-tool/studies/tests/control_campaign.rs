//! Tests of a short campaign: bit-identical repetition, scores against the reachable reference,
//! never better than the optimum.

use firmware::units::Micros;
use hal_sim::body::{Body, RandomFinger, RandomFingerSpec};
use methods::control::{AddOns, DelayCompensation, DerivativeKind, Form};
use studies::tracking::campaign::{Campaign, Plan};
use studies::tracking::candidate::{Candidate, Equipment};
use studies::tracking::contender::Contender;
use studies::tracking::driver::Driver;
use studies::tracking::exercise::Wearers;
use studies::tracking::plant::Plant;
use studies::tracking::reach::Reachable;
use studies::tracking::target::{Course, Kind};
use studies::tracking::trial::{self, TRIAL_MS};
use studies::tracking::wearer::{Points, Volts};
use studies::tracking::widened::{self, failures};

/// Returns a PID with feed-forward and round parameters.
fn pid() -> Contender {
    let numbers = [
        ("kp_per_rad", 1.5),
        ("ki_per_rad_s", 1.5),
        ("kd_s_per_rad", 0.06),
        ("cutoff_hz", 5.0),
        ("feed_forward_lead_s", 0.19),
    ];
    let candidate = Candidate {
        form: Form::Pid,
        add_ons: AddOns {
            derivative: DerivativeKind::Pseudo,
            feed_forward: true,
            delay: DelayCompensation::None,
            adaptation: false,
        },
        period_ms: 2,
        extrapolation_ms: 100,
        values: numbers.map(|(name, x)| (name.to_owned(), x)).into(),
    };
    Contender::Searched(Equipment::Equipped, candidate)
}

fn campaign() -> Campaign {
    let plan = Plan {
        seed: 3,
        plants: 8,
        wearers: Wearers::Earlier,
        course: Course::Sine,
        optimum_plants: 8,
    };
    Campaign::run(plan, vec![pid(), Contender::Shipped], |_| {}).expect("a campaign")
}

#[test]
fn a_campaign_repeats_to_the_bit_and_nobody_beats_the_optimum() {
    let found = campaign();
    assert_eq!(found, campaign());
    assert_eq!(found.cases.len(), 16, "no draw is dropped");
    // The optimum starts from the best law's efforts; amplitudes are rounded to millivolts.
    assert!(
        found.margin_below_optimum() <= 0.005,
        "{}",
        found.margin_below_optimum()
    );
    for points in Points::ALL {
        let (unreachable, reaching) = found.reach(points);
        let (optimum, _) = found.optimum(points);
        println!("{points:?} {unreachable} {reaching} {optimum}");
        assert!((0.0..1.0).contains(&unreachable) && (0.0..=1.0).contains(&reaching));
        assert!(optimum < 1.0, "{optimum}");
    }
    // A pair is assumed to pull harder than one point, so it reaches more.
    assert!(found.reach(Points::Two).0 < found.reach(Points::One).0);
    let worst = found
        .cases
        .iter()
        .flat_map(|c| &c.outcomes)
        .map(|outcome| outcome.rmse)
        .fold(0.0, f64::max);
    assert!(worst < 30.0 && worst > 0.5, "{worst}");
}

/// Driver with full flexion at 1, and no stimulation at 0.
struct Always(f64);

impl Driver for Always {
    fn setpoint(&mut self, _: Micros, _: Micros, _: f64) {}
    fn measurement(&mut self, _: Micros, _: Micros, _: f64) {}
    fn tick(&mut self, _: Micros) -> Volts {
        // Participant P's maxima, and the extensor's threshold.
        [28.0 * self.0, 36.0 * self.0, 14.0 * self.0]
    }
}

/// The reachable angle is what full stimulation does reach, fatigue included, neither much less nor
/// much more.
#[test]
fn the_reachable_angle_is_what_full_stimulation_holds() {
    let up = vec![100.0; TRIAL_MS];
    for index in 0..12 {
        let plant = Plant::random(5, index);
        let reachable = Reachable::new(&plant, Points::Two, &up).expect("reach");
        let angles = trial::run(&plant, &mut Always(1.0), &up)
            .expect("a trial")
            .angles;
        let (wanted, held) = (reachable.angles[29_000], f64::from(angles[29_000]));
        // Within a hundredth of the range, plus the angle that dry friction may hold.
        let friction = plant.finger.static_friction_nm / plant.finger.finger.stiffness_nm_per_rad;
        let slack = 1.0 + friction.to_degrees();
        assert!(
            (wanted - held).abs() < slack,
            "{index}: {wanted:.1} {held:.1} {slack:.1}"
        );
    }
}

#[test]
fn a_finger_that_nobody_stimulates_stays_at_rest() {
    let plant = Plant::random(5, 0);
    let up = vec![100.0; 2000];
    let angles = trial::run(&plant, &mut Always(0.0), &up)
        .expect("a trial")
        .angles;
    assert!(angles.iter().all(|a| (a - 5.0).abs() < 1e-3));
}

/// A thousand random wearers fill the ranges of [`RandomFingerSpec::random`].
#[test]
fn draws_fill_their_ranges() {
    let nominal = RandomFingerSpec::nominal();
    let all: Vec<RandomFingerSpec> = (0..1000).map(|i| RandomFingerSpec::random(9, i)).collect();
    let span = |of: &dyn Fn(&RandomFingerSpec) -> f64, low: f64, high: f64| {
        let values: Vec<f64> = all.iter().map(of).collect();
        let least = values.iter().copied().fold(f64::MAX, f64::min);
        let most = values.iter().copied().fold(f64::MIN, f64::max);
        let near = 0.01 * (high - low);
        assert!(least >= low && least < low + near, "{least} of {low}");
        assert!(most <= high && most > high - near, "{most} of {high}");
    };
    for i in 0..3 {
        let torque = nominal.muscles[i].torque_nm;
        span(&|s| s.muscles[i].torque_nm / torque, 0.5, 1.5);
    }
    span(
        &|s| f64::from(s.finger.electromechanical_delay_us),
        0.0,
        60_000.0,
    );
    span(&|s| s.finger.fatigue_floor, 0.5, 1.0);
    let threshold = nominal.finger.flexor_a.threshold_v;
    span(&|s| s.finger.flexor_a.threshold_v / threshold, 0.95, 1.20);
    for spec in &all {
        assert!(RandomFinger::new(spec.clone(), 0).is_ok());
        assert!(
            spec.capacity
                .iter()
                .all(|c| *c >= spec.finger.fatigue_floor)
        );
    }
    assert_ne!(
        RandomFingerSpec::random(9, 0),
        RandomFingerSpec::random(10, 0)
    );
    let mut finger = RandomFinger::new(nominal, 0).expect("the nominal finger");
    finger.advance(1_000_000);
    assert!((finger.angle_deg() - 5.0).abs() < 1e-9);
}

/// The additional values of widened wearers fill the ranges in their documentation, and an object
/// that hangs on the joint moves an unstimulated finger as far as its spring allows.
#[test]
fn widened_draws_fill_their_ranges_and_their_loads_act() {
    let (mut strengths, mut delays) = (Vec::new(), Vec::new());
    for i in 0..1000 {
        let spec = RandomFingerSpec::random_wide_range(9, i);
        strengths.push(spec.strength());
        delays.push(spec.finger.electromechanical_delay_us);
        let [object, knock] = spec.external[..] else {
            panic!("an object and a knock: {:?}", spec.external)
        };
        assert!(object.nm.abs() <= 0.024 && knock.nm.abs() <= 0.1);
        assert!((11_000..14_000).contains(&object.from_ms) && object.to_ms <= 20_000);
        let lasts_ms = knock.to_ms - knock.from_ms;
        assert!((10..50).contains(&lasts_ms) && knock.to_ms <= 24_050);
        let earlier = RandomFingerSpec::random(9, i);
        assert_eq!(spec.finger.fatigue_floor, earlier.finger.fatigue_floor);
        assert!(earlier.external.is_empty());
    }
    let ends = |all: &mut Vec<f64>| {
        all.sort_by(f64::total_cmp);
        (all[0], all[all.len() - 1])
    };
    let (weakest, strongest) = ends(&mut strengths);
    assert!((0.42..0.56).contains(&weakest) && (2.7..3.22).contains(&strongest));
    let most = delays.iter().max().copied().unwrap_or(0);
    assert!((99_000..=100_000).contains(&most), "{most}");

    let mut spec = RandomFingerSpec::random_wide_range(9, 0);
    spec.static_friction_nm = 0.0;
    spec.coulomb_friction_nm = 0.0;
    let object = spec.external[0];
    spec.external[0].nm = object.nm.abs();
    let turned = (object.nm.abs() / spec.finger.stiffness_nm_per_rad).to_degrees();
    let mut finger = RandomFinger::new(spec, 0).expect("a finger");
    finger.advance(u64::from(object.to_ms) * 1000);
    let held = finger.angle_deg() - 5.0;
    assert!((held - turned).abs() < 0.05, "{held} of {turned}");
    finger.advance(u64::from(object.to_ms + 2000) * 1000);
    assert!(
        (finger.angle_deg() - 5.0).abs() < 0.05,
        "{}",
        finger.angle_deg()
    );
}

/// Each widened wearer follows its own reference.
#[test]
fn a_widened_campaign_counts_failures_and_refusals_apart() {
    let plan = Plan {
        seed: 3,
        plants: 6,
        wearers: Wearers::Widened,
        course: Course::Sine,
        optimum_plants: 0,
    };
    let run = || Campaign::run(plan, vec![pid(), Contender::Shipped], |_| {}).expect("a campaign");
    let found = run();
    assert_eq!(found.cases.len(), 12, "no draw is dropped");
    for points in Points::ALL {
        let by_kind = Kind::ALL.map(|kind| failures(&found, points, 0, Some(kind)).wearers);
        assert_eq!(by_kind, [2, 2, 2]);
        let all = failures(&found, points, 0, None);
        assert_eq!((all.wearers, all.refused), (6, 0), "floats refuse nobody");
    }
    assert_eq!(widened::csv(&found), widened::csv(&run()), "to the bit");
}
