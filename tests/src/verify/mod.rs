//! The runner behind `cargo verify`.
//!
//! Contains the list of steps and the final report. Each step counts passed and failed checks and
//! never stops the next step, so that every problem shows at once. Tests of the product do not
//! belong here. In: the working tree, and the names of steps or a time for searching with fresh
//! seeds. Out: lines for people; exit code 0 (all passed), 1 (something failed) or 2 (invalid
//! arguments); as the last line `N passed, N failed[, N skipped]`.

mod arguments;
mod book;
mod budget;
mod changed;
mod cluster;
mod command;
mod console;
mod fresh;
mod image;
mod licences;
mod playground;
mod portable;
mod profile;
mod python;
mod release;
mod report;
mod rules;
mod setup;
mod soak;
mod spelling;
mod stalled;
mod suite;
mod windows;

use arguments::VerifyMode;
use command::cargo;
use console::{Console, seconds};
use report::Report;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Longest time for a clean checkout on two cores.
const WHOLE_RUN: Duration = Duration::from_secs(15 * 60);

/// Commands that the README shows, run as a user would.
const README_COMMANDS: &[&str] = &["demo"];

type Run = fn(&Workspace, &mut Console) -> anyhow::Result<Report>;

/// Steps in the order in which they depend on each other.
const STEPS: &[(&str, Run)] = &[
    ("set-up", setup::run),
    ("rules", |at, _| rules::run(&at.root)),
    ("spelling", spelling::run),
    ("format", format),
    ("lints", lints),
    ("windows", windows::run),
    ("portable", portable::run),
    ("profile", profile::run),
    ("image-lints", image::lint),
    ("images", image::build),
    ("budgets", |at, _| budget::run(at)),
    ("tests", suite::run),
    ("instructions", instructions),
    ("python", python::run),
    ("playground", playground::run),
    ("book", book::run),
    ("licences", licences::run),
    ("fresh", fresh::run),
    ("readme", readme),
];

/// Steps that run only by name.
const BY_NAME: &[(&str, Run)] = &[
    ("changed", changed::run),
    ("stalled", stalled::run),
    ("cluster", cluster::run),
    ("wheels", release::wheels),
    ("archives", release::archives),
];

/// Names of several steps: those that take two minutes, and those of a release.
const GROUPS: [(&str, &[&str]); 2] = [
    ("quick", &["rules", "format", "lints", "changed"]),
    ("release", &["wheels", "archives"]),
];

/// Folders of the working tree.
#[derive(Debug)]
struct Workspace {
    /// Folder with the workspace's `Cargo.toml`.
    root: PathBuf,
    /// Cargo's target folder.
    target: PathBuf,
}

impl Workspace {
    fn find() -> anyhow::Result<Self> {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let program = std::env::current_exe()?;
        Ok(Self {
            root: package.parent().unwrap_or(package).to_owned(),
            // The program is <target>/debug/verify.
            target: program.ancestors().nth(2).unwrap_or(package).to_owned(),
        })
    }
}

/// Runs the steps named after `cargo verify`.
#[must_use]
pub fn main(words: &[String]) -> ExitCode {
    let steps = STEPS.iter().chain(BY_NAME);
    let names: Vec<_> = steps
        .map(|(name, _)| *name)
        .chain(GROUPS.map(|(name, _)| name))
        .collect();
    let wanted = match arguments::parse(words, &names) {
        Ok(wanted) => wanted,
        Err(problem) => {
            eprintln!("error: {problem}\n{}", arguments::USAGE);
            return ExitCode::from(2);
        }
    };
    let workspace = match Workspace::find() {
        Ok(workspace) => workspace,
        Err(error) => {
            eprintln!("error: {error:#}");
            return ExitCode::FAILURE;
        }
    };
    match wanted {
        VerifyMode::Help => {
            println!("{}\nsteps: {}", arguments::USAGE, names.join(" "));
            ExitCode::SUCCESS
        }
        VerifyMode::Steps(wanted) => verify(&workspace, &wanted),
        VerifyMode::Soak(length) => soak::run_fresh_seeds(&workspace, length),
        VerifyMode::SoakSeed(seed) => soak::run_seed(&workspace, seed),
    }
}

