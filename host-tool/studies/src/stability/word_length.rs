//! Map of the shipped muscle model's error at small drives, where the length of its words matters.
//!
//! The drive scales the force, but not the words: each halving of the drive takes a bit from force
//! and answer. What remains of the force after the last pulse must come to exactly zero.

use super::{Axis, Cell, Class, Layout, Map, Panels};
use crate::subjects::spec;
use firmware::muscle::{Gain, TabulatedForce, TabulatedForceState};
use firmware::units::Micros;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// Halvings of the drive in the columns. The device promises four digits down to 2^-16.
const HALVINGS: [u32; 17] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16];
/// Trains of the panels: title, and number of pulses at 40 Hz.
const TRAINS: [(&str, u32); 2] = [("40 Hz for 1 s", 40), ("a single pulse", 1)];
/// Period of 40 Hz, and time of the first pulse, µs.
const PERIOD_US: u32 = 25_000;
const FIRST_US: u32 = 137;
/// Length of the compared part, s, and time between two readings, µs.
const DURATION_S: f64 = 1.5;
const READ_US: u32 = 1000;
/// Time after which every force must be exactly zero, ms after the last pulse
/// ([`TabulatedForce::advance`]).
const REST_MS: u32 = 7000;
/// Error of the model for the subjects of Lee's table 4 at full drive, % of the peak
/// ([`TabulatedForce`]).
const AT_FULL: f64 = 0.005;

const CLASSES: [Class; 6] = [
    Class::new('.', AT_FULL, "up to 0.005 %", 0),
    Class::new(',', 0.02, "up to 0.02 %", 0),
    Class::new('1', 0.1, "up to 0.1 %", 1),
    Class::new('2', 1.0, "up to 1 %", 1),
    Class::new('3', 10.0, "up to 10 %", 1),
    Class::new('X', f64::INFINITY, "more than 10 %", 2),
];

/// Computes the map by simulating every cell; the seed is not used.
pub fn draw(_seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let mut panels = Panels::new(TRAINS.len(), progress);
    for (title, pulses) in TRAINS {
        let subjects = SUBJECTS.each_ref().map(|p| (p, truth(p, pulses)));
        panels.add(
            title.to_owned(),
            &subjects,
            &HALVINGS,
            |(p, truth), halvings| {
                let told = predicted(p, truth, *halvings);
                Cell::with_prediction(&CLASSES, run(p, pulses, truth, *halvings).error, Some(told))
            },
        );
    }
    Map {
        name: "word_length",
        title: "Words of the shipped muscle model: the error at small drives",
        across: Axis::new("halvings of the drive", "", &HALVINGS, u32::to_string),
        down: Axis::new("subject and its K", "", &SUBJECTS, |p| {
            let n = SUBJECTS.iter().position(|q| q == p).unwrap_or(0);
            format!("K{:02} {:.3}", n + 1, p.k)
        }),
        quantity: "worst error, % of the train's peak at this drive",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(2),
        theory: "0.005 % as at full drive, plus half the last bit of the answer (2^-17 N) and the \
                 last bit of the force (2^-29 of A (τ1 + τ2)), both over the peak.",
        notes: vec![format!(
            "Read every 1 ms, against the exact solution. The force is exactly zero, for every \
             subject, drive and train, at most {} ms after the last pulse.",
            slowest_to_zero()
        )],
    }
}

/// Result of one drive on one muscle.
struct Outcome {
    /// Largest error, % of the peak force.
    error: f64,
    /// Time from the last pulse until the model is at rest, ms; `None` if it is not within
    /// [`REST_MS`].
    zero_after_ms: Option<u32>,
}

/// Returns the exact force at full drive at each reading, N.
fn truth(p: &Parameters, pulses: u32) -> Vec<f64> {
    let seconds = |n| f64::from(FIRST_US + n * PERIOD_US) * 1e-6;
    let pulses: Vec<f64> = (0..pulses).map(seconds).collect();
    let samples = integrate(p, &pulses, DURATION_S, f64::from(READ_US) * 1e-6);
    samples.iter().map(|sample| sample.force_n).collect()
}

fn peak(truth: &[f64]) -> f64 {
    truth.iter().copied().fold(0.0, f64::max)
}

fn run(p: &Parameters, pulses: u32, truth: &[f64], halvings: u32) -> Outcome {
    let muscle = TabulatedForce::new(&spec(p)).expect("every subject of table 4 has a table");
    let mut state = TabulatedForceState::at_rest(Micros::new(0));
    let gain = Gain::new(Gain::FULL.get() >> halvings);
    let drive = libm::exp2(-f64::from(halvings));
    let mut times = (0..pulses).map(|n| FIRST_US + n * PERIOD_US).peekable();
    let last_us = FIRST_US + (pulses - 1) * PERIOD_US;
    let mut error = 0.0f64;
    let mut zero_after_ms = None;
    for ms in 0..last_us / 1000 + REST_MS {
        let now_us = ms * READ_US;
        while let Some(at_us) = times.next_if(|at_us| *at_us <= now_us) {
            muscle.pulse(&mut state, Micros::new(at_us), gain);
        }
        muscle.advance(&mut state, Micros::new(now_us));
        if let Some(true_n) = truth.get(ms as usize) {
            let force_n: f64 = muscle.force(&state).get().to_num();
            error = error.max((force_n - drive * true_n).abs());
        }
        if now_us > last_us && state.is_at_rest() {
            zero_after_ms = zero_after_ms.or(Some(ms - last_us / 1000));
        }
    }
    Outcome {
        error: error / (drive * peak(truth)) * 100.0,
        zero_after_ms,
    }
}

/// Returns the error that theory predicts, % of the peak force.
fn predicted(p: &Parameters, truth: &[f64], halvings: u32) -> f64 {
    let answer_n = libm::exp2(-17f64);
    let force_n = libm::exp2(-29f64) * p.a_n_per_s * (p.tau1_s + p.tau2_s);
    let peak_n = peak(truth) * libm::exp2(-f64::from(halvings));
    AT_FULL + (answer_n + force_n) / peak_n * 100.0
}

/// Returns the longest time from the last pulse until a muscle is at rest, ms, over all cells;
/// the largest number if one never is.
fn slowest_to_zero() -> u32 {
    let cells = TRAINS.iter().flat_map(|(_, pulses)| {
        let subjects = SUBJECTS.iter().map(|p| (p, *pulses));
        subjects.flat_map(|of| HALVINGS.map(|halvings| (of, halvings)))
    });
    let times = cells.map(|((p, pulses), halvings)| run(p, pulses, &[1.0], halvings).zero_after_ms);
    times.map(|ms| ms.unwrap_or(u32::MAX)).max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_force_comes_to_exactly_zero() {
        let ms = slowest_to_zero();
        println!("at rest {ms} ms after the last pulse at the latest");
        assert!(ms < REST_MS);
    }

    #[test]
    fn full_drive_is_as_accurate_as_documented() {
        for p in &SUBJECTS {
            let truth = truth(p, 40);
            assert!(run(p, 40, &truth, 0).error <= AT_FULL);
        }
    }
}
