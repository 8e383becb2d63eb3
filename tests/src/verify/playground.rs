//! The page of `flexor playground`: its two WebAssembly modules, its files, and its tests in Node.js
//! and Chromium.
//!
//! In: the crate `flexor-web`, its page, the lock file of npm. Out: the page in `flexor-web` beside
//! the programs of Cargo's target folder, and one check for each test. Node.js and Chromium are
//! installed from Debian's packages if they are missing.

use super::Workspace;
use super::command::{Finished, cargo, execute, execute_with, without_folders};
use super::console::Console;
use super::report::Report;
use super::setup::{ensure_installed, obtain_target};
use anyhow::{Context, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// WebAssembly without an operating system.
const TARGET: &str = "wasm32-unknown-unknown";

/// Modules of the page, and the features of the crate that each has.
const MODULES: [(&str, &str); 2] = [("flexor", "sessions"), ("integrators", "integrators")];

/// Programs: name, package, description.
const PROGRAMS: [[&str; 3]; 3] = [
    ["node", "nodejs", "Node.js 20 or later"],
    ["npm", "npm", "package manager of Node.js"],
    ["chromium", "chromium", "browser for the tests of the page"],
];

/// Folder of the page's sources, in the root.
const SOURCE: &str = "host-tool/web";
/// Folder of the built page, beside a program.
pub(super) const BESIDE: &str = "flexor-web";

/// Largest sizes as a server sends them, bytes: main module, page with its scripts, editor.
const LIMITS: [(&str, i64); 3] = [
    ("flexor.wasm", 600_000),
    ("page", 150_000),
    ("editor", 120_000),
];

/// Features of WebAssembly that the compiler uses.
const WASM_FEATURES: [&str; 6] = [
    "--enable-bulk-memory",
    "--enable-sign-ext",
    "--enable-nontrapping-float-to-int",
    "--enable-mutable-globals",
    "--enable-multivalue",
    "--enable-reference-types",
];

/// Builds the page and tests it.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let (mut report, page) = match build(at, console)? {
        Ok(built) => built,
        Err(reason) => return Ok(Report::skip(format!("playground: {reason}"))),
    };
    if report.failed > 0 {
        return Ok(report);
    }
    report.add(types(at, console)?);
    // Of the same commit as the page, whose records name it.
    report.add(cargo(
        at,
        console,
        &["build", "-p", "host-tool", "--bin", "flexor"],
    )?);
    let program = at.target.join("debug/flexor");
    let out = at.target.join("page/records");
    let [tools, page, program, out] = [at.target.join("page"), page, program, out].map(text);
    for test in ["sessions.mjs", "long.mjs", "page.mjs"] {
        let script = format!("{SOURCE}/tests/{test}");
        let words = [
            &script,
            "--tools",
            &tools,
            "--page",
            &page,
            "--program",
            &program,
            "--out",
            &out,
        ];
        report.add(count(test, execute(at, console, "node", &words)?));
    }
    Ok(report)
}

/// Builds the page, and returns its folder; or the reason why it cannot be built here.
///
/// # Errors
/// Fails if a program cannot be started, or a file cannot be written.
pub(super) fn build(
    at: &Workspace,
    console: &mut Console,
) -> anyhow::Result<Result<(Report, PathBuf), String>> {
    if !obtain_target(at, console, TARGET)? {
        return Ok(Err(format!("`rustup target add {TARGET}` failed")));
    }
    for program in PROGRAMS {
        let found = ensure_installed(at, console, program, "--version")?;
        if found.failed > 0 {
            return Ok(Err(found.lines.join("; ")));
        }
    }
    let tools = at.target.join("page");
    fs::create_dir_all(&tools)?;
    let mut report = packages(at, console, &tools)?;
    for (module, feature) in MODULES {
        report.add(build_module(at, console, &tools, (module, feature))?);
    }
    if report.failed > 0 {
        return Ok(Ok((report, tools)));
    }
    let page = at.target.join("debug").join(BESIDE);
    let _ = fs::remove_dir_all(&page);
    let script = format!("{SOURCE}/build.mjs");
    let [tools, out] = [tools, page.clone()].map(text);
    let words = [&script, "--tools", &tools, "--wasm", &tools, "--out", &out];
    let built = execute(at, console, "node", &words)?;
    report.add(built.report("node build.mjs"));
    if report.failed == 0 {
        report.add(sizes(&page)?);
        if at.target.join("release").is_dir() {
            copy(&page, &at.target.join("release").join(BESIDE))?;
        }
    }
    Ok(Ok((report, page)))
}

