//! Spelling of code and documents, checked by the program `typos`.
//!
//! In: the working tree; `typos.toml` lists intentional spellings. Out: each mistake, as
//! `file:line`. The program is taken from the path, or installed below Cargo's target folder from
//! Python's package index, which has it prebuilt.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::report::Report;
use super::setup::runs_successfully;
use std::path::PathBuf;

/// Package and version that this step installs.
const PACKAGE: &str = "typos==1.52.0";

/// Advice on manual installation.
const ADVICE: &str = "install typos (spelling): `pip install typos` or `cargo install typos-cli`";

pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let Some(program) = find(at, console) else {
        return Ok(Report::fail(vec![ADVICE.to_owned()]));
    };
    let program = program.to_string_lossy();
    let done = execute(at, console, &program, &["--format", "brief"])?;
    Ok(done.report("typos"))
}

/// Returns the program on the path or in the target folder, and installs it there if necessary.
fn find(at: &Workspace, console: &mut Console) -> Option<PathBuf> {
    let folder = at.target.join("typos");
    let installed = folder.join("bin").join("typos");
    let is_found = |program: &PathBuf, console: &mut Console| {
        runs_successfully(at, console, &program.to_string_lossy(), &["--version"])
    };
    for program in [PathBuf::from("typos"), installed.clone()] {
        if is_found(&program, console) {
            return Some(program);
        }
    }
    let folder = folder.to_string_lossy();
    let install = [
        "-m", "pip", "install", "--quiet", "--target", &folder, PACKAGE,
    ];
    execute(at, console, "python3", &install).ok()?;
    is_found(&installed, console).then_some(installed)
}
