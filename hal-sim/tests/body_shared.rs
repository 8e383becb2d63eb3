//! A muscle under several electrodes, compared with a muscle that fatigues alone.

use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::muscle::tiring::{Fatigue, FatiguingMuscle};
use hal_sim::body::shared::{Electrode, SAMPLE_US, Shared, SharedSpec};
use hal_sim::body::{Body, Drive, Pulse};

/// Returns the fatigue of Ding's quadriceps, scaled to a force of 1.
fn fatigue(a: f64) -> Fatigue {
    Fatigue {
        alpha_a_per_s2: 0.4,
        alpha_k_per_n_s: 1.9e-5 * 3009.0 / a,
        alpha_tau1_per_n: 2.1e-5 * 3009.0 / a,
        tau_fat_s: 127.0,
        k_max: 5.0,
        tau1_max_s: 0.2,
    }
}

fn electrode(reach: &[f64]) -> Electrode {
    Electrode {
        threshold_ma: 10.0,
        full_ma: 20.0,
        foot: 0.05,
        reach: reach.to_vec(),
    }
}

/// Returns a muscle of K01 with four groups of ten units and these electrodes on the first
/// channels.
fn spec(reaches: &[[f64; 4]]) -> SharedSpec {
    let dynamics = SUBJECTS[0].normalised_at(50.0);
    let mut electrodes: [Option<Electrode>; 10] = Default::default();
    for (own, reach) in electrodes.iter_mut().zip(reaches) {
        *own = Some(electrode(reach));
    }
    SharedSpec {
        strength_n: 100.0,
        dynamics,
        fatigue: fatigue(dynamics.a_n_per_s),
        pulse_takes: 0.0,
        groups: 4,
        units_per_group: 10,
        electrodes,
        seed: 3,
    }
}

fn pulse(t_us: u64, channel: usize, ma: f64) -> Pulse {
    Pulse {
        t_us,
        channel,
        drive: Drive::Milliamps(ma),
        width_us: 200,
        conducted: false,
    }
}

/// Returns the readings and the remaining capacity after these pulses and `for_us`.
fn read(spec: &SharedSpec, pulses: &[Pulse], for_us: u64) -> (Vec<f64>, f64) {
    let mut body = Shared::new(spec.clone()).unwrap();
    let readings = body.readings();
    for pulse in pulses {
        body.advance(pulse.t_us);
        body.pulse(pulse);
    }
    body.advance(for_us);
    let own = readings.lock().unwrap().clone();
    (own, body.remaining_strength())
}

fn train(channel: usize, ma: f64, period_us: u64, offset_us: u64, for_us: u64) -> Vec<Pulse> {
    let times = (0..).map(|nth| offset_us + nth * period_us);
    times
        .take_while(|t_us| *t_us < for_us)
        .map(|t_us| pulse(t_us, channel, ma))
        .collect()
}

fn merged(trains: &[Vec<Pulse>]) -> Vec<Pulse> {
    let mut pulses = trains.concat();
    pulses.sort_by_key(|pulse| pulse.t_us);
    pulses
}

/// Each share of the muscle fatigues by its own force, and all shares together equal the muscle.
#[test]
fn all_units_are_one_tiring_muscle() {
    let spec = spec(&[[1.0; 4]]);
    let for_us = 60_000_000;
    let (readings, left) = read(&spec, &train(0, 20.0, 40_000, 0, for_us), for_us);
    let mut alone = FatiguingMuscle::new(spec.dynamics, spec.fatigue).in_steps_of(5e-3);
    for (nth, force_n) in (0u64..).zip(&readings) {
        if (nth * SAMPLE_US).is_multiple_of(40_000) {
            alone.pulse(1.0);
        }
        alone.pass(SAMPLE_US as u32);
        let off = (100.0 * alone.force() - force_n).abs();
        assert!(off < 1e-9, "reading {nth}: {off}");
    }
    assert!((left - alone.parameters().a_n_per_s / spec.dynamics.a_n_per_s).abs() < 1e-12);
    assert!(left < 0.35, "{left}"); // a minute at 25 Hz fatigues a quadriceps
}

/// Compares steps of 5 ms with steps of 1 ms for all of Lee's subjects.
#[test]
fn coarse_steps_err_little() {
    for subject in &SUBJECTS {
        let dynamics = subject.normalised_at(50.0);
        let fine = FatiguingMuscle::new(dynamics, fatigue(dynamics.a_n_per_s));
        let (mut fine, mut coarse) = (fine, fine.in_steps_of(5e-3));
        for nth in 0..6_000 {
            if nth % 8 == 0 {
                fine.pulse(1.0);
                coarse.pulse(1.0);
            }
            fine.pass(5_000);
            coarse.pass(5_000);
            let off = (fine.force() - coarse.force()).abs();
            assert!(off < 2e-3, "{subject:?} at {nth}: {off}");
        }
    }
}

