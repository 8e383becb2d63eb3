//! Execution of a program under QEMU.

use super::Program;
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const QEMU: &str = "qemu-system-arm";
const PATIENCE: Duration = Duration::from_secs(60);

/// Returns the records of `program`, one after another, computed by QEMU. Its output must be named
/// `output`; files go to `directory`.
///
/// # Errors
/// Fails if QEMU is not installed, does not end, or fails.
pub fn records(program: &Program, directory: &Path, output: &str) -> Result<Vec<u8>> {
    let image = directory.join(format!("{output}.image"));
    std::fs::write(&image, &program.flash)?;
    let mut child = Command::new(QEMU)
        .args([
            "-M",
            "netduinoplus2",
            "-display",
            "none",
            "-monitor",
            "none",
        ])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-serial", "null", "-kernel"])
        .arg(&image)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .with_context(|| {
            format!("{QEMU} did not start: is the package qemu-system-arm installed?")
        })?;
    let ended = wait(&mut child)?;
    let words = child.wait_with_output()?;
    let words = String::from_utf8_lossy(&words.stderr).trim().to_owned();
    ensure!(
        ended,
        "seed {}: {QEMU} did not end in {PATIENCE:?}: {words}",
        program.seed
    );
    let path = directory.join(output);
    let records = std::fs::read(&path).with_context(|| format!("{}: {words}", path.display()))?;
    for path in [&path, &image] {
        std::fs::remove_file(path)?;
    }
    Ok(records)
}

/// Returns whether QEMU ended in time; kills it otherwise.
fn wait(child: &mut Child) -> Result<bool> {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        if child.try_wait()?.is_some() {
            return Ok(true);
        }
        sleep(Duration::from_millis(2));
    }
    child.kill()?;
    Ok(false)
}
