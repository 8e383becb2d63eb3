//! Check that no dependency of the studies is compiled at level 0. A crate at level 1 uses shared
//! generic functions as compiled by its dependencies, and a study would then take three times as
//! long.

use super::Workspace;
use super::command::execute;
use super::console::Console;
use super::report::Report;
use std::collections::BTreeSet;

/// Packages whose speed matters in the dev profile.
const FAST: [&str; 2] = ["studies", "host-core"];

/// Compares the levels in `Cargo.toml` with the dependencies of [`FAST`], with the features that
/// the whole workspace enables.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let manifest = std::fs::read_to_string(at.root.join("Cargo.toml"))?;
    let unoptimized = unoptimized(&toml::from_str(&manifest)?);
    let shape = ["--edges", "normal", "--prefix", "depth", "--no-dedupe"];
    let tree = [&["tree", "--workspace"], &shape[..]].concat();
    let listed = execute(at, console, "cargo", &tree)?;
    if !listed.success {
        return Ok(listed.report("cargo tree"));
    }
    let below = dependencies_of_fast(&listed.lines);
    let wrong: Vec<_> = unoptimized.intersection(&below).cloned().collect();
    Ok(match wrong.is_empty() {
        true => Report::pass(),
        false => Report::fail(vec![format!(
            "profile: Cargo.toml sets opt-level 0 for packages on which the studies depend: {}",
            wrong.join(", ")
        )]),
    })
}

/// Returns the packages that the dev profile compiles at level 0.
fn unoptimized(manifest: &toml::Table) -> BTreeSet<String> {
    let packages = ["profile", "dev", "package"]
        .iter()
        .try_fold(manifest, |table: &toml::Table, key| {
            table.get(*key)?.as_table()
        });
    let is_unoptimized = |profile: &toml::Value| {
        profile.get("opt-level").and_then(toml::Value::as_integer) == Some(0)
    };
    let packages = packages.into_iter().flatten();
    packages
        .filter(|(_, profile)| is_unoptimized(profile))
        .map(|(name, _)| name.clone())
        .collect()
}

/// Returns the dependencies of [`FAST`] in `cargo tree --prefix depth`, whose lines begin with a
/// depth.
fn dependencies_of_fast(lines: &[String]) -> BTreeSet<String> {
    let mut crates = BTreeSet::new();
    let mut fast_depth = None;
    for line in lines {
        let digits = line.bytes().take_while(u8::is_ascii_digit).count();
        let Ok(depth) = line[..digits].parse::<usize>() else {
            continue;
        };
        let name = line[digits..].split(' ').next().unwrap_or_default();
        if fast_depth.is_some_and(|fast| depth > fast) {
            crates.insert(name.to_owned());
        } else {
            fast_depth = FAST.contains(&name).then_some(depth);
        }
    }
    crates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crates_below_the_studies_are_those_of_greater_depth() {
        let lines = [
            "0host-tool v0.1.0",
            "1studies v0.1.0",
            "2regex v1.0.0",
            "3memchr v2.0.0",
            "1ratatui v0.30.0",
            "2mio v1.0.0",
        ];
        let below = dependencies_of_fast(&lines.map(str::to_owned));
        assert_eq!(below.into_iter().collect::<Vec<_>>(), ["memchr", "regex"]);
    }

    #[test]
    fn only_level_0_counts_as_unoptimized() {
        let manifest =
            "[profile.dev.package.a]\nopt-level = 0\n[profile.dev.package.b]\nopt-level = 3";
        let unoptimized = unoptimized(&toml::from_str(manifest).unwrap());
        assert_eq!(unoptimized.into_iter().collect::<Vec<_>>(), ["a"]);
    }
}
