//! `cargo verify release`: everything that is published, built, installed and tried out.
//!
//! Not part of an ordinary run, because it builds program, images and Python extension anew, with
//! link-time optimisation. In: the working tree, `pyproject.toml`. Out: wheels and a source
//! distribution in `python/dist` of Cargo's target folder, and with them the archives and their sums
//! in `dist`.

mod distribution;
mod program;
mod third_party;

use super::Workspace;
use super::command::{Finished, execute_with, without_folders};
use super::console::Console;
use super::python::environment::{Environment, Interpreter};
use super::report::Report;
use super::{setup, windows};
use anyhow::Context;
use distribution::{Distribution, Kind};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// Largest size of a wheel, in bytes.
const MAX_WHEEL_BYTES: u64 = 2_500_000;

/// Oldest C library on which the wheel for Linux runs: glibc 2.28.
const COMPATIBILITY: &str = "manylinux_2_28";

/// Program that a user would run first. It fails if the simulator emits hardly any pulse.
const SMOKE_TEST: &str = "import flexor\n\
    pulses = flexor.run('reciprocal', seed=1).pulses\n\
    assert pulses > 1000, f'{pulses} pulses'\n";

/// Linker for Windows: name, package, description.
const WINDOWS_LINKER: [&str; 3] = [
    "x86_64-w64-mingw32-gcc",
    "gcc-mingw-w64-x86-64",
    "linker for Windows",
];

/// The parts of `pyproject.toml` that name packages for the build.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Project {
    build_system: BuildSystem,
    dependency_groups: BTreeMap<String, Vec<String>>,
}

#[derive(Debug, Deserialize)]
struct BuildSystem {
    requires: Vec<String>,
}

/// Tools and folders of a release.
struct Release {
    interpreters: Vec<Interpreter>,
    /// Environment with maturin, zig and the tools that check distributions.
    tools: Environment,
    /// Folder for environments and distributions.
    folder: PathBuf,
}

/// Builds, checks and installs each distribution of the Python package.
pub(super) fn wheels(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let release = Release::prepare(at, console)?;
    let mut report = Report::default();
    for kind in [Kind::Linux, Kind::Source, Kind::Windows] {
        let done = release.check(at, console, kind);
        report.add(done.unwrap_or_else(Report::from_error));
    }
    Ok(report)
}

/// Builds program, images and book, packs them, and tries the program out.
pub(super) fn archives(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    program::run(at, console)
}

impl Release {
    fn prepare(at: &Workspace, console: &mut Console) -> anyhow::Result<Self> {
        let first = Interpreter::obtain(at, console).map_err(anyhow::Error::msg)?;
        let folder = at.target.join("python");
        let packages = packages(&fs::read_to_string(at.root.join("pyproject.toml"))?)?;
        let words: Vec<&str> = packages.iter().map(String::as_str).collect();
        let venv = folder.join("release-venv");
        let tools = first.environment(at, console, &venv, &packages.join("\n"), &words)?;
        let dist = folder.join("dist");
        if dist.exists() {
            fs::remove_dir_all(&dist)?;
        }
        Ok(Self {
            interpreters: Interpreter::all(at, console),
            tools,
            folder,
        })
    }

    /// Builds one distribution, checks and installs it.
    fn check(&self, at: &Workspace, console: &mut Console, kind: Kind) -> anyhow::Result<Report> {
        if kind == Kind::Windows
            && let Some(lacking) = Self::lacks_windows(at, console)?
        {
            return Ok(lacking);
        }
        let built = self.build(at, console, kind)?;
        if !built.success {
            return Ok(built.report(&format!("maturin, {}", kind.description())));
        }
        let distribution = Distribution::find(&self.folder.join("dist"), kind)?;
        let mut report = distribution.size_report(MAX_WHEEL_BYTES);
        report.add(self.inspect(at, console, &distribution)?);
        match kind {
            Kind::Linux => {
                for interpreter in &self.interpreters {
                    report.add(self.try_out(at, console, interpreter, &distribution)?);
                }
            }
            Kind::Source => {
                let first = self.interpreters.first().context("no interpreter")?;
                report.add(self.try_out(at, console, first, &distribution)?);
            }
            Kind::Windows => report.lines.push(format!(
                "{}: built, never run on Windows",
                distribution.name()
            )),
        }
        Ok(report)
    }

