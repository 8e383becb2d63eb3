//! Fits to simulated wrists whose constants are known.

use hal_sim::body::bench::{SensorSpec, Wrist, WristSpec};
use hal_sim::body::{Body, Drive, Pulse};
use host_core::identify::{Fit, ForceRecord, NAMES, PARAMETERS, Weighting, cramer_rao_bound};
use std::time::Instant;

const BEFORE_US: u64 = 500_000;

/// Simulates a one-second train at each frequency, with rests, at the amplitude at which A is
/// defined.
fn records(spec: WristSpec, seed: u64, frequencies_hz: &[u64]) -> Vec<ForceRecord> {
    let mut wrist = Wrist::new(spec, seed).unwrap();
    let mut begin_us = 0;
    let train = |frequency: &u64| {
        let pulses = (0..*frequency).map(|i| BEFORE_US + i * (1_000_000 / frequency));
        let pulses: Vec<u64> = pulses.collect();
        for at_us in &pulses {
            wrist.pulse(&Pulse {
                t_us: begin_us + at_us,
                channel: spec.channel,
                drive: Drive::Milliamps(spec.reference_ma),
                width_us: 400,
                conducted: false,
            });
        }
        let sample = |i: u64| {
            wrist.advance(begin_us + 1_000 * i);
            wrist.instrument_n().unwrap()
        };
        let samples_n = (0..2_500).map(sample).collect();
        begin_us += 10_000_000;
        ForceRecord {
            pulses_us: pulses.iter().map(|pulse| *pulse as u32).collect(),
            samples_n,
            gain: 1.0,
        }
    };
    frequencies_hz.iter().map(train).collect()
}

fn all() -> [u64; 3] {
    [20, 30, 40]
}

/// Shows that the arithmetic is right; no evidence about people or about muscles with another
/// structure.
#[test]
fn without_noise_the_constants_come_back() {
    for subject in 0..10 {
        let mut spec = WristSpec::subject(subject).unwrap();
        // Without any noise the record would look like that of a stuck sensor.
        spec.sensor.noise_n = 1e-6;
        let truth = spec.generator.parameters.all();
        for weighting in [Weighting::Whitened, Weighting::Averaged] {
            let begin = Instant::now();
            let fitted = Fit { weighting }
                .fit_records(&records(spec, 1, &all()))
                .unwrap();
            // Alone this takes 0.06 s, but other tests may run at the same time.
            assert!(begin.elapsed().as_secs_f64() < 1.0);
            for ((found, truth), name) in fitted.constants.iter().zip(truth).zip(NAMES) {
                assert!(
                    (found / truth - 1.0).abs() < 1e-3,
                    "{subject} {name}: {found} {truth}"
                );
            }
        }
    }
}

#[test]
fn intervals_are_as_wide_as_the_bound_and_cover() {
    let spec = WristSpec::subject(0).unwrap();
    let truth = spec.generator.parameters.all();
    for weighting in [Weighting::Whitened, Weighting::Averaged] {
        let (mut covered, mut squares, mut errors) =
            ([0; PARAMETERS], [0.0; PARAMETERS], [0.0; PARAMETERS]);
        for seed in 1..=40 {
            let records = records(spec, seed, &all());
            let fitted = Fit { weighting }.fit_records(&records).unwrap();
            assert!(
                (fitted.noise_n / 0.05 - 1.0).abs() < 0.2,
                "{weighting:?} {}",
                fitted.noise_n
            );
            let bound = cramer_rao_bound(truth, &records, 0.05).unwrap();
            for (i, estimate) in fitted.estimates().iter().enumerate() {
                covered[i] += u32::from(estimate.covers(truth[i]));
                squares[i] += ((estimate.value / truth[i]).ln() / bound.errors()[i]).powi(2) / 40.0;
                errors[i] += fitted.covariance[i][i].sqrt() / bound.errors()[i] / 40.0;
            }
            assert!(fitted.untold.is_empty());
        }
        // The stated errors equal the bound and the actual errors: χ² with 40 degrees of freedom
        // exceeds 1.9 · 40 once in a thousand.
        assert!(
            errors.iter().all(|error| (0.98..1.05).contains(error)),
            "{errors:?}"
        );
        assert!(
            squares.iter().all(|square| *square < 1.9),
            "{weighting:?} {squares:?}"
        );
        // With a probability of 0.95, fewer than 33 of 40 happen once in ten thousand.
        assert!(
            covered.iter().all(|count| *count >= 33),
            "{weighting:?} {covered:?}"
        );
    }
}

#[test]
fn a_record_without_decay_is_refused_and_a_saturated_one_too() {
    let spec = WristSpec::subject(0).unwrap();
    let mut short = records(spec, 1, &[40]);
    short[0].samples_n.truncate(1_700);
    let fit = Fit {
        weighting: Weighting::Whitened,
    };
    assert!(
        fit.fit_records(&short)
            .unwrap_err()
            .to_string()
            .starts_with("E643")
    );
    let sensor = SensorSpec {
        range_n: 6.0,
        ..spec.sensor
    };
    let ends = records(WristSpec { sensor, ..spec }, 1, &[40]);
    assert!(
        fit.fit_records(&ends)
            .unwrap_err()
            .to_string()
            .starts_with("E640")
    );
    let sensor = SensorSpec {
        is_upside_down: true,
        ..spec.sensor
    };
    let hangs = records(WristSpec { sensor, ..spec }, 1, &[40]);
    assert!(
        fit.fit_records(&hangs)
            .unwrap_err()
            .to_string()
            .starts_with("E641")
    );
}
