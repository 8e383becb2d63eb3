//! `flexor muscle` as other people's checks use it: columns, both models against
//! the 40-digit solution, and what bad input is told.

use crate::flexor::{has, run};
use std::path::{Path, PathBuf};

const GOLDEN: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../tests/golden/golden_force.json"
);

/// K01 of Lee 2020, table 4.
const K01: &str = "--a-n-per-s 121.9 --k 0.3 --tau-c-ms 20.8 --tau1-ms 33.1 --tau2-ms 194.4";

fn csv_of(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("muscle");
    std::fs::create_dir_all(&folder).unwrap();
    folder.join(format!("{test}.csv"))
}

/// Exit code and standard error of `flexor muscle`.
fn muscle(csv: &Path, line: &str) -> (Option<i32>, String) {
    let csv = ["--csv", csv.to_str().unwrap()];
    let arguments = ["muscle"].into_iter().chain(line.split(' ')).chain(csv);
    let (exit, _, said) = run(Path::new("."), &arguments.collect::<Vec<_>>());
    (exit, said)
}

/// Rows of t_s, c, force_n.
fn rows(test: &str, line: &str) -> Vec<[f64; 3]> {
    let csv = csv_of(test);
    let (exit, said) = muscle(&csv, line);
    assert_eq!(exit, Some(0), "{said}");
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
    let golden: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(GOLDEN).unwrap()).unwrap();
    let mut worst = [0f64; 2];
    for (name, case) in golden["cases"].as_object().unwrap() {
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let subject = case["subject"].as_str().unwrap();
        let index: usize = subject[1..].parse().unwrap();
        let p = hal_sim::body::muscle::SUBJECTS[index - 1];
        let line = format!(
            "--a-n-per-s {:.6} --k {:.6} --tau-c-ms {:.6} --tau1-ms {:.6} --tau2-ms {:.6} \
             --frequency-hz {} --train-s 1 --duration-s 1.5",
            p.a_n_per_s,
            p.k,
            p.tau_c_s * 1e3,
            p.tau1_s * 1e3,
            p.tau2_s * 1e3,
            number(&case["freq_hz"])
        );
        let force: Vec<f64> = case["F_N"].as_array().unwrap().iter().map(number).collect();
        let peak = number(&case["peak_N"]);
        for (i, model) in ["reference", "fixed"].into_iter().enumerate() {
            let rows = rows(
                &format!("{name}_{model}"),
                &format!("{line} --model {model}"),
            );
            assert_eq!(rows.len(), force.len());
            for (n, (row, truth)) in rows.iter().zip(&force).enumerate() {
                assert!((row[0] - n as f64 * 0.01).abs() < 1e-9);
                worst[i] = worst[i].max((row[2] - truth).abs() / peak);
            }
        }
    }
    println!(
        "reference {:.1e} of peak, fixed {:.4} %",
        worst[0],
        worst[1] * 100.0
    );
    assert!(worst[0] <= 1e-12 && worst[1] <= 2e-4, "{worst:?}");
}

#[test]
fn a_file_of_pulses_is_the_train_it_lists() {
    let pulses = csv_of("pulses").with_extension("txt");
    let times: Vec<String> = (0..40).map(|i| (i * 25_000).to_string()).collect();
    std::fs::write(&pulses, times.join("\n")).unwrap();
    for model in ["fixed", "reference"] {
        let with = |name: &str, extra: &str| {
            let line = format!("{K01} {extra} --duration-s 1.2 --model {model}");
            rows(&format!("pulses_{model}_{name}"), &line)
        };
        let train = with("train", "--frequency-hz 40 --train-s 1");
        let listed = with("listed", &format!("--pulses-us {}", pulses.display()));
        for (a, b) in train.iter().zip(&listed) {
            assert!((a[2] - b[2]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        }
        // Figures of our own study of the paper.
        let [_, c, force] = train[100];
        assert!((c - 0.429_828_76).abs() < 1e-5 && (force - 14.864_717_96).abs() < 2e-3);
    }
}

#[test]
fn bad_input_is_named_with_what_is_allowed() {
    let good = format!("{K01} --frequency-hz 40 --train-s 1 --duration-s 1");
    for (model, name, value, allowed) in [
        ("fixed", "--k", "0", "0.002 to 5"),
        ("fixed", "--k", "NaN", "0.002 to 5"),
        ("fixed", "--k", "-1", "0.002 to 5"),
        ("fixed", "--tau1-ms", "0", "2 to 200"),
        ("fixed", "--tau2-ms", "1001", "1 to 1000"),
        ("fixed", "--tau-c-ms", "inf", "5 to 100"),
        ("fixed", "--a-n-per-s", "0", "0.1 to 10000"),
        ("reference", "--k", "0", "0.002 to 5"),
        ("reference", "--tau1-ms", "-5", "2 to 200"),
        ("reference", "--tau-c-ms", "NaN", "5 to 100"),
        ("fixed", "--frequency-hz", "201", "0.5 to 200"),
        ("fixed", "--duration-s", "NaN", "0 to 3600"),
    ] {
        let mut words: Vec<&str> = good.split(' ').chain(["--model", model]).collect();
        let at = words.iter().position(|word| *word == name).unwrap();
        // With a space, as people type it.
        words[at + 1] = value;
        let (exit, said) = muscle(&csv_of("bad"), &words.join(" "));
        assert_eq!(exit, Some(2), "{name} {value}: {said}");
        has(
            &said,
            &[&format!("{name} is {value}: allowed is {allowed}")],
        );
    }
    let (exit, said) = muscle(&csv_of("bad"), &format!("{good} --model exact"));
    assert_eq!(exit, Some(2));
    has(&said, &["fixed", "reference"]);
}

/// Eight pulses every 5 ms for a second: the reference answers, the device's fixed
/// point says where it ends.
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
        let rest = format!("--duration-s 2 --model {model}");
        let line = format!("{K01} --pulses-us {} {rest}", file.display());
        muscle(&csv_of("bursts"), &line)
    };
    let (exit, said) = run("fixed");
    assert_eq!(exit, Some(2), "{said}");
    has(&said, &["--tau-c-ms", "24"]);
    assert_eq!(run("reference").0, Some(0));
}
