//! The package as Python imports it: a copy of its sources, and the extension.

use anyhow::Context;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::fs;
use std::path::Path;

/// Name of the extension's file in the package: Python finds a module of the stable interface by
/// this suffix.
const EXTENSION: &str = if cfg!(windows) {
    "flexor/_native.pyd"
} else {
    "flexor/_native.abi3.so"
};

/// Replaces the folder `site` with a copy of `packages` and the extension that cargo built in
/// `built`.
///
/// # Errors
/// Fails if a file cannot be copied.
pub(super) fn assemble(packages: &Path, built: &Path, site: &Path) -> anyhow::Result<()> {
    if site.exists() {
        fs::remove_dir_all(site).with_context(|| format!("{} is in use", site.display()))?;
    }
    copy_folder(packages, site)?;
    let library = built.join(format!("{DLL_PREFIX}_native{DLL_SUFFIX}"));
    copy(&library, &site.join(EXTENSION))
}

/// Copies a folder, without compiled files.
///
/// # Errors
/// Fails if a file cannot be copied.
pub(in crate::verify) fn copy_folder(from: &Path, to: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(to).with_context(|| format!("{} cannot be made", to.display()))?;
    let entries = fs::read_dir(from).with_context(|| format!("{}", from.display()))?;
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name();
        let target = to.join(&name);
        let is_compiled = |suffix: &str| name.to_string_lossy().ends_with(suffix);
        if entry.file_type()?.is_dir() {
            if name != "__pycache__" {
                copy_folder(&entry.path(), &target)?;
            }
        } else if ![".so", ".pyd"].into_iter().any(is_compiled) {
            copy(&entry.path(), &target)?;
        }
    }
    Ok(())
}

fn copy(from: &Path, to: &Path) -> anyhow::Result<()> {
    fs::copy(from, to).with_context(|| format!("{} cannot be copied", from.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_site_has_the_sources_and_the_built_extension_alone() {
        let name = format!("flexor-site-{}", std::process::id());
        let root = std::env::temp_dir().join(name);
        let write = |path: &str, text: &str| {
            let path = root.join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        write("packages/flexor/__init__.py", "");
        write("packages/flexor/inner/a.py", "");
        write("packages/flexor/__pycache__/a.pyc", "");
        write("packages/flexor/_native.abi3.so", "old");
        write("site/flexor/removed.py", "");
        write(&format!("built/{DLL_PREFIX}_native{DLL_SUFFIX}"), "new");
        let site = root.join("site");
        assemble(&root.join("packages"), &root.join("built"), &site).unwrap();
        let text = |path: &str| fs::read_to_string(site.join(path)).ok();
        assert_eq!(text(EXTENSION).as_deref(), Some("new"));
        assert!(text("flexor/__init__.py").is_some() && text("flexor/inner/a.py").is_some());
        assert!(text("flexor/removed.py").is_none());
        assert!(!site.join("flexor/__pycache__").exists());
        fs::remove_dir_all(&root).unwrap();
    }
}
