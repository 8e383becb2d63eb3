//! Tells the program which commit it is built from. Without git, or outside of
//! a checkout, it knows none, and says so in its records.

use std::process::Command;

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}

fn main() {
    let commit = git(&["rev-parse", "HEAD"]).unwrap_or_default();
    let modified = match git(&[
        "status",
        "--porcelain",
        "--untracked-files=no",
        "--",
        "../..",
    ]) {
        Some(_) if commit.is_empty() => String::new(),
        Some(changes) => (!changes.is_empty()).to_string(),
        None => String::new(),
    };
    println!("cargo::rustc-env=FLEXOR_GIT={commit}");
    println!("cargo::rustc-env=FLEXOR_MODIFIED={modified}");
    // What moves with a commit, and all that the program is made of.
    let head = git(&["rev-parse", "--git-path", "logs/HEAD"]);
    let sources = ["src", "build.rs", "Cargo.toml", "../../Cargo.lock"];
    let below = [
        "../src",
        "../sessions",
        "../studies/src",
        "../methods/src",
        "../../firmware/src",
        "../../hal-sim/src",
    ];
    for path in head.iter().map(String::as_str).chain(sources).chain(below) {
        println!("cargo::rerun-if-changed={path}");
    }
}
