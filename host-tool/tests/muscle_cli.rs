//! Tests of `flexor muscle` as other people use it: columns, both models against the 40-digit
//! solution, and messages about bad input.

use crate::program;
use std::path::{Path, PathBuf};
use std::process::Output;

const GOLDEN: &str = include_str!("../../tests/golden/golden_force.json");

/// K01 of Lee 2020, table 4.
const K01: &str = "--a-n-per-s 121.9 --k 0.3 --tau-c-ms 20.8 --tau1-ms 33.1 --tau2-ms 194.4";

fn csv_of(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("muscle");
    std::fs::create_dir_all(&folder).unwrap();
    let csv = folder.join(format!("{test}.csv"));
    let _ = std::fs::remove_file(&csv); // a file of an earlier run
    csv
}

/// Runs `flexor muscle` with these arguments.
fn flexor(csv: &Path, words: &str) -> Output {
    let mut command = program::flexor_command(csv.parent().unwrap(), &["muscle"]);
    command.args(words.split(' ')).arg("--csv").arg(csv);
    command.output().unwrap()
}

/// Returns rows of t_s, c, force_n.
fn rows(test: &str, words: &str) -> Vec<[f64; 3]> {
    let csv = csv_of(test);
    let output = flexor(&csv, words);
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(csv).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t_s,c,force_n"));
    let row = |line: &str| {
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().unwrap()).collect();
        cells.try_into().unwrap()
    };
    lines.map(row).collect()
}

#[test]
fn both_models_meet_the_forty_digit_solution() {
    let golden: serde_json::Value = serde_json::from_str(GOLDEN).unwrap();
    let mut worst = [0f64; 2];
    for (name, case) in golden["cases"].as_object().unwrap() {
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let subject = case["subject"].as_str().unwrap();
        let index: usize = subject[1..].parse().unwrap();
        let p = hal_sim::body::muscle::SUBJECTS[index - 1];
        let (a, hz) = (p.a_n_per_s, number(&case["freq_hz"]));
        let [c, t1, t2] = [p.tau_c_s, p.tau1_s, p.tau2_s].map(|s| s * 1e3);
        let muscle = format!(
            "--a-n-per-s {a:.6} --k {:.6} --tau-c-ms {c:.6} --tau1-ms {t1:.6} --tau2-ms {t2:.6}",
            p.k
        );
        let train = format!("--frequency-hz {hz} --train-s 1 --seconds 1.5");
        let force: Vec<f64> = case["F_N"].as_array().unwrap().iter().map(number).collect();
        let peak = number(&case["peak_N"]);
        for (i, model) in ["reference", "fixed"].into_iter().enumerate() {
            let words = format!("{muscle} {train} --model {model}");
            let rows = rows(&format!("{name}_{model}"), &words);
            assert_eq!(rows.len(), force.len());
            for (n, (row, truth)) in rows.iter().zip(&force).enumerate() {
                assert!((row[0] - n as f64 * 0.01).abs() < 1e-9);
                worst[i] = worst[i].max((row[2] - truth).abs() / peak);
            }
        }
    }
    let (reference, fixed_pct) = (worst[0], worst[1] * 100.0);
    println!("reference {reference:.1e} of peak, fixed {fixed_pct:.4} %");
    assert!(worst[0] <= 1e-12 && worst[1] <= 2e-4, "{worst:?}");
}

