//! Measures why the default misses the reference: its error with one cause after the other removed
//! from the wearers.

use hal_sim::body::RandomFingerSpec;
use hal_sim::body::wearer::Site;
use studies::tracking::contender::Contender;
use studies::tracking::exercise::Exercise;
use studies::tracking::plant::{Line, Plant};
use studies::tracking::statistics::{mean, percentile};
use studies::tracking::target::Course;
use studies::tracking::wearer::Points;

/// Seed that neither judging nor the search has used.
const SEED: u64 = 1002;
const WEARERS: u64 = 60;

type Without = (&'static str, fn(&mut Plant));

#[rustfmt::skip]
const CAUSES: [Without; 10] = [
    ("as drawn", |_| {}),
    ("sensor's noise", |p| p.finger.finger.sensor_noise_deg = 0.0),
    ("jitter, lost setpoints", |p| p.line = Line::NOMINAL),
    ("dry friction", |p| (p.finger.static_friction_nm, p.finger.coulomb_friction_nm) = (0.0, 0.0)),
    ("delay", |p| p.finger.finger.electromechanical_delay_us = 0),
    ("fatigue", |p| (p.finger.finger.fatigue_floor, p.finger.capacity) = (1.0, [1.0; 3])),
    ("gains off the file", |p| p.finger.muscles.iter_mut().zip(RandomFingerSpec::nominal().muscles)
        .for_each(|(muscle, file)| muscle.torque_nm = file.torque_nm)),
    ("extensor's threshold", |p| p.finger.finger.extensor = RandomFingerSpec::nominal().finger.extensor),
    ("A and B moved apart", |p| {
        // Both shifted by the same factor as A.
        let (file, finger) = (RandomFingerSpec::nominal().finger, &mut p.finger.finger);
        let moved = finger.flexor_a.max_v / file.flexor_a.max_v;
        let max_v = file.flexor_b.max_v * moved;
        let b = Site { max_v, threshold_v: file.flexor_b.threshold_v * moved, ..finger.flexor_b };
        finger.place_flexors([finger.flexor_a, b]);
    }),
    ("all thresholds", |p| {
        let file = RandomFingerSpec::nominal().finger;
        let finger = &mut p.finger.finger;
        finger.place_flexors([file.flexor_a, file.flexor_b]);
        finger.extensor = file.extensor;
    }),
];

/// Two-point; prints a table of its results.
#[test]
fn thresholds_cost_the_most() {
    let costs = CAUSES.map(|(name, without)| {
        let rmse: Vec<f64> = (0..WEARERS)
            .map(|index| {
                let mut plant = Plant::random(SEED, index);
                without(&mut plant);
                let exercise = Exercise::new(plant, Points::Two, Course::Sine).unwrap();
                Contender::Shipped.attempt(&exercise).unwrap().rmse
            })
            .collect();
        let cost = mean(&rmse);
        println!("{name:24}{cost:6.2}°{:6.2}°", percentile(&rmse, 0.95));
        cost
    });
    assert!(costs.iter().all(|cost| costs[9] <= *cost));
}