/// Installs the packages of the lock file, unless they are installed.
fn packages(at: &Workspace, console: &mut Console, tools: &Path) -> anyhow::Result<Report> {
    let source = at.root.join(SOURCE);
    let lock = fs::read(source.join("package-lock.json"))?;
    let is_same = fs::read(tools.join("installed-lock.json")).is_ok_and(|old| old == lock);
    if is_same && tools.join("node_modules").is_dir() {
        return Ok(Report::pass());
    }
    for file in ["package.json", "package-lock.json", ".npmrc"] {
        fs::copy(source.join(file), tools.join(file))?;
    }
    let folder = tools.to_string_lossy();
    let words = ["ci", "--prefix", &folder, "--ignore-scripts"];
    let done = execute(at, console, "npm", &words)?;
    if done.success {
        fs::write(tools.join("installed-lock.json"), lock)?;
    }
    Ok(done.report("npm ci"))
}

fn build_module(
    at: &Workspace,
    console: &mut Console,
    tools: &Path,
    (module, feature): (&str, &str),
) -> anyhow::Result<Report> {
    let words = [
        "build",
        "-p",
        "flexor-web",
        "--target",
        TARGET,
        "--profile",
        "web",
        "--no-default-features",
        "--features",
        feature,
    ];
    let flags = without_folders(&at.root);
    let variables = [("CARGO_ENCODED_RUSTFLAGS", &*flags)];
    let built = execute_with(at, console, "cargo", &words, &variables)?;
    if !built.success {
        return Ok(built.report(&format!("cargo build -p flexor-web, {feature}")));
    }
    let raw = at.target.join(TARGET).join("web/flexor_web.wasm");
    let small = tools.join(format!("{module}.wasm"));
    let optimizer = tools.join("node_modules/binaryen/bin/wasm-opt");
    let [raw, small, optimizer] = [raw, small, optimizer].map(text);
    let mut words = vec![&*optimizer, "-Oz"];
    words.extend(WASM_FEATURES);
    words.extend([&*raw, "-o", &small]);
    let done = execute(at, console, "node", &words)?;
    Ok(done.report("wasm-opt"))
}

/// Checks the types of the page and of its scripts.
fn types(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let tools = at.target.join("page");
    // The compiler finds packages above the configuration, which is a copy beside them.
    let source = text(at.root.join(SOURCE).join("page"));
    let config = fs::read_to_string(at.root.join(SOURCE).join("tsconfig.json"))?;
    fs::write(tools.join("tsconfig.json"), config.replace("PAGE", &source))?;
    let [compiler, project] = [
        tools.join("node_modules/typescript/bin/tsc"),
        tools.join("tsconfig.json"),
    ]
    .map(text);
    let done = execute(at, console, "node", &[&compiler, "--project", &project])?;
    Ok(done.report("tsc"))
}

/// Compares the sizes that the build has measured with [`LIMITS`].
fn sizes(page: &Path) -> anyhow::Result<Report> {
    let measured: toml::Table = fs::read_to_string(page.join("sizes.toml"))?.parse()?;
    let mut report = Report::default();
    for (name, limit) in LIMITS {
        let size = measured.get(name).and_then(toml::Value::as_integer);
        let size = size.context("a size is missing")?;
        report.add(match size <= limit {
            true => Report::pass(),
            false => Report::fail(vec![format!("{name}: {size} bytes, at most {limit}")]),
        });
    }
    let sizes = measured.iter();
    let sizes: Vec<String> = sizes.map(|(name, size)| format!("{name} {size}")).collect();
    let note = format!("note: compressed, bytes: {}", sizes.join(", "));
    report.lines.push(note);
    Ok(report)
}

/// Counts the lines of a test script: `ok NAME` and `FAILED NAME`.
fn count(script: &str, done: Finished) -> Report {
    let mut report = Report::default();
    for line in &done.lines {
        if line.starts_with("ok ") {
            report.passed += 1;
        } else if line.starts_with("FAILED ") {
            report.add(Report::fail(vec![format!("{script}: {line}")]));
        } else if line.starts_with("note: ") {
            report.lines.push(line.clone());
        }
    }
    if report.passed == 0 || !done.success && report.failed == 0 {
        report.add(done.report(script));
    }
    report
}

/// Copies the files of a folder that has no folders.
pub(super) fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let path = entry?.path();
        ensure!(path.is_file(), "{} is a folder", path.display());
        fs::copy(&path, to.join(path.file_name().unwrap_or_default()))?;
    }
    Ok(())
}

fn text(path: PathBuf) -> String {
    path.to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(lines: &[&str], success: bool) -> Report {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        count("x.mjs", Finished { success, lines })
    }

    #[test]
    fn a_script_is_counted_line_by_line() {
        let report = counted(&["ok a", "FAILED b: c", "note: d", "other"], false);
        assert_eq!((report.passed, report.failed), (1, 1));
        assert_eq!(report.lines, ["x.mjs: FAILED b: c", "note: d"]);
    }

    #[test]
    fn a_script_that_checks_nothing_or_stops_has_failed() {
        assert_eq!(counted(&[], false).failed, 1);
        assert_eq!(counted(&["ok a", "TypeError"], false).failed, 1);
        assert_eq!(counted(&["ok a"], true).failed, 0);
    }
}