#[test]
fn a_file_of_pulses_is_the_train_it_lists() {
    let pulses = csv_of("pulses").with_extension("txt");
    let times: Vec<String> = (0..40).map(|i| (i * 25_000).to_string()).collect();
    std::fs::write(&pulses, times.join("\n")).unwrap();
    for model in ["fixed", "reference"] {
        let with = |test: &str, extra: &str| {
            let words = format!("{K01} {extra} --seconds 1.2 --model {model}");
            rows(&format!("pulses_{model}_{test}"), &words)
        };
        let train = with("train", "--frequency-hz 40 --train-s 1");
        let listed = with("listed", "--pulses-us pulses.txt");
        for (a, b) in train.iter().zip(&listed) {
            assert!((a[2] - b[2]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        }
        // Values of our own study of the paper.
        let [_, c, force] = train[100];
        assert!((c - 0.429_828_76).abs() < 1e-5 && (force - 14.864_717_96).abs() < 2e-3);
    }
}

#[test]
fn pulses_that_do_not_rise_are_refused_with_their_line() {
    let file = csv_of("same").with_extension("txt");
    std::fs::write(&file, "0\n25000\n25000\n").unwrap();
    let refused = flexor(
        &csv_of("same"),
        &format!("{K01} --pulses-us same.txt --seconds 1"),
    );
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(
        message.contains("E519 ") && message.contains("line 3: 25000 µs"),
        "{message}"
    );
}

/// The prediction must not replace the list of pulses.
#[test]
fn a_prediction_never_replaces_what_it_reads() {
    let file = csv_of("own").with_extension("txt");
    std::fs::write(&file, "0\n25000\n").unwrap();
    let refused = flexor(&file, &format!("{K01} --pulses-us own.txt --seconds 1"));
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(message.contains("E586"), "{message}");
    assert_eq!(std::fs::read_to_string(file).unwrap(), "0\n25000\n");
}

#[test]
fn a_prediction_replaces_a_file_only_where_it_is_meant() {
    let file = csv_of("years");
    std::fs::write(&file, "years").unwrap();
    let words = format!("{K01} --frequency-hz 40 --train-s 1 --seconds 1");
    let refused = flexor(&file, &words);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(message.contains("E587"), "{message}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "years");
    let meant = flexor(&file, &(words + " --overwrite"));
    assert!(meant.status.success(), "{meant:?}");
}

#[test]
#[rustfmt::skip]
fn bad_input_is_named_with_what_is_allowed() {
    let good = format!("{K01} --frequency-hz 40 --train-s 1 --seconds 1");
    let cases = [
        ("fixed", "--k", "0", "--k is 0; allowed: 0.002 to 5"),
        ("fixed", "--k", "nan", "--k is NaN; allowed: 0.002 to 5"),
        ("fixed", "--k", "-1", "--k is -1; allowed: 0.002 to 5"),
        ("fixed", "--tau1-ms", "0", "--tau1-ms is 0; allowed: 2 to 200"),
        ("fixed", "--tau2-ms", "1001", "--tau2-ms is 1001; allowed: 1 to 1000"),
        ("fixed", "--tau-c-ms", "inf", "--tau-c-ms is inf; allowed: 5 to 100"),
        ("fixed", "--a-n-per-s", "0", "--a-n-per-s is 0; allowed: 0.1 to 10000"),
        ("reference", "--k", "0", "--k is 0; allowed: 0.002 to 5"),
        ("reference", "--tau1-ms", "-5", "--tau1-ms is -5; allowed: 2 to 200"),
        ("reference", "--tau-c-ms", "nan", "--tau-c-ms is NaN; allowed: 5 to 100"),
        ("fixed", "--frequency-hz", "201", "--frequency-hz is 201; allowed: 0.5 to 200"),
        ("fixed", "--seconds", "nan", "--seconds is NaN; allowed: 0.01 to 3600"),
        ("fixed", "--seconds", "0", "--seconds is 0; allowed: 0.01 to 3600"),
        ("fixed", "--k", "0.0025555", "--k is 0.0025555; the device works in steps of 0.000001"),
        ("reference", "--tau1-ms", "20.00049", "--tau1-ms is 20.00049; the device works in steps of 0.001"),
        ("exact", "--k", "0.3", "fixed"),
        ("exact", "--k", "0.3", "reference"),
    ];
    for (model, name, value, expected) in cases {
        let (before, after) = good.split_once(&format!("{name} ")).unwrap();
        let rest = after.split_once(' ').map_or("", |(_, rest)| rest);
        // With a space, as people type it.
        let words = format!("{before}{name} {value} {rest}");
        let output = flexor(&csv_of("bad"), &format!("{} --model {model}", words.trim()));
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name} {value}: {message}");
        assert!(message.contains(expected), "{name} {value}: {message}");
    }
}

/// Eight pulses every 5 ms for a second: the reference computes a force, the fixed-point model
/// reports its limit.
#[test]
fn pulses_too_fast_for_the_fixed_point_are_refused_by_name() {
    let mut times = String::new();
    for burst in 0..200 {
        for pulse in 0..8 {
            times.push_str(&format!("{}\n", burst * 5_000 + pulse * 600));
        }
    }
    let file = csv_of("bursts").with_extension("txt");
    std::fs::write(&file, times).unwrap();
    let run = |model| {
        let words = format!("{K01} --pulses-us bursts.txt --seconds 2 --model {model}");
        flexor(&csv_of("bursts"), &words)
    };
    let refused = run("fixed");
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert!(
        message.contains("--tau-c-ms") && message.contains("24"),
        "{message}"
    );
    assert!(run("reference").status.success());
}