    fn build(&self, at: &Workspace, console: &mut Console, kind: Kind) -> anyhow::Result<Finished> {
        let dist = self.folder.join("dist");
        let out = ["--out", &dist.to_string_lossy()].map(str::to_owned);
        let target = ["--target-dir", &at.target.to_string_lossy()].map(str::to_owned);
        let wheel = ["build", "--profile", "wheel"];
        let own: &[&str] = match kind {
            Kind::Linux => &["--zig", "--compatibility", COMPATIBILITY],
            Kind::Windows => &["--target", windows::TARGET],
            Kind::Source => &[],
        };
        let words: Vec<&str> = match kind {
            Kind::Source => ["sdist"]
                .into_iter()
                .chain(out.iter().map(String::as_str))
                .collect(),
            Kind::Linux | Kind::Windows => {
                let shared = out.iter().chain(&target).map(String::as_str);
                wheel
                    .into_iter()
                    .chain(own.iter().copied())
                    .chain(shared)
                    .collect()
            }
        };
        let maturin = self.tools.program("maturin");
        // maturin finds zig through the first Python of the path.
        let path = std::env::var("PATH").unwrap_or_default();
        let path = format!("{}:{path}", self.tools.programs().display());
        let flags = without_folders(&at.root);
        let variables = [("PATH", &*path), ("CARGO_ENCODED_RUSTFLAGS", &flags)];
        execute_with(at, console, &maturin, &words, &variables)
    }

    /// Checks the metadata of a distribution and, for a wheel, that it uses only the stable
    /// interface of Python 3.11.
    fn inspect(
        &self,
        at: &Workspace,
        console: &mut Console,
        distribution: &Distribution,
    ) -> anyhow::Result<Report> {
        let path = distribution.path().to_string_lossy();
        let mut checks: Vec<(&str, &[&str])> = vec![("twine", &["check", "--strict"])];
        if distribution.kind() != Kind::Source {
            checks.push(("abi3audit", &["--strict"]));
        }
        let mut report = Report::default();
        for (tool, options) in checks {
            let words = [options, &[&path]].concat();
            let done = execute_with(at, console, &self.tools.program(tool), &words, &[])?;
            report.add(done.report(&format!("{tool} {}", distribution.name())));
        }
        Ok(report)
    }

    /// Installs a distribution in an empty environment, and runs a session.
    fn try_out(
        &self,
        at: &Workspace,
        console: &mut Console,
        interpreter: &Interpreter,
        distribution: &Distribution,
    ) -> anyhow::Result<Report> {
        let folder = self.folder.join("empty-venv");
        let venv = interpreter.empty_environment(at, console, &folder)?;
        let path = distribution.path().to_string_lossy();
        // Only a source distribution is compiled; its dependencies are kept for the next time.
        let target = self.folder.join("source-target");
        let variables = [("CARGO_TARGET_DIR", &*target.to_string_lossy())];
        venv.install(at, console, &["--quiet", &path], &variables)?;
        let words = ["-I", "-c", SMOKE_TEST];
        let done = execute_with(at, console, &venv.program("python"), &words, &[])?;
        fs::remove_dir_all(&folder)?;
        let name = distribution.name();
        Ok(done.report(&format!("first session by {}, {name}", interpreter.program)))
    }

    /// Returns the reason why this machine cannot build for Windows, after an attempt to install
    /// what is missing.
    fn lacks_windows(at: &Workspace, console: &mut Console) -> anyhow::Result<Option<Report>> {
        if !setup::obtain_target(at, console, windows::TARGET)? {
            let reason = format!("`rustup target add {}` failed", windows::TARGET);
            return Ok(Some(Report::skip(format!("wheel for Windows: {reason}"))));
        }
        let linker = setup::ensure_installed(at, console, WINDOWS_LINKER, "--version")?;
        let reason = linker.lines.join("; ");
        let is_lacking = linker.failed > 0;
        Ok(is_lacking.then(|| Report::skip(format!("wheel for Windows: {reason}"))))
    }
}

/// Returns the packages that build and check distributions, with their versions.
fn packages(project: &str) -> anyhow::Result<Vec<String>> {
    let project: Project = toml::from_str(project).context("pyproject.toml")?;
    let group = project.dependency_groups.get("release");
    let group = group.context("pyproject.toml has no dependency group `release`")?;
    Ok([project.build_system.requires, group.clone()].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_tool_of_a_release_has_a_version() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let project = fs::read_to_string(root.join("pyproject.toml")).unwrap();
        let packages = packages(&project).unwrap();
        assert!(
            packages
                .iter()
                .any(|package| package.starts_with("maturin=="))
        );
        assert!(
            packages.iter().all(|package| package.contains("==")),
            "{packages:?}"
        );
    }
}