#[test]
fn what_an_electrode_does_not_reach_does_nothing() {
    let for_us = 1_000_000;
    let last = |reach: [f64; 4], ma: f64| {
        let (readings, _) = read(&spec(&[reach]), &train(0, ma, 20_000, 0, for_us), for_us);
        *readings.last().unwrap()
    };
    let full = last([1.0; 4], 20.0);
    assert!((last([1.0, 0.0, 0.0, 0.0], 20.0) - full / 4.0).abs() < 1e-9);
    assert!((last([0.5; 4], 20.0) - full / 2.0).abs() < 1e-9);
    assert_eq!(last([1.0; 4], 9.99), 0.0);
    // Half way between threshold and limit, e^(−1.5) of the reached part, to a unit's 1/40 per
    // group.
    let middle = last([1.0; 4], 15.0) / full;
    assert!((middle - 0.05_f64.sqrt()).abs() <= 4.0 / 40.0, "{middle}");
}

/// Units reached by two electrodes fire at the pulses of both, and once if these coincide.
#[test]
fn a_unit_that_two_electrodes_reach_fires_at_both() {
    let own = [1.0, 0.0, 0.0, 0.0];
    let (spec, for_us) = (spec(&[own, own]), 2_000_000);
    let force = |offset_us| {
        let trains =
            [0, 1].map(|index| train(index, 20.0, 160_000, index as u64 * offset_us, for_us));
        read(&spec, &merged(&trains), for_us).0
    };
    let alone = read(&spec, &train(0, 20.0, 160_000, 0, for_us), for_us).0;
    let twice = read(&spec, &train(0, 20.0, 80_000, 0, for_us), for_us).0;
    assert_eq!(force(0), alone);
    assert_eq!(force(2_999), alone); // refractory
    assert_eq!(force(80_000), twice);
    assert_ne!(force(3_000), alone);
}

/// Without crosstalk, the timing of the electrodes changes ripple but not fatigue.
#[test]
fn interleaving_alone_makes_force_smooth_and_tires_alike() {
    let own = std::array::from_fn(|electrode| {
        std::array::from_fn(|group| if group == electrode { 1.0 } else { 0.0 })
    });
    let own: [[f64; 4]; 4] = own;
    let (spec, for_us) = (spec(&own), 60_000_000);
    let at = |offset_us: u64| {
        let trains: Vec<_> = (0..4)
            .map(|index| train(index, 20.0, 160_000, index as u64 * offset_us, for_us))
            .collect();
        let (readings, left) = read(&spec, &merged(&trains), for_us);
        let last = &readings[readings.len() - 32 * 20..]; // twenty periods
        let mean = last.iter().sum::<f64>() / last.len() as f64;
        let square: f64 = last.iter().map(|value| (value - mean).powi(2)).sum();
        (mean, (square / last.len() as f64).sqrt() / mean, left)
    };
    let (at_once, interleaved) = (at(0), at(40_000));
    assert!((interleaved.0 / at_once.0 - 1.0).abs() < 1e-3);
    // Units differ by up to one period, in which a force of 1 fatigues the muscle by this much.
    let a_period = 0.4 * 0.16 / spec.dynamics.a_n_per_s;
    assert!((interleaved.2 - at_once.2).abs() < a_period);
    assert!(
        interleaved.1 < 0.2 * at_once.1,
        "{interleaved:?} {at_once:?}"
    );
}

/// Fatigue per pulse depends on the number of pulses: a quarter of the rate gives a quarter of it,
/// to first order.
#[test]
fn pulses_take_their_part_whatever_the_force() {
    let mut spec = spec(&[[1.0; 4]]);
    spec.fatigue = Fatigue::NEVER;
    spec.fatigue.tau_fat_s = 1e9;
    spec.pulse_takes = 1e-4;
    let for_us = 10_000_000;
    let lost = |period_us| {
        -read(&spec, &train(0, 20.0, period_us, 0, for_us), for_us)
            .1
            .ln()
    };
    let pulse_loss = -(1.0_f64 - 1e-4).ln();
    assert!((lost(40_000) - 250.0 * pulse_loss).abs() < 1e-6);
    assert!((lost(160_000) - 63.0 * pulse_loss).abs() < 1e-6);
}

#[test]
fn what_cannot_be_is_named() {
    let wrong = |change: &dyn Fn(&mut SharedSpec)| {
        let mut spec = spec(&[[1.0; 4]]);
        change(&mut spec);
        Shared::new(spec)
            .err()
            .map(|invalid_shared| invalid_shared.0)
    };
    assert_eq!(wrong(&|_| ()), None);
    assert_eq!(wrong(&|spec| spec.strength_n = 0.0), Some("strength_n"));
    assert_eq!(wrong(&|spec| spec.pulse_takes = 1.0), Some("pulse_takes"));
    assert_eq!(wrong(&|spec| spec.groups = 0), Some("groups"));
    assert_eq!(
        wrong(&|spec| spec.units_per_group = 101),
        Some("units_per_group")
    );
    assert_eq!(wrong(&|spec| spec.dynamics.k = f64::NAN), Some("dynamics"));
    let electrode = |change: &dyn Fn(&mut Electrode)| {
        wrong(&|spec| spec.electrodes[0].iter_mut().for_each(change))
    };
    assert_eq!(electrode(&|spec| spec.full_ma = 10.0), Some("full_ma"));
    assert_eq!(electrode(&|spec| spec.foot = 1.0), Some("foot"));
    assert_eq!(electrode(&|spec| spec.reach = vec![1.0; 3]), Some("reach"));
    assert_eq!(electrode(&|spec| spec.reach[2] = 1.1), Some("reach"));
}
