//! The simulator's muscle against an independent solution with 40 digits and against the tables of
//! Lee 2020.

use std::collections::BTreeMap;
use std::path::PathBuf;

use hal_sim::body::muscle::reference::{self, Sample, integrate, train};
use hal_sim::body::muscle::{Muscle, Parameters, SUBJECTS, Step};

fn golden(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/golden")
        .join(name)
}

fn table(name: &str) -> Vec<Vec<String>> {
    csv::Reader::from_path(golden(name))
        .unwrap()
        .records()
        .map(|r| r.unwrap().iter().map(str::to_owned).collect())
        .collect()
}

fn number(field: &str) -> f64 {
    field.parse().unwrap()
}

/// Returns the index of a subject; K01 is 0.
fn subject(name: &str) -> usize {
    name[1..].parse::<usize>().unwrap() - 1
}

fn peak(samples: &[Sample]) -> f64 {
    samples.iter().map(|s| s.force_n).fold(0.0, f64::max)
}

#[test]
fn reference_equals_the_forty_digit_solution() {
    let file = std::fs::read_to_string(golden("golden_force.json")).unwrap();
    let file: serde_json::Value = serde_json::from_str(&file).unwrap();
    let cases = file["cases"].as_object().unwrap();
    assert_eq!(cases.len(), 10);
    let mut worst: BTreeMap<&str, f64> = BTreeMap::new();
    for case in cases.values() {
        let p = SUBJECTS[subject(case["subject"].as_str().unwrap())];
        let frequency = case["freq_hz"].as_f64().unwrap();
        let samples = integrate(&p, &train(frequency, frequency as u32), 1.5, 0.01);
        let column = |name: &str| -> Vec<f64> {
            let values = case[name].as_array().unwrap();
            values.iter().map(|v| v.as_f64().unwrap()).collect()
        };
        let (force, c) = (column("F_N"), column("C"));
        assert_eq!(samples.len(), force.len());
        let peak = case["peak_N"].as_f64().unwrap();
        let c_peak = case["C_steady_after_pulse"].as_f64().unwrap();
        for (i, s) in samples.iter().enumerate() {
            let error = (s.force_n - force[i]).abs() / peak;
            let c_error = (s.c - c[i]).abs() / c_peak;
            worst
                .entry("F")
                .and_modify(|w| *w = w.max(error))
                .or_insert(error);
            worst
                .entry("C")
                .and_modify(|w| *w = w.max(c_error))
                .or_insert(c_error);
        }
    }
    println!("worst error of the reference, parts of peak: {worst:?}");
    assert!(worst.values().all(|w| *w <= 1e-12), "{worst:?}");
}

#[test]
fn reference_does_not_depend_on_the_sampling_interval() {
    for p in SUBJECTS {
        let pulses = [0.0, 0.0031, 0.0123456, 0.1, 0.35, 0.3501];
        let coarse = integrate(&p, &pulses, 0.6, 0.1);
        let fine = integrate(&p, &pulses, 0.6, 0.000_2);
        for (i, s) in coarse.iter().enumerate() {
            let difference = (s.force_n - fine[500 * i].force_n).abs();
            assert!(difference <= 1e-13 * peak(&fine), "{difference}");
        }
    }
}

#[test]
fn subjects_are_table_4_with_one_correction() {
    for row in table("lee2020_table4_force_model.csv") {
        let i = subject(&row[0]);
        let p = SUBJECTS[i];
        let ours = [
            p.a_n_per_s,
            p.k,
            1e3 * p.tau_c_s,
            1e3 * p.tau1_s,
            1e3 * p.tau2_s,
        ];
        for (column, ours) in ours.into_iter().enumerate() {
            let mut printed = number(&row[column + 1]);
            if i == 5 && column == 4 {
                assert_eq!(printed, 17.6, "table 4 as printed");
                printed = 176.0;
            }
            assert!((ours - printed).abs() < 1e-9, "{} {column}", row[0]);
        }
    }
}

/// Returns T0.9 − T0.1 of a one-second train, ms (Lee 2020 equation (9)).
fn response_time_ms(p: &Parameters, period_s: f64) -> f64 {
    let count = (1.0 / period_s - 1e-9).ceil() as u32;
    let pulses: Vec<f64> = (0..count).map(|i| f64::from(i) * period_s).collect();
    let samples = integrate(p, &pulses, 1.2, 0.000_02);
    let peak = peak(&samples);
    let reached = |part: f64| {
        samples
            .iter()
            .find(|s| s.force_n >= part * peak)
            .unwrap()
            .t_s
    };
    1e3 * (reached(0.9) - reached(0.1))
}

