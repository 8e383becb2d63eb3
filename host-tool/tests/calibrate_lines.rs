//! Helpers that drive `flexor calibrate` by JSON lines.

use crate::program::flexor_command;
use serde_json::Value;
use std::io::BufRead;
use std::path::Path;
use std::process::{Child, Stdio};

/// Starts the program in a folder with a plan, with input and outputs piped.
pub fn start_calibration(folder: &Path, more: &[&str]) -> Child {
    let mut words = vec!["--json", "calibrate", "--electrodes", "plan.toml"];
    words.extend(["--out", "w.toml"]);
    words.extend(more);
    let mut command = flexor_command(folder, &words);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Returns the next line that satisfies the condition.
pub fn next_line(lines: &mut impl BufRead, is: impl Fn(&Value) -> bool) -> Value {
    loop {
        let mut line = String::new();
        assert!(lines.read_line(&mut line).unwrap() > 0, "it ended");
        let value: Value = serde_json::from_str(&line).unwrap();
        if is(&value) {
            return value;
        }
    }
}