/// Runs the steps named in `wanted`, or all if it is empty.
fn verify(workspace: &Workspace, wanted: &[String]) -> ExitCode {
    let begin = Instant::now();
    let mut console = Console::new();
    let mut done = Vec::new();
    let steps: Vec<_> = match wanted.is_empty() {
        true => STEPS.iter().collect(),
        false => {
            let known_steps = STEPS.iter().chain(BY_NAME);
            let is_wanted = |name: &str| {
                let mut groups = GROUPS.iter().filter(|(_, steps)| steps.contains(&name));
                let is_named = |name: &str| wanted.iter().any(|word| word == name);
                is_named(name) || groups.any(|(group, _)| is_named(group))
            };
            known_steps.filter(|(name, _)| is_wanted(name)).collect()
        }
    };
    for (index, (name, run)) in steps.iter().enumerate() {
        console.begin(&format!("[{}/{}] {name}", index + 1, steps.len()));
        let since = Instant::now();
        let report = run(workspace, &mut console).unwrap_or_else(Report::from_error);
        console.end(&report);
        done.push((*name, since.elapsed(), report));
    }
    print_summary(&mut done, begin.elapsed())
}

/// Prints slow and failed steps, and the closing line.
fn print_summary(done: &mut [(&str, Duration, Report)], total: Duration) -> ExitCode {
    println!();
    for (name, _, report) in done.iter().filter(|(_, _, report)| report.failed > 0) {
        println!("failed: {name} ({} failures, see above)", report.failed);
    }
    done.sort_by_key(|(_, time, _)| std::cmp::Reverse(*time));
    let slowest: Vec<_> = done
        .iter()
        .take(3)
        .map(|(name, time, _)| format!("{name} {}", seconds(*time)))
        .collect();
    println!(
        "{} in total; slowest steps: {}",
        seconds(total),
        slowest.join(", ")
    );
    if total > WHOLE_RUN {
        println!(
            "note: this is longer than the allowed {}",
            seconds(WHOLE_RUN)
        );
    }
    let mut summary = Report::default();
    for (_, _, report) in done.iter_mut() {
        summary.add(std::mem::take(report));
    }
    if std::env::var("CI").is_ok_and(|value| value == "true") && summary.skipped > 0 {
        println!(
            "failed: {} skipped checks, because CI is true",
            summary.skipped
        );
        summary.fail_skipped();
    }
    println!("{}", summary.counts());
    ExitCode::from(u8::from(summary.failed > 0))
}

/// Checks the format of the workspace and of the fuzz targets, which are a separate workspace.
/// Lists the files only; `cargo fmt` formats them.
fn format(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let workspace = ["fmt", "--all", "--", "--check", "-l"];
    let mut report = cargo(at, console, &workspace)?;
    let manifest = "tests/fuzz/Cargo.toml";
    let fuzz = ["fmt", "--manifest-path", manifest, "--", "--check", "-l"];
    report.add(cargo(at, console, &fuzz)?);
    Ok(report)
}

fn lints(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let selection = ["--workspace", "--all-targets", "--keep-going"];
    let denied = ["--", "-D", "warnings"];
    cargo(
        at,
        console,
        &[&["clippy"][..], &selection, &denied].concat(),
    )
}

/// Counts the host's instructions of three sessions, and compares them with their budgets.
fn instructions(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let arguments = "run --package tests --no-default-features --bin instructions -- --dev";
    cargo(at, console, &arguments.split(' ').collect::<Vec<_>>())
}

fn readme(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let mut report = Report::default();
    for command in README_COMMANDS {
        report.add(cargo(at, console, &[command])?);
    }
    Ok(report)
}
