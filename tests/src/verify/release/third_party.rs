//! Licences of the crates that the program contains.

use crate::verify::Workspace;
use crate::verify::command::execute;
use crate::verify::console::Console;
use anyhow::ensure;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Arguments of cargo that list the crates: name, version, licence.
const LIST: [&str; 10] = [
    "tree",
    "--package=host-tool",
    "--package=firmware",
    "--edges=normal",
    "--target=all",
    "--all-features",
    "--prefix=none",
    "--no-dedupe",
    "--format={p}|{l}",
    "--locked",
];

/// Beginnings of the names of files with a licence.
const FILES: [&str; 4] = ["license", "licence", "copying", "notice"];

/// Returns a list of all crates with their licences, and each licence's text once.
///
/// # Errors
/// Fails if cargo cannot list the crates, or the sources of one are not there.
pub(super) fn licences(at: &Workspace, console: &mut Console) -> anyhow::Result<String> {
    let listed = execute(at, console, "cargo", &LIST)?;
    ensure!(listed.success, "{}", listed.lines.join("\n"));
    let crates: BTreeSet<(&str, &str, &str)> =
        listed.lines.iter().filter_map(|l| parse(l)).collect();
    ensure!(crates.len() > 100, "{} crates", crates.len());
    let folders = source_folders();
    let mut text = "Flexor contains these crates of other authors.\n\n".to_owned();
    let mut texts: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (name, version, licence) in crates {
        let _ = writeln!(text, "{name} {version}: {licence}");
        for folder in &folders {
            for found in texts_in(&folder.join(format!("{name}-{version}"))) {
                texts
                    .entry(found)
                    .or_default()
                    .push(format!("{name} {version}"));
            }
        }
    }
    for (licence, owners) in texts {
        let _ = write!(
            text,
            "\n{}\n{}\n\n{}\n",
            "-".repeat(80),
            owners.join(", "),
            licence.trim()
        );
    }
    Ok(text)
}

/// Reads a line of the list; `None` for crates of the workspace.
fn parse(line: &str) -> Option<(&str, &str, &str)> {
    let (package, licence) = line.split_once('|')?;
    let (name, rest) = package.split_once(" v")?;
    let is_own = rest.contains("(/");
    let version = rest.split_whitespace().next()?;
    (!is_own).then_some((name, version, licence))
}

/// Returns the folders into which cargo unpacks crates.
fn source_folders() -> Vec<PathBuf> {
    let home = std::env::var_os("HOME")
        .map(PathBuf::from)
        .unwrap_or_default();
    let cargo = std::env::var_os("CARGO_HOME").map_or(home.join(".cargo"), PathBuf::from);
    let entries = fs::read_dir(cargo.join("registry/src"))
        .into_iter()
        .flatten();
    entries.flatten().map(|entry| entry.path()).collect()
}

/// Returns the texts of the licences in a crate's folder.
fn texts_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let is_licence = |path: &PathBuf| {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .to_lowercase();
        FILES.iter().any(|begin| name.starts_with(begin))
    };
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(is_licence)
        .collect();
    paths.sort();
    paths
        .iter()
        .filter_map(|path| fs::read_to_string(path).ok())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_crates_are_not_listed() {
        let parsed = parse("anyhow v1.0.100|MIT OR Apache-2.0");
        assert_eq!(parsed, Some(("anyhow", "1.0.100", "MIT OR Apache-2.0")));
        assert_eq!(
            parse("cc v1.2.3 (proc-macro)|MIT"),
            Some(("cc", "1.2.3", "MIT"))
        );
        assert_eq!(
            parse("firmware v0.2.0 (/a/firmware)|MIT OR Apache-2.0"),
            None
        );
    }
}
