//! Runs the image in QEMU and measures its time.

use super::BenchError;
use hal_sim::qemu::StartError;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = "qemu-system-arm";

/// Runs the program `elf` in QEMU to its end with `extra` arguments for QEMU. Returns its output,
/// and the time from its first line on, which excludes the start of QEMU.
pub(super) fn run(elf: &Path, extra: &[&str]) -> Result<(String, Duration), BenchError> {
    let mut child = Command::new(PROGRAM)
        .args(["-M", "netduinoplus2", "-display", "none"])
        .args(["-monitor", "none", "-serial", "null"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(extra)
        .arg("-kernel")
        .arg(elf)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => StartError::NotInstalled,
            _ => StartError::Io(error),
        })?;
    let mut console = String::new();
    let mut begin = Instant::now();
    if let Some(output) = child.stdout.take() {
        let mut output = BufReader::new(output);
        output.read_line(&mut console).map_err(StartError::Io)?;
        begin = Instant::now();
        output
            .read_to_string(&mut console)
            .map_err(StartError::Io)?;
    }
    let time = begin.elapsed();
    let end = child.wait_with_output().map_err(StartError::Io)?;
    if !end.status.success() {
        let words = String::from_utf8_lossy(&end.stderr);
        let why = format!("{} ({}) {console}", words.trim(), end.status);
        return Err(StartError::Failed(why).into());
    }
    Ok((console, time))
}
