//! The Python package: format, lints, types and tests.
//!
//! In: `host-tool/python`, the tools in [`LOCK`]. Out: one check for each tool, and the counts of
//! pytest. Builds the extension in the dev profile and puts it beside a copy of the package in
//! Cargo's target folder; nothing is written into the source tree.

pub(super) mod environment;
mod pytest;
pub(super) mod site;

use super::Workspace;
use super::command::{cargo, execute_with};
use super::console::Console;
use super::report::Report;
use environment::{Environment, Interpreter};
use std::path::{Path, PathBuf};

/// Folder of the package's sources, tests and lock file.
const FOLDER: &str = "host-tool/python";

/// Versions and hashes of the tools, with what they depend on.
const LOCK: &str = "host-tool/python/requirements-verify.txt";

/// Folder that contains the package as Python imports it.
const PACKAGES: &str = "host-tool/python/python";

/// Cargo arguments that build the extension. Together with the program it shares the libraries that
/// the steps before have built; alone it would need all of them again, with fewer features.
const BUILD: [&str; 5] = ["build", "-p", "flexor-python", "-p", "host-tool"];

/// Checks the package; skipped if this machine has no suitable Python and cannot install it.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let interpreter = match Interpreter::obtain(at, console) {
        Ok(interpreter) => interpreter,
        Err(reason) => return Ok(Report::skip(format!("python: {reason}"))),
    };
    let folder = at.target.join("python");
    let venv = install_tools(at, console, &interpreter, &folder)?;
    let mut report = check_sources(at, console, &venv, &folder)?;
    let (built, site) = build_package(at, console)?;
    let is_built = built.failed == 0;
    report.add(built);
    if is_built {
        report.add(check_extension(at, console, &venv, &site)?);
    }
    Ok(report)
}

/// Builds the program and the package. Returns the result of the build, and the folder from which
/// Python imports the package.
pub(super) fn build_package(
    at: &Workspace,
    console: &mut Console,
) -> anyhow::Result<(Report, PathBuf)> {
    let site = at.target.join("python").join("site");
    let built = cargo(at, console, &BUILD)?;
    if built.failed == 0 {
        site::assemble(&at.root.join(PACKAGES), &at.target.join("debug"), &site)?;
    }
    Ok((built, site))
}

/// Returns the environment with the tools of the lock file.
pub(super) fn install_tools(
    at: &Workspace,
    console: &mut Console,
    interpreter: &Interpreter,
    folder: &Path,
) -> anyhow::Result<Environment> {
    let lock = std::fs::read_to_string(at.root.join(LOCK))?;
    let arguments = ["--require-hashes", "-r", LOCK];
    interpreter.environment(at, console, &folder.join("venv"), &lock, &arguments)
}

/// Runs the tools that read only sources.
fn check_sources(
    at: &Workspace,
    console: &mut Console,
    venv: &Environment,
    folder: &Path,
) -> anyhow::Result<Report> {
    let cache = folder.join("mypy").to_string_lossy().into_owned();
    let tools: [(&str, &[&str]); 3] = [
        ("ruff", &["check", "--no-cache", FOLDER]),
        ("ruff", &["format", "--check", "--no-cache", FOLDER]),
        ("mypy", &["--strict", "--cache-dir", &cache]),
    ];
    let mut report = Report::default();
    for (tool, arguments) in tools {
        let program = venv.program(tool);
        let variables = [("MYPYPATH", PACKAGES), ("PYTHONPATH", "")];
        let done = execute_with(at, console, &program, arguments, &variables)?;
        report.add(done.report(&format!("{tool} {}", arguments[0])));
    }
    Ok(report)
}

/// Compares the extension with its stub, and runs the tests.
fn check_extension(
    at: &Workspace,
    console: &mut Console,
    venv: &Environment,
    site: &Path,
) -> anyhow::Result<Report> {
    let python = venv.program("python");
    let settings = site.with_file_name("settings");
    let (site, settings) = (site.to_string_lossy(), settings.to_string_lossy());
    let variables = [
        ("MYPYPATH", PACKAGES),
        ("PYTHONPATH", &site),
        ("PYTHONDONTWRITEBYTECODE", "1"),
        // Otherwise notebooks and plots would write into the home folder.
        ("IPYTHONDIR", &settings),
        ("MPLCONFIGDIR", &settings),
        ("MPLBACKEND", "Agg"),
    ];
    let stubtest = ["-m", "mypy.stubtest", "flexor._native"];
    let done = execute_with(at, console, &python, &stubtest, &variables)?;
    let mut report = done.report("stubtest flexor._native");
    let tests = format!("{FOLDER}/tests");
    let arguments = [&["-m", "pytest"], &pytest::OPTIONS[..], &[&tests]].concat();
    let done = execute_with(at, console, &python, &arguments, &variables)?;
    report.add(pytest::judge(done));
    Ok(report)
}
