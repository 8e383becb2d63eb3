//! `cargo verify changed`: the unit tests of the packages that differ from the last commit or,
//! without differences, that the last commit changed.
//!
//! Part of `cargo verify quick`, but not of an ordinary run, which tests all packages.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::report::Report;
use super::suite;
use std::collections::BTreeSet;

/// Folder of each package, nested folders first.
const PACKAGES: [(&str, &str); 9] = [
    ("host-tool/core/", "host-core"),
    ("host-tool/dfu/", "dfu"),
    ("host-tool/hil/", "hil"),
    ("host-tool/methods/", "methods"),
    ("host-tool/studies/", "studies"),
    ("host-tool/", "host-tool"),
    ("firmware/", "firmware"),
    ("hal-sim/", "hal-sim"),
    ("tests/", "tests"),
];

pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut files = git(
        at,
        console,
        &["status", "--porcelain", "--no-renames", "-uall"],
    )?;
    // Lines have the form "XY path".
    files = files
        .iter()
        .filter_map(|line| line.get(3..))
        .map(str::to_owned)
        .collect();
    if files.is_empty() {
        files = git(at, console, &["show", "--name-only", "--format=", "HEAD"])?;
    }
    let packages = packages_of(files.iter().map(String::as_str));
    if packages.is_empty() {
        return Ok(Report::default());
    }
    let mut arguments = vec!["test", "--lib", "--bins", "--no-fail-fast"];
    arguments.extend(packages.iter().flat_map(|name| ["--package", name]));
    let mut report = suite::judge(execute(at, console, "cargo", &arguments)?);
    let packages: Vec<_> = packages.into_iter().collect();
    report
        .lines
        .push(format!("packages: {}", packages.join(", ")));
    Ok(report)
}

/// Runs git and returns its output.
fn git(at: &Workspace, console: &mut Console, words: &[&str]) -> anyhow::Result<Vec<String>> {
    let finished = execute(at, console, "git", words)?;
    anyhow::ensure!(
        finished.success,
        "git {}: {}",
        words.join(" "),
        finished.lines.join("\n")
    );
    Ok(finished.lines)
}

/// Returns the packages that contain these files.
fn packages_of<'a>(files: impl Iterator<Item = &'a str>) -> BTreeSet<&'static str> {
    let package = |file: &str| PACKAGES.iter().find(|(folder, _)| file.starts_with(folder));
    files.filter_map(package).map(|(_, name)| *name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_belongs_to_the_innermost_package() {
        let files = [
            "host-tool/core/src/run/mod.rs",
            "host-tool/src/main.rs",
            "docs/link.md",
            "host-tool/core/src/lib.rs",
        ];
        let packages: Vec<_> = packages_of(files.into_iter()).into_iter().collect();
        assert_eq!(packages, ["host-core", "host-tool"]);
    }
}
