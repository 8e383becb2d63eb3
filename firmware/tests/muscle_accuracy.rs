//! Accuracy of the fixed-point calcium–force model against the golden solution and, for every
//! subject, rate and pulse timing, against a floating-point reference that is itself compared with
//! the golden solution.
//!
//! `cargo test -p firmware --test suite muscle_accuracy -- --nocapture` prints the table of errors.

use crate::muscle_ladder::twins::{self, FatigueMode, Muscle, Pulse};
use crate::muscle_ladder::{START, error_pct, spec, subjects, train};
use firmware::muscle::{CalciumForce, CalciumForceState, Gain};
use firmware::units::us;

const GOLDEN: &str = include_str!("../../tests/golden/lee2020/golden_force.csv");

/// Returns the reference model's force every millisecond for `ms` milliseconds.
fn reference(subject: &Muscle, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    twins::tiring(subject, FatigueMode::Never, pulses, ms).0
}

/// Returns the force of the device's model, advanced in ticks of 1 ms.
fn fixed(subject: &Muscle, pulses: &[Pulse], ms: u64) -> Vec<f64> {
    let muscle = CalciumForce::new(spec(subject)).unwrap();
    let mut state = CalciumForceState::at_rest(START);
    let mut pulses = pulses.iter().peekable();
    let mut samples = vec![];
    for sample in 0..=ms {
        while let Some((at, gain)) = pulses.next_if(|p| p.0 <= sample * 1000) {
            let gain = Gain::new(fixed::types::U1F31::from_num(*gain));
            muscle.pulse(&mut state, START + us(*at as u32), gain);
        }
        muscle.advance(&mut state, START + us((sample * 1000) as u32));
        samples.push(muscle.force(&state).get().to_num());
    }
    samples
}

/// Generates a train of 1 s with every pulse displaced by up to 45 % of a period and, with `gains`,
/// with a random gain.
fn scattered(hz: u32, gains: bool) -> Vec<Pulse> {
    let mut seed = 0x9E37_79B9_u32.wrapping_mul(hz);
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    let period = 1e6 / f64::from(hz);
    let pulse = |i: u32| {
        let at = (f64::from(i) + 0.5 + 0.9 * (random() - 0.5)) * period;
        (at as u64, if gains { 0.1 + 0.9 * random() } else { 1.0 })
    };
    (0..hz).map(pulse).collect()
}

/// Returns scattered pulses, each followed by two more within 0.9 ms: up to three in a tick.
fn bursts(hz: u32) -> Vec<Pulse> {
    let followed = |(at, gain): Pulse| [(at, gain), (at + 311, gain / 2.0), (at + 900, gain)];
    scattered(hz, true).into_iter().flat_map(followed).collect()
}

#[test]
fn golden_solution_is_met_by_reference_and_device() {
    let subjects = subjects();
    let mut lines = GOLDEN.lines();
    let cases: Vec<&str> = lines.next().unwrap().split(',').skip(1).collect();
    let columns: Vec<Vec<f64>> = lines
        .map(|row| row.split(',').skip(1).map(|v| v.parse().unwrap()).collect())
        .collect();
    assert_eq!((cases.len(), columns.len()), (10, 151));
    for (i, case) in cases.iter().enumerate() {
        let (name, hz) = case.split_once('_').unwrap();
        let (_, subject) = subjects.iter().find(|s| s.0 == name).unwrap();
        let pulses = train(hz.parse().unwrap(), 0, 1000);
        let golden: Vec<f64> = columns.iter().map(|row| row[i]).collect();
        let thin = |samples: Vec<f64>| samples.into_iter().step_by(10).collect::<Vec<_>>();
        let of_reference = error_pct(&golden, &thin(reference(subject, &pulses, 1500)));
        let of_device = error_pct(&golden, &thin(fixed(subject, &pulses, 1500)));
        println!("{case}: device {of_device:.4} %, reference {of_reference:.1e} %");
        assert!(of_reference < 1e-6, "{case}: {of_reference:e} %");
        assert!(of_device <= 0.012, "{case}: {of_device:.4} %");
    }
}

