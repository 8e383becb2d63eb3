//! Set-up of a fresh machine: the chip's target, two components, QEMU, Python, gdb.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::image::TARGET;
use super::report::Report;
use std::path::Path;

/// System programs: name, package, description.
const PROGRAMS: [[&str; 3]; 4] = [
    ["qemu-system-arm", "qemu-system-arm", "QEMU for Arm systems"],
    [
        "python3",
        "python3",
        "Python, for tests/judge/judge.py and an example client",
    ],
    [
        "gdb-multiarch",
        "gdb-multiarch",
        "gdb for Arm, for the chip simulator's debug server",
    ],
    [
        "valgrind",
        "valgrind",
        "valgrind, which counts the host's instructions",
    ],
];

/// Makes one check for each requirement: it is present, or is installed now.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut report = target(at, console).unwrap_or_else(Report::from_error);
    report.add(components(at, console).unwrap_or_else(Report::from_error));
    for program in PROGRAMS {
        let found = ensure_installed(at, console, program, "--version");
        report.add(found.unwrap_or_else(Report::from_error));
    }
    Ok(report)
}

pub(super) fn runs_successfully(
    at: &Workspace,
    console: &mut Console,
    program: &str,
    arguments: &[&str],
) -> bool {
    execute(at, console, program, arguments).is_ok_and(|finished| finished.success)
}

/// Returns whether the compiler has the library for `target`. Asks the compiler, which also works
/// without rustup.
pub(super) fn has_target(
    at: &Workspace,
    console: &mut Console,
    target: &str,
) -> anyhow::Result<bool> {
    let question = ["--print", "target-libdir", "--target", target];
    let answer = execute(at, console, "rustc", &question)?;
    let folder = answer.lines.last().map(Path::new);
    Ok(answer.success && folder.is_some_and(Path::is_dir))
}

/// Returns whether the compiler has the library for `target`, after an attempt to install it by
/// rustup.
pub(super) fn obtain_target(
    at: &Workspace,
    console: &mut Console,
    target: &str,
) -> anyhow::Result<bool> {
    if has_target(at, console, target)? {
        return Ok(true);
    }
    let added = execute(at, console, "rustup", &["target", "add", target]);
    Ok(added.is_ok_and(|done| done.success))
}

fn target(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    if has_target(at, console, TARGET)? {
        return Ok(Report::pass());
    }
    let done = execute(at, console, "rustup", &["target", "add", TARGET])?;
    Ok(done.report(&format!("rustup target add {TARGET}")))
}

fn components(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let present = runs_successfully(at, console, "cargo", &["fmt", "--version"])
        && runs_successfully(at, console, "cargo", &["clippy", "--version"]);
    if present {
        return Ok(Report::pass());
    }
    let add = ["component", "add", "rustfmt", "clippy"];
    let done = execute(at, console, "rustup", &add)?;
    Ok(done.report("rustup component add rustfmt clippy"))
}

/// Checks that a program responds to its `version` argument, or installs its package.
pub(super) fn ensure_installed(
    at: &Workspace,
    console: &mut Console,
    [program, package, what]: [&str; 3],
    version: &str,
) -> anyhow::Result<Report> {
    if runs_successfully(at, console, program, &[version]) {
        return Ok(Report::pass());
    }
    let user = execute(at, console, "id", &["-u"]);
    let is_root = user.is_ok_and(|user| user.lines == ["0"]);
    if !is_root || !runs_successfully(at, console, "apt-get", &["--version"]) {
        let advice = format!("install {program} ({what}) with your package manager");
        return Ok(Report::fail(vec![advice]));
    }
    execute(at, console, "apt-get", &["update"])?; // if this fails, the next line reports it
    let install = ["install", "-y", "--no-install-recommends", package];
    let done = execute(at, console, "apt-get", &install)?;
    Ok(done.report(&format!("apt-get install {package}")))
}
