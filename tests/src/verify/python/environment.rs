//! Python interpreters and virtual environments.

use crate::verify::Workspace;
use crate::verify::command::execute_with;
use crate::verify::console::Console;
use crate::verify::setup;
use anyhow::Context;
use std::fs;
use std::path::{Path, PathBuf};

/// Names of supported interpreters, in the order in which they are tried.
const PROGRAMS: [&str; 4] = ["python3.11", "python3.12", "python3.13", "python3"];

/// Option that makes an interpreter end with success if its version is supported and it can create
/// environments.
const PROBE: &str = "-cimport sys, ensurepip, venv; sys.exit(sys.version_info < (3, 11))";

/// Requirement of [`PROBE`]: name, package, description.
const PACKAGE: [&str; 3] = [
    "python3",
    "python3-venv",
    "Python 3.11 or later with virtual environments",
];

/// File in an environment with the text that identifies its packages.
const STAMP: &str = "installed.txt";

/// Number of lines of pip's output that a failure shows.
const TAIL: usize = 12;

/// Python interpreter that can create environments.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(in crate::verify) struct Interpreter {
    /// Program on the path.
    pub program: &'static str,
}

/// Virtual environment.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(in crate::verify) struct Environment {
    folder: PathBuf,
}

impl Interpreter {
    /// Returns the supported interpreters of this machine.
    pub fn all(at: &Workspace, console: &mut Console) -> Vec<Self> {
        let mut found = PROGRAMS.to_vec();
        found.retain(|program| setup::runs_successfully(at, console, program, &[PROBE]));
        let interpreters = found.into_iter().map(|program| Self { program });
        interpreters.collect()
    }

    /// Returns the first supported interpreter, after an attempt to install one.
    ///
    /// # Errors
    /// Fails with a reason if there is none.
    pub fn obtain(at: &Workspace, console: &mut Console) -> Result<Self, String> {
        if let Some(first) = Self::all(at, console).into_iter().next() {
            return Ok(first);
        }
        let installed = setup::ensure_installed(at, console, PACKAGE, PROBE);
        let found = Self::all(at, console).into_iter().next();
        found.ok_or_else(|| match installed {
            Ok(report) if report.failed > 0 => report.lines.join("; "),
            Ok(_) => format!("{} is not available", PACKAGE[2]),
            Err(error) => format!("{error:#}"),
        })
    }

    /// Returns the environment in `folder`. Creates it and runs `pip install` with `arguments` if
    /// what was installed there was identified by another text than `identity`.
    ///
    /// # Errors
    /// Fails if the environment cannot be created or pip fails.
    pub fn environment(
        &self,
        at: &Workspace,
        console: &mut Console,
        folder: &Path,
        identity: &str,
        arguments: &[&str],
    ) -> anyhow::Result<Environment> {
        let stamp = folder.join(STAMP);
        let environment = Environment {
            folder: folder.to_owned(),
        };
        let python = environment.program("python");
        if fs::read_to_string(&stamp).is_ok_and(|text| text == identity)
            && setup::runs_successfully(at, console, &python, &[PROBE])
        {
            return Ok(environment);
        }
        self.create(at, console, &environment)?;
        environment.install(at, console, arguments, &[])?;
        fs::write(&stamp, identity)
            .with_context(|| format!("{} cannot be written", stamp.display()))?;
        Ok(environment)
    }

    /// Returns a new environment in `folder` without packages.
    ///
    /// # Errors
    /// Fails if it cannot be created.
    pub fn empty_environment(
        &self,
        at: &Workspace,
        console: &mut Console,
        folder: &Path,
    ) -> anyhow::Result<Environment> {
        let environment = Environment {
            folder: folder.to_owned(),
        };
        self.create(at, console, &environment)?;
        Ok(environment)
    }

    fn create(
        &self,
        at: &Workspace,
        console: &mut Console,
        environment: &Environment,
    ) -> anyhow::Result<()> {
        let folder = environment.folder.to_string_lossy();
        let words = ["-m", "venv", "--clear", &folder];
        run(at, console, self.program, &words, &[])
    }
}

impl Environment {
    /// Returns the path of one of the environment's programs.
    pub fn program(&self, name: &str) -> String {
        self.programs().join(name).to_string_lossy().into_owned()
    }

    /// Returns the folder of the environment's programs.
    pub fn programs(&self) -> PathBuf {
        let name = if cfg!(windows) { "Scripts" } else { "bin" };
        self.folder.join(name)
    }

    /// Runs `pip install` with `arguments` and environment variables.
    ///
    /// # Errors
    /// Fails if pip fails.
    pub fn install(
        &self,
        at: &Workspace,
        console: &mut Console,
        arguments: &[&str],
        variables: &[(&str, &str)],
    ) -> anyhow::Result<()> {
        let install = ["-m", "pip", "--disable-pip-version-check", "install"];
        let words = [&install, arguments].concat();
        run(at, console, &self.program("python"), &words, variables)
    }
}

/// Runs `program`, which must succeed.
fn run(
    at: &Workspace,
    console: &mut Console,
    program: &str,
    arguments: &[&str],
    variables: &[(&str, &str)],
) -> anyhow::Result<()> {
    let variables = [&[("PYTHONPATH", "")], variables].concat();
    let done = execute_with(at, console, program, arguments, &variables)?;
    let end = done
        .lines
        .iter()
        .skip(done.lines.len().saturating_sub(TAIL));
    let end: Vec<_> = end.map(String::as_str).collect();
    anyhow::ensure!(
        done.success,
        "`{program} {}` failed:\n{}",
        arguments.join(" "),
        end.join("\n")
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn an_environment_is_made_again_if_its_packages_change() {
        let name = format!("flexor-environment-{}", std::process::id());
        let root = std::env::temp_dir().join(name);
        fs::create_dir_all(&root).unwrap();
        let at = Workspace {
            root: root.clone(),
            target: root.clone(),
        };
        // Stands in for Python: creates environments whose `python` is `true`.
        let folder = root.join("venv");
        let environment = Environment {
            folder: folder.clone(),
        };
        fs::create_dir_all(environment.programs()).unwrap();
        let is_there = |path: &&str| Path::new(path).exists();
        let success = ["/bin/true", "/usr/bin/true"].into_iter().find(is_there);
        symlink(success.unwrap(), environment.program("python")).unwrap();
        let interpreter = Interpreter { program: "true" };
        let mut console = Console::new();
        let stamp = || fs::read_to_string(folder.join(STAMP)).unwrap();
        for identity in ["a", "b"] {
            let made = interpreter.environment(&at, &mut console, &folder, identity, &[]);
            assert_eq!(made.unwrap(), environment);
            assert_eq!(stamp(), identity);
        }
        let broken = Interpreter { program: "false" };
        let kept = broken.environment(&at, &mut console, &folder, "b", &[]);
        assert_eq!(kept.unwrap(), environment);
        let error = broken.environment(&at, &mut console, &folder, "c", &[]);
        let error = error.unwrap_err().to_string();
        assert!(error.starts_with("`false -m venv --clear"), "{error}");
        fs::remove_dir_all(&root).unwrap();
    }
}