#[test]
fn every_subject_rate_and_timing_is_within_its_bound() {
    const RATES: [u32; 7] = [10, 20, 30, 40, 50, 70, 100];
    let mut worst = 0f64;
    println!("worst error, % of peak (regular / scattered / with gains / bursts)");
    println!("      {}", RATES.map(|hz| format!("{hz:>28} Hz")).concat());
    for (name, subject) in subjects() {
        print!("{name}  ");
        for hz in RATES {
            let trains = [
                train(hz.into(), 0, 1000),
                scattered(hz, false),
                scattered(hz, true),
                bursts(hz),
            ];
            let errors = trains.map(|pulses| {
                error_pct(
                    &reference(&subject, &pulses, 1500),
                    &fixed(&subject, &pulses, 1500),
                )
            });
            print!("  {} |", errors.map(|e| format!("{e:.4}")).join(" "));
            worst = errors.iter().copied().fold(worst, f64::max);
        }
        println!();
    }
    println!("worst of all: {worst:.4} %");
    assert!(worst <= 0.005, "{worst} %");
    assert!(worst >= 0.0025, "{worst} %: half of what is stated");
}

/// Tests the ends of all ranges, and random muscles with log-uniform parameters, at full gain and
/// the largest strength, so that the rounding of force does not matter.
#[test]
fn every_muscle_that_is_accepted_is_within_its_bound() {
    let mut seed = 13u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    let ends = [(0.002, 5.0), (0.005, 0.1), (0.002, 0.2), (0.001, 1.0f64)];
    let mut worst = (0f64, String::new());
    let mut refused = 0;
    for n in 0..516 {
        let part = |i: usize, drawn: f64| {
            let part = if n < 16 { f64::from(n >> i & 1) } else { drawn };
            let value = ends[i].0 * (ends[i].1 / ends[i].0).powf(part);
            (value * 1e6).round() * 1e-6 // rounded as a host sends it
        };
        let [k, tau_c, tau1, tau2] = [0, 1, 2, 3].map(|i| part(i, random()));
        let muscle = Muscle {
            a: 10_000.0,
            k,
            tau_c,
            tau1,
            tau2,
        };
        if CalciumForce::new(spec(&muscle)).is_err() {
            refused += 1;
            continue;
        }
        for hz in [5, 25, 100, 200] {
            let pulses = scattered(hz, false);
            let error = error_pct(
                &reference(&muscle, &pulses, 1500),
                &fixed(&muscle, &pulses, 1500),
            );
            if error > worst.0 {
                worst = (error, format!("{muscle:?} at {hz} Hz"));
            }
        }
    }
    println!("worst {:.4} % of {}, {refused} refused", worst.0, worst.1);
    assert!(worst.0 <= 0.02, "{} % of {}", worst.0, worst.1);
    assert!(refused <= 8, "{refused}");
}

/// Tests single twitches and slow trains of muscles that respond weakly and slowly: their whole force
/// is a thousandth of A·τm or less, so rounding and the end of the decay matter most.
#[test]
fn weak_and_slow_muscles_are_within_their_bound() {
    let mut worst = (0f64, String::new());
    for (k, tau_c, tau1, tau2) in [
        (5.0, 0.005, 0.1, 1.0),
        (5.0, 0.005, 0.2, 1.0),
        (5.0, 0.005, 0.05, 0.1),
        (3.0, 0.006, 0.15, 0.5),
        (1.0, 0.01, 0.2, 1.0),
        (5.0, 0.02, 0.2, 0.3),
    ] {
        let muscle = Muscle {
            a: 10_000.0,
            k,
            tau_c,
            tau1,
            tau2,
        };
        for pulses in [vec![(250, 1.0)], vec![(250, 0.3)], train(1.0, 0, 3_000)] {
            let error = error_pct(
                &reference(&muscle, &pulses, 4_000),
                &fixed(&muscle, &pulses, 4_000),
            );
            println!("{muscle:?}, {} pulses: {error:.4} %", pulses.len());
            if error > worst.0 {
                worst = (error, format!("{muscle:?}, {} pulses", pulses.len()));
            }
        }
    }
    assert!(worst.0 <= 0.02, "{} % of {}", worst.0, worst.1);
}
