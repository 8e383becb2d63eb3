//! Simulators and sessions without features, for other systems: a browser, which has no clock,
//! processes or sockets, and Windows. Checked without linking.

use super::Workspace;
use super::command::{cargo, execute};
use super::console::Console;
use super::report::Report;
use super::{setup, windows};

/// WebAssembly without an operating system.
const BROWSER: &str = "wasm32-unknown-unknown";

/// Cargo arguments for the packages, without their features.
const PACKAGES: [&str; 5] = ["-p", "hal-sim", "-p", "host-core", "--no-default-features"];

/// Crates that need an operating system or are large, and so belong to a feature.
const LEFT_OUT: [&str; 6] = [
    "chrono",
    "defmt-decoder",
    "nix",
    "object",
    "serialport",
    "socket2",
];

/// Checks each target, and that the features exclude crates. A target is skipped if the compiler
/// has no library for it and rustup cannot fetch it.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut report = Report::default();
    for target in [BROWSER, windows::TARGET] {
        report.add(match setup::obtain_target(at, console, target)? {
            true => {
                let check = [&["check"], &PACKAGES[..], &["--target", target]];
                cargo(at, console, &check.concat())?
            }
            false => skipped(target),
        });
    }
    report.add(check_left_out(at, console)?);
    Ok(report)
}

/// Checks that no crate of [`LEFT_OUT`] is built without features.
fn check_left_out(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let shape = ["--edges", "normal", "--prefix", "none"];
    let tree = [&["tree"], &PACKAGES[..], &shape].concat();
    let listed = execute(at, console, "cargo", &tree)?;
    if !listed.success {
        return Ok(listed.report("cargo tree"));
    }
    let found = unexpected_crates(&listed.lines);
    Ok(match found.is_empty() {
        true => Report::pass(),
        false => Report::fail(vec![format!(
            "portable: crates that are built although no feature needs them: {}",
            found.join(", ")
        )]),
    })
}

/// Returns the crates of [`LEFT_OUT`] that `cargo tree` lists.
fn unexpected_crates(lines: &[String]) -> Vec<&'static str> {
    let is_listed = |name: &&str| {
        let mut names = lines.iter().map(|line| line.split(' ').next());
        names.any(|listed| listed == Some(name))
    };
    LEFT_OUT.into_iter().filter(is_listed).collect()
}

fn skipped(target: &str) -> Report {
    Report::skip(format!(
        "portable: `rustup target add {target}` failed; hal-sim and host-core were not checked \
         for it"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crate_that_belongs_to_a_feature_is_found_by_its_whole_name() {
        let lines = ["nixon v1.0.0", "object v0.40.0 (*)", "chrono v0.4.45"].map(str::to_owned);
        assert_eq!(unexpected_crates(&lines), ["chrono", "object"]);
        assert!(unexpected_crates(&lines[..1]).is_empty());
    }

    #[test]
    fn a_target_that_cannot_be_had_is_skipped_by_name() {
        let report = skipped(BROWSER);
        assert_eq!((report.passed, report.failed, report.skipped), (0, 0, 1));
        assert!(report.lines[0].starts_with("skipped portable: "));
        assert!(report.lines[0].contains(BROWSER));
    }
}
