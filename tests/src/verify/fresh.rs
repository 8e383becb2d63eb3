//! Check that a second build compiles nothing.
//!
//! Cargo rebuilds a package at every call if its build script names a missing file, and with it all
//! dependent packages: minutes at every edit. Each profile built by the steps before is built
//! again, and rebuilt packages are listed with Cargo's reason.

use super::Workspace;
use super::command::{Finished, execute};
use super::console::Console;
use super::image::Image;
use super::report::Report;

/// Builds for this computer: profile and arguments. For the release profile only the packages with
/// a build script are built, as libraries: linking the programs takes minutes, and only build
/// scripts make a package stale.
const BUILDS: [(&str, &[&str]); 3] = [
    ("dev", &["build", "--workspace"]),
    ("test", &["test", "--workspace", "--no-run"]),
    (
        "release",
        &[
            "build",
            "--release",
            "--lib",
            "-p",
            "firmware",
            "-p",
            "methods",
        ],
    ),
];

/// Runs each build twice; the second must compile nothing.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut report = Report::default();
    for (profile, arguments) in BUILDS {
        report.add(build_twice(at, console, profile, arguments)?);
    }
    for image in Image::all(at)? {
        let arguments = image.arguments("build");
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let profile = format!("the image {}", image.name);
        report.add(build_twice(at, console, &profile, &arguments)?);
    }
    Ok(report)
}

fn build_twice(
    at: &Workspace,
    console: &mut Console,
    profile: &str,
    arguments: &[&str],
) -> anyhow::Result<Report> {
    let first = execute(at, console, "cargo", arguments)?;
    if !first.success {
        return Ok(first.report(&format!("cargo {}", arguments.join(" "))));
    }
    let again = [arguments, &["--verbose"]].concat();
    Ok(judge(profile, execute(at, console, "cargo", &again)?))
}

/// Judges the verbose output of a second build.
fn judge(profile: &str, second: Finished) -> Report {
    if !second.success {
        return second.report(&format!("the second build of {profile}"));
    }
    let reports = |word: &'static str| {
        let has_word = move |line: &&String| line.split_whitespace().next() == Some(word);
        second.lines.iter().filter(has_word)
    };
    // Cargo prints the reason before it compiles.
    let stale: Vec<String> = reports("Dirty")
        .chain(reports("Compiling"))
        .cloned()
        .collect();
    if !stale.is_empty() {
        let heading = format!("a second build of {profile} compiles again:");
        return Report::fail([vec![heading], stale].concat());
    }
    match reports("Fresh").next() {
        Some(_) => Report::pass(),
        None => Report::fail(vec![format!(
            "a second build of {profile} does not report that it is fresh"
        )]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a test package whose build script names `watched`.
    fn package(name: &str, watched: &str) -> Workspace {
        let own = format!("flexor-fresh-{}-{name}", std::process::id());
        let root = std::env::temp_dir().join(own);
        let _ = std::fs::remove_dir_all(&root);
        std::fs::create_dir_all(root.join("src")).unwrap();
        let write = |file: &str, text: &str| std::fs::write(root.join(file), text).unwrap();
        let manifest = "[package]\nname = 'stale'\nversion = '0.1.0'\nedition = '2024'\n";
        write("Cargo.toml", &format!("{manifest}[workspace]\n"));
        write("src/lib.rs", "");
        let script = format!("fn main() {{ println!(\"cargo:rerun-if-changed={watched}\"); }}\n");
        write("build.rs", &script);
        let target = root.join("target");
        Workspace { root, target }
    }

    fn built(at: &Workspace) -> Report {
        let target = at.target.to_str().unwrap();
        let arguments = ["build", "--offline", "--target-dir", target];
        let report = build_twice(at, &mut Console::new(), "dev", &arguments).unwrap();
        std::fs::remove_dir_all(&at.root).unwrap();
        report
    }

    #[test]
    fn a_build_script_that_names_a_missing_file_is_found_by_name() {
        let fresh = built(&package("fresh", "build.rs"));
        assert_eq!(fresh, Report::pass());
        let stale = built(&package("stale", "nowhere.rs"));
        assert_eq!((stale.passed, stale.failed), (0, 1));
        let output = stale.lines.join("\n");
        for part in ["Dirty stale", "nowhere.rs", "Compiling stale"] {
            assert!(output.contains(part), "{part}: {output}");
        }
    }
}
