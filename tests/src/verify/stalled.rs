//! `cargo verify stalled`: tests over real ports beside eight busy loops.
//!
//! Not part of an ordinary run, because it takes three times as long as those tests on an otherwise
//! busy computer.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::report::Report;
use super::suite;
use anyhow::Context;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Number of busy loops.
const BUSY: usize = 8;

/// Number of runs in a row.
const RUNS: usize = 3;

/// Seconds for which keep-alives are timed.
const TIMED_S: &str = "60";

/// Packages with tests over real ports, and their folders.
const PACKAGES: [(&str, &str); 4] = [
    ("hal-sim", "hal-sim"),
    ("host-core", "host-tool/core"),
    ("host-tool", "host-tool"),
    ("tests", "tests"),
];

/// Code that marks tests over a socket or a terminal.
const MARKS: [&str; 6] = [
    "Board::tcp",
    "Board::serve",
    "TcpWire",
    "PtyWire",
    "TcpPort",
    "SerialPort",
];

/// Runs every test over a real port three times, and measures how late keep-alives are.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut report = Report::default();
    let mut packages = Vec::new();
    for (package, folder) in PACKAGES {
        let modules = modules(&at.root.join(folder).join("tests"))?;
        if !modules.is_empty() {
            let names = modules.join(" ");
            report.lines.push(format!("{package}: {names}"));
            packages.push((package, modules));
        }
        let build = ["test", "-p", package, "--test", "suite", "--no-run"];
        let built = execute(at, console, "cargo", &build)?;
        if !built.success {
            return Ok(built.report(&format!("cargo {}", build.join(" "))));
        }
    }
    with_busy_loops(|| {
        for _ in 0..RUNS {
            for (package, modules) in &packages {
                let mut arguments = vec!["test", "-p", *package, "--test", "suite", "--"];
                arguments.extend(modules.iter().map(String::as_str));
                report.add(suite::judge(execute(at, console, "cargo", &arguments)?));
            }
        }
        let flexor = ["run", "-q", "-p", "host-tool", "--bin", "flexor", "--"];
        let timed = [&flexor[..], &["selftest", "--keep-alives", TIMED_S]].concat();
        let mut timed = execute(at, console, "cargo", &timed)?;
        report.lines.append(&mut timed.lines);
        Ok(())
    })?;
    Ok(report)
}

/// Runs `work` beside [`BUSY`] threads that compute endlessly.
fn with_busy_loops(work: impl FnOnce() -> anyhow::Result<()>) -> anyhow::Result<()> {
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..BUSY {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let done = work();
        is_over.store(true, Ordering::Relaxed);
        done
    })
}

/// Returns the modules of a package's test program in `folder` that use real ports, as filters for
/// `cargo test`.
fn modules(folder: &Path) -> anyhow::Result<Vec<String>> {
    let unread = || format!("{} cannot be read", folder.display());
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unread)? {
        let path = entry.with_context(unread)?.path();
        if uses_ports(&path)?
            && let Some(stem) = path.file_stem().and_then(|stem| stem.to_str())
        {
            names.push(format!("{stem}::"));
        }
    }
    names.sort();
    Ok(names)
}

fn uses_ports(path: &Path) -> anyhow::Result<bool> {
    let unread = || format!("{} cannot be read", path.display());
    if path.is_dir() {
        for entry in std::fs::read_dir(path).with_context(unread)? {
            if uses_ports(&entry.with_context(unread)?.path())? {
                return Ok(true);
            }
        }
        return Ok(false);
    }
    if path.extension().is_none_or(|end| end != "rs") {
        return Ok(false);
    }
    let text = std::fs::read_to_string(path).with_context(unread)?;
    Ok(MARKS.iter().any(|mark| text.contains(mark)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_over_real_ports_are_found_by_what_they_use() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let port_modules = |folder: &str| modules(&root.join(folder)).unwrap();
        assert_eq!(port_modules("hal-sim/tests"), ["wire_pty::", "wire_tcp::"]);
        let host = port_modules("host-tool/tests");
        for module in [
            "calibrate_cli::",
            "interruptions::",
            "lift_live::",
            "serve::",
        ] {
            assert!(host.iter().any(|host| host == module), "{module}: {host:?}");
        }
        assert!(!host.iter().any(|host| host == "trigger::"), "{host:?}");
    }

    #[test]
    fn busy_loops_end_with_the_work() {
        assert!(with_busy_loops(|| Ok(())).is_ok());
        assert!(with_busy_loops(|| anyhow::bail!("no")).is_err());
    }
}
