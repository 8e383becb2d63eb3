//! The device images: list, lints and builds for the chip.

use super::Workspace;
use super::command::cargo;
use super::console::Console;
use super::report::Report;
use anyhow::Context;
use serde::Deserialize;
use std::path::PathBuf;

/// Rust target of the chip.
pub(super) const TARGET: &str = "thumbv7em-none-eabihf";

/// Packages whose binaries are all images.
const PACKAGES: [&str; 2] = ["firmware", "host-tool/methods"];

/// Binary of one of [`PACKAGES`].
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct Image {
    /// Name of the binary.
    pub name: String,
    /// Cargo features of the build.
    #[serde(default)]
    required_features: Vec<String>,
    /// Folder of its package.
    #[serde(skip)]
    folder: &'static str,
}

#[derive(Deserialize)]
struct Manifest {
    #[serde(default)]
    bin: Vec<Image>,
}

impl Image {
    /// Returns every image listed in the packages' manifests.
    pub fn all(at: &Workspace) -> anyhow::Result<Vec<Self>> {
        let mut listed_images = Vec::new();
        for folder in PACKAGES {
            let path = at.root.join(folder).join("Cargo.toml");
            let text = std::fs::read_to_string(&path);
            let text = text.with_context(|| format!("{} cannot be read", path.display()))?;
            let images = parse(&text)?.into_iter();
            listed_images.extend(images.map(|image| Self { folder, ..image }));
        }
        Ok(listed_images)
    }

    /// Returns the path of the linked image.
    pub fn path(&self, at: &Workspace) -> PathBuf {
        at.target.join(TARGET).join("release").join(&self.name)
    }

    /// Returns the arguments of cargo's `command` for this image.
    pub fn arguments(&self, command: &str) -> Vec<String> {
        let features = self.required_features.join(",");
        let package = self.folder.rsplit('/').next().unwrap_or(self.folder);
        let mut arguments = vec![command, "--release", "--package", package];
        arguments.extend(["--target", TARGET, "--bin", &self.name]);
        if !features.is_empty() {
            arguments.extend(["--features", &features]);
        }
        arguments.into_iter().map(str::to_owned).collect()
    }

    fn cargo(
        &self,
        at: &Workspace,
        console: &mut Console,
        command: &str,
        rest: &[&str],
    ) -> anyhow::Result<Report> {
        let own = self.arguments(command);
        let own = own.iter().map(String::as_str);
        let arguments: Vec<&str> = own.chain(rest.iter().copied()).collect();
        cargo(at, console, &arguments)
    }
}

fn parse(manifest: &str) -> anyhow::Result<Vec<Image>> {
    Ok(toml::from_str::<Manifest>(manifest)?.bin)
}

/// Lints each image; warnings and `unsafe` blocks without a reason fail.
pub(super) fn lint(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let unsafe_blocks = "clippy::undocumented_unsafe_blocks";
    let rest = ["--", "-D", "warnings", "-D", unsafe_blocks];
    run_on_each(at, console, "clippy", &rest)
}

/// Builds and links each image.
pub(super) fn build(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    run_on_each(at, console, "build", &[])
}

fn run_on_each(
    at: &Workspace,
    console: &mut Console,
    command: &str,
    rest: &[&str],
) -> anyhow::Result<Report> {
    let mut report = Report::default();
    for image in Image::all(at)? {
        report.add(image.cargo(at, console, command, rest)?);
    }
    if report == Report::default() {
        report
            .lines
            .push("note: firmware/Cargo.toml lists no image".into());
    }
    Ok(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_what_the_manifest_lists() {
        let manifest = "[package]\nname = 'x'\n[[bin]]\nname = 'a'\nrequired-features = ['p', 'q']\n[[bin]]\nname = 'b'\n";
        let images = parse(manifest).unwrap();
        let words = |i: &Image| format!("{} {}", i.name, i.required_features.join(","));
        let found: Vec<_> = images.iter().map(words).collect();
        assert_eq!(found, ["a p,q", "b "]);
        assert_eq!(parse("[package]\nname = 'x'\n").unwrap(), []);
        assert!(parse("[[bin]]\n").is_err());
    }
}