#[test]
fn response_times_are_table_7_but_for_k08() {
    // The 30 Hz column was computed with a 33.2 ms period: 166 steps of 0.2 ms.
    let periods_s = [0.05, 0.0332, 0.025];
    let rms = |errors: &[f64]| {
        let sum: f64 = errors.iter().map(|e| e * e).sum();
        (sum / errors.len() as f64).sqrt()
    };
    let (mut others, mut k08) = (Vec::new(), Vec::new());
    for row in table("lee2020_table7_response_time.csv") {
        let i = subject(&row[0]);
        for (column, period_s) in periods_s.into_iter().enumerate() {
            let ours = response_time_ms(&SUBJECTS[i], period_s);
            let printed = number(&row[column + 1]);
            println!("{} {period_s} s: {ours:.2} ms, printed {printed}", row[0]);
            let errors = if i == 7 { &mut k08 } else { &mut others };
            errors.push(ours - printed);
        }
    }
    println!("T_RT, nine subjects: {:.3} ms rms", rms(&others));
    println!("T_RT, K08: {:.3} ms rms", rms(&k08));
    assert_eq!(others.len(), 27);
    let worst = others.iter().map(|e| e.abs()).fold(0.0, f64::max);
    println!("T_RT, nine subjects: {worst:.2} ms at worst");
    assert!(worst < 1.0, "{worst}");
    assert!(rms(&others) < 0.5, "{}", rms(&others));
    // Known discrepancy: table 4's K08 does not give table 7's K08, by 38 ms at 20 Hz. If they ever
    // agree, one of the two tables here has been changed.
    for (ours, expected) in k08.iter().zip([37.98, 4.56, 17.28]) {
        assert!((ours - expected).abs() < 0.05, "K08 is off by {ours} now");
    }
}

#[test]
fn peaks_are_table_2_within_15_percent_and_7_percent_rms() {
    let (mut sum, mut count) = (0.0, 0.0);
    for row in table("lee2020_table2_peak_force.csv") {
        let p = SUBJECTS[subject(&row[0])];
        let frequency = number(&row[1]);
        let samples = integrate(&p, &train(frequency, frequency as u32), 1.1, 0.000_2);
        let error = peak(&samples) / number(&row[5]) - 1.0;
        println!("{} {frequency} Hz: {:+.1} %", row[0], 100.0 * error);
        assert!(error.abs() < 0.15, "{} {frequency} Hz: {error}", row[0]);
        sum += error * error;
        count += 1.0;
    }
    let rms = f64::sqrt(sum / count);
    println!("peaks: {:.2} % rms", 100.0 * rms);
    assert!(rms < 0.07, "{rms}");
}

#[test]
fn fast_path_stays_within_1e8th_of_peak() {
    let mut worst = 0.0f64;
    for p in SUBJECTS {
        for frequency in [10.0, 20.0, 40.0, 100.0] {
            let period_ms = (1000.0 / frequency) as u64;
            let truth = integrate(&p, &train(frequency, frequency as u32), 1.5, 0.001);
            let step = Step::new(&p, 0.001);
            let mut muscle = Muscle::new(p);
            for (ms, sample) in truth.iter().enumerate() {
                let difference = (muscle.force() - sample.force_n).abs();
                worst = worst.max(difference / peak(&truth));
                if ms < 1000 && (ms as u64).is_multiple_of(period_ms) {
                    muscle.pulse(1.0);
                }
                assert!((muscle.c() - sample.c).abs() < 1e-12);
                muscle.step(&step);
            }
        }
    }
    println!("fast path at 1 ms: {worst:.2e} of peak");
    assert!(worst < 1e-8, "{worst}");
}

#[test]
fn a_split_step_takes_a_pulse_at_its_own_microsecond() {
    let p = SUBJECTS[4];
    let truth = integrate(&p, &[0.000_337], 0.05, 0.001);
    let mut muscle = Muscle::new(p);
    muscle.step(&Step::new(&p, 0.000_337));
    muscle.pulse(1.0);
    muscle.step(&Step::new(&p, 0.000_663));
    let step = Step::new(&p, 0.001);
    for sample in &truth[1..] {
        assert!((muscle.force() - sample.force_n).abs() < 1e-8 * peak(&truth));
        muscle.step(&step);
    }
}

#[test]
fn normalised_muscle_has_mean_force_one() {
    let p = Parameters::mean_subject().normalised_at(50.0);
    let samples = integrate(&p, &reference::train(50.0, 500), 10.0, 0.000_1);
    let last_period = &samples[samples.len() - 200..];
    let mean = last_period.iter().map(|s| s.force_n).sum::<f64>() / 200.0;
    assert!((mean - 1.0).abs() < 1e-4, "{mean}");

    let known = Parameters::mean_subject_at_50_hz();
    let off = p.a_n_per_s / known.a_n_per_s - 1.0;
    assert!(
        off.abs() < 1e-14,
        "{off:e}: within a C library's exponential"
    );
    let a_n_per_s = p.a_n_per_s;
    assert_eq!(Parameters { a_n_per_s, ..known }, p);
}
