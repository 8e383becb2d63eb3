//! A session of nearly a day through the program: complete, and in little memory. It takes minutes
//! and must be requested by name:
//!
//! ```text
//! cargo test --release -p host-tool --test suite a_day -- --ignored --nocapture
//! ```

use super::program::{FLEXOR, one_channel, test_folder, write_file};
use host_core::record;
use std::fs::{self, File};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::thread::sleep;
use std::time::Duration;

/// Largest memory that a command may use, kB.
const MOST_KB: u64 = 300_000;

/// 23 h 50 min.
const LENGTH_S: f64 = 85_800.0;

/// Waits for a program, and returns its peak memory in kB, as Linux counts.
fn watched(mut child: Child) -> (ExitStatus, u64) {
    let path = format!("/proc/{}/status", child.id());
    let mut most_kb = 0;
    loop {
        let status = fs::read_to_string(&path).unwrap_or_default();
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let peak = peak.and_then(|text| text.trim().strip_suffix(" kB")?.parse().ok());
        most_kb = most_kb.max(peak.unwrap_or(0));
        if let Some(exit) = child.try_wait().unwrap() {
            return (exit, most_kb);
        }
        sleep(Duration::from_millis(20));
    }
}

/// Counts the rows of `samples.csv`, after a check that their times rise by 10 ms to the end.
fn rows_of_a_day(path: &Path) -> u64 {
    let mut last_us = None;
    let mut rows = 0;
    for line in BufReader::new(File::open(path).unwrap()).lines().skip(1) {
        let line = line.unwrap();
        let (t_s, _) = line.split_once(',').unwrap();
        let (whole, behind) = t_s.split_once('.').unwrap();
        assert_eq!(behind.len(), 6, "{t_s}");
        let t_us = whole.parse::<u64>().unwrap() * 1_000_000 + behind.parse::<u64>().unwrap();
        let step_us = t_us - last_us.unwrap_or(t_us);
        assert!(rows == 0 || step_us == 10_000, "{step_us} µs before {t_s}");
        last_us = Some(t_us);
        rows += 1;
    }
    let end_s = last_us.unwrap() as f64 / 1e6;
    assert!(
        (LENGTH_S - 0.01..LENGTH_S + 1.0).contains(&end_s),
        "{end_s} s"
    );
    rows
}

#[test]
#[ignore = "minutes: a session of 23 h 50 min"]
fn a_day_is_recorded_whole_in_little_memory() {
    let folder = test_folder("a_day");
    let text = one_channel(LENGTH_S, 2)
        .replace("[wearer]", "[wearer]\nmax_session_s = 86400")
        .replace("frequency_hz = 50.0", "frequency_hz = 0.5");
    write_file(&folder, "day.toml", &text);
    for line in ["run day.toml --out one --vcd out.vcd", "report one"] {
        let mut program = Command::new(FLEXOR);
        let child = program.current_dir(&folder).args(line.split(' ')).spawn();
        let (exit, most_kb) = watched(child.unwrap());
        println!("{line}: {most_kb} kB at most");
        assert!(exit.success(), "{line}");
        assert!(most_kb > 0 && most_kb <= MOST_KB, "{line}: {most_kb} kB");
    }
    let run = record::load(&folder.join("one")).unwrap();
    let trial = &run.trials[0];
    let rows = rows_of_a_day(
        &record::trial_folder(&folder.join("one"), 0, &trial.name).join("samples.csv"),
    );
    assert_eq!(rows, trial.samples.len() as u64);
    println!("{rows} rows, {:?} pulses", trial.pulses);
    for (t_s, event) in &trial.events {
        assert!(
            (LENGTH_S..LENGTH_S + 1.0).contains(t_s),
            "{event} at {t_s} s"
        );
    }
}
