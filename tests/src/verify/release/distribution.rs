//! Files that are published: wheels and the source distribution.

use crate::verify::report::Report;
use anyhow::Context;
use std::fs;
use std::path::{Path, PathBuf};

/// Kind of a distribution.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// Wheel for Linux on x86-64.
    Linux,
    /// Wheel for Windows on x86-64.
    Windows,
    /// Sources of the package and of all crates of the workspace that it needs.
    Source,
}

/// Built distribution.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Distribution {
    kind: Kind,
    path: PathBuf,
    bytes: u64,
}

impl Kind {
    pub fn description(self) -> &'static str {
        match self {
            Self::Linux => "wheel for Linux",
            Self::Windows => "wheel for Windows",
            Self::Source => "source distribution",
        }
    }

    fn suffix(self) -> &'static str {
        match self {
            Self::Linux => "_x86_64.whl",
            Self::Windows => "win_amd64.whl",
            Self::Source => ".tar.gz",
        }
    }
}

impl Distribution {
    /// Returns the distribution of this kind in `folder`.
    ///
    /// # Errors
    /// Fails if there is none.
    pub fn find(folder: &Path, kind: Kind) -> anyhow::Result<Self> {
        let entries = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
        let mut paths = entries.flatten().map(|entry| entry.path());
        let path = paths.find(|path| path.to_string_lossy().ends_with(kind.suffix()));
        let path = path.with_context(|| format!("maturin made no {}", kind.description()))?;
        let bytes = fs::metadata(&path)?.len();
        Ok(Self { kind, path, bytes })
    }

    pub fn kind(&self) -> Kind {
        self.kind
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the name of the file.
    pub fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Reports the size, which fails for a wheel of more than `max_bytes`.
    pub fn size_report(&self, max_bytes: u64) -> Report {
        let mut report = Report::pass();
        let mut line = format!("{}: {} bytes", self.name(), self.bytes);
        if self.kind != Kind::Source && self.bytes > max_bytes {
            report = Report::fail(Vec::new());
            line = format!("{line}, more than {max_bytes}");
        }
        report.lines.push(line);
        report
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_found_by_its_name_and_only_wheels_have_a_largest_size() {
        let name = format!("flexor-distributions-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        fs::create_dir_all(&folder).unwrap();
        for (kind, file) in [
            (Kind::Linux, "x-1-cp311-abi3-manylinux_2_28_x86_64.whl"),
            (Kind::Windows, "x-1-cp311-abi3-win_amd64.whl"),
            (Kind::Source, "x-1.tar.gz"),
        ] {
            assert!(Distribution::find(&folder, kind).is_err());
            fs::write(folder.join(file), [0; 10]).unwrap();
            let found = Distribution::find(&folder, kind).unwrap();
            assert_eq!((found.name().as_str(), found.kind()), (file, kind));
            assert_eq!(found.size_report(10).failed, 0);
            let is_limited = u32::from(kind != Kind::Source);
            assert_eq!(found.size_report(9).failed, is_limited, "{file}");
        }
        fs::remove_dir_all(&folder).unwrap();
    }
}
