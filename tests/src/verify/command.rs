//! Execution of other programs, with progress and captured output.

use super::Workspace;
use super::console::Console;
use super::report::Report;
use anyhow::Context;
use std::io::{BufRead, BufReader, pipe};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Interval at which a silent program's line is refreshed.
const REFRESH: Duration = Duration::from_millis(200);

/// Longest time for which the output of an ended program may stay open and silent; a process that
/// the program left behind could keep it open forever.
const LINGER: Duration = Duration::from_secs(5);

/// First words of cargo's and rustup's routine messages.
const CHATTER: &str = "Adding Blocking Checking Compiling Downloaded Downloading Finished Fresh \
                       Installing Locking Running Unpacking Updating info:";

/// Result of a program that has ended.
#[derive(Debug)]
pub(super) struct Finished {
    /// Whether the program ended with exit code 0.
    pub success: bool,
    /// Lines of standard output and standard error, in the order in which they were written.
    pub lines: Vec<String>,
}

impl Finished {
    /// Returns one check, passed if the program succeeded, with its output as the reason otherwise.
    pub fn report(self, action: &str) -> Report {
        if self.success {
            return Report::pass();
        }
        let mut lines = vec![format!("`{action}` failed:")];
        lines.extend(
            self.lines
                .into_iter()
                .filter(|line| !is_progress_line(line)),
        );
        Report::fail(lines)
    }
}

/// Runs `program` in the workspace until it ends.
pub(super) fn execute(
    at: &Workspace,
    console: &mut Console,
    program: &str,
    arguments: &[&str],
) -> anyhow::Result<Finished> {
    execute_with(at, console, program, arguments, &[])
}

/// Runs `program` like [`execute`], with these environment variables.
pub(super) fn execute_with(
    at: &Workspace,
    console: &mut Console,
    program: &str,
    arguments: &[&str],
    variables: &[(&str, &str)],
) -> anyhow::Result<Finished> {
    let (output, input) = pipe()?;
    let mut command = Command::new(program);
    command
        .args(arguments)
        .current_dir(&at.root)
        .env("CARGO_TERM_COLOR", "never")
        .env("RUST_BACKTRACE", "0")
        .env("DEBIAN_FRONTEND", "noninteractive")
        .envs(variables.iter().copied())
        .stdin(Stdio::null())
        .stdout(input.try_clone()?)
        .stderr(input);
    let mut child = command
        .spawn()
        .with_context(|| format!("`{program}` cannot be started"))?;
    drop(command); // holds ends of the pipe, which would never close
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(output).split(b'\n').map_while(Result::ok) {
            let text = String::from_utf8_lossy(&line).trim_end().to_owned();
            if sender.send(text).is_err() {
                break;
            }
        }
    });
    let mut lines: Vec<String> = Vec::new();
    let mut silent = Duration::ZERO;
    while silent < LINGER {
        match receiver.recv_timeout(REFRESH) {
            Ok(line) => lines.push(line),
            Err(RecvTimeoutError::Timeout) if child.try_wait()?.is_some() => silent += REFRESH,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        console.show_progress(lines.last().map_or("", String::as_str));
    }
    let success = child.wait()?.success();
    Ok(Finished { success, lines })
}

/// Runs a cargo command as one check.
pub(super) fn cargo(
    at: &Workspace,
    console: &mut Console,
    arguments: &[&str],
) -> anyhow::Result<Report> {
    let command_line = format!("cargo {}", arguments.join(" "));
    Ok(execute(at, console, "cargo", arguments)?.report(&command_line))
}

fn is_progress_line(line: &str) -> bool {
    let first = line.split_whitespace().next();
    first.is_some_and(|first| CHATTER.split(' ').any(|word| word == first))
}

/// Returns flags of the compiler, as cargo encodes them, that replace the folders of this computer
/// in the messages of panics.
pub(super) fn without_folders(root: &Path) -> String {
    let home = std::env::var_os("HOME")
        .map(PathBuf::from)
        .unwrap_or_default();
    let cargo = std::env::var_os("CARGO_HOME").map_or(home.join(".cargo"), PathBuf::from);
    let folders = [(root, "flexor"), (&cargo, "cargo")];
    let flags = folders.map(|(folder, name)| {
        let folder = folder.display();
        format!("--remap-path-prefix={folder}={name}")
    });
    flags.join("\u{1f}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_shows_reasons_without_chatter() {
        let lines = ["   Compiling x v1", "error: no", "", "    Checking y"];
        let finished = Finished {
            success: false,
            lines: lines.map(str::to_owned).to_vec(),
        };
        let report = finished.report("cargo x");
        assert_eq!((report.passed, report.failed), (0, 1));
        assert_eq!(report.lines, ["`cargo x` failed:", "error: no", ""]);
    }

    #[test]
    fn both_outputs_arrive_in_order_with_the_verdict() {
        let at = Workspace {
            root: std::env::temp_dir(),
            target: std::env::temp_dir(),
        };
        let script = "echo one; echo two >&2; echo three; exit 3";
        let finished = execute(&at, &mut Console::new(), "sh", &["-c", script]).unwrap();
        assert!(!finished.success);
        assert_eq!(finished.lines, ["one", "two", "three"]);
        assert!(execute(&at, &mut Console::new(), "no-such-program", &[]).is_err());
        let leaves_one_behind = ["-c", "sleep 20 & echo done"];
        let finished = execute(&at, &mut Console::new(), "sh", &leaves_one_behind).unwrap();
        assert!(finished.success);
        assert_eq!(finished.lines, ["done"]);
    }
}
