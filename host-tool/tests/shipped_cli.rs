//! Tests of the program's built-in files, which any folder can use by name.

use super::program::test_folder;
use super::record_again::{run_failing, run_json};
use std::collections::BTreeSet;
use std::path::Path;

/// Returns the names of the files in a folder of the repository, relative to `under`, without
/// `.toml`.
fn files(dir: &Path, under: &Path) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for entry in std::fs::read_dir(dir).unwrap().flatten() {
        let path = entry.path();
        match path.extension() {
            _ if path.is_dir() => names.extend(files(&path, under)),
            Some(extension) if extension == "toml" => {
                let name = path.strip_prefix(under).unwrap().with_extension("");
                names.insert(name.to_str().unwrap().to_owned());
            }
            _ => {}
        }
    }
    names
}

fn listed(listing: &serde_json::Value, key: &str) -> BTreeSet<String> {
    let names = listing[key].as_array().unwrap().iter();
    names
        .map(|value| value["name"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn every_shipped_file_is_listed_and_found_by_its_name() {
    let dir = test_folder("listed");
    let listing = run_json(&dir, "list");
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    for key in ["sessions", "wearers", "searches"] {
        let under = package.join(key);
        assert_eq!(listed(&listing, key), files(&under, &under), "{key}");
    }
    let declared = files(&package.join("experiments"), &package.join("experiments"));
    std::fs::create_dir(dir.join("faults")).unwrap();
    for name in declared.union(&listed(&listing, "studies")) {
        let file = format!("{name}-copied.toml");
        run_json(&dir, &format!("new {file} --from studies/{name}"));
    }
    let document =
        std::fs::read_to_string(package.join("../docs/reference/laboratory.md")).unwrap();
    for name in listed(&listing, "studies") {
        assert!(document.contains(&format!("`{name}`")), "{name}");
    }
    let names: Vec<String> = listed(&listing, "sessions").into_iter().collect();
    let checked = run_json(&dir, &format!("check {}", names.join(" ")));
    assert_eq!(checked["sessions"].as_array().unwrap().len(), names.len());
    // A file of that name in the folder has precedence.
    std::fs::write(dir.join("reciprocal"), "title = 1").unwrap();
    assert_eq!(run_failing(&dir, "check reciprocal").0, Some(1));
}

#[test]
fn shipped_files_are_copied_out_with_those_that_they_name() {
    let dir = test_folder("copied_out");
    run_json(&dir, "new own.toml --from hamana_exp4_two_point_wearer");
    run_json(&dir, "check own.toml P.toml");
    run_json(&dir, "new study.toml --from hamana-4");
    run_json(&dir, "experiment study.toml --draws 0 --out played");
    let (exit, error) = run_failing(&dir, "new own.toml --from reciprocal");
    assert_eq!(exit, Some(1));
    assert!(error.contains("E525"), "{error}");
    for (typed, expected) in [
        ("recip", "did you mean `reciprocal`?"),
        ("distributed", "sessions/distributed or studies/distributed"),
    ] {
        let (exit, error) = run_failing(&dir, &format!("new other.toml --from {typed}"));
        assert_eq!(exit, Some(2));
        assert!(error.contains(expected), "{error}");
    }
    let (exit, error) = run_failing(&dir, "new other.toml --from nothing-like-it");
    assert_eq!(exit, Some(2));
    assert!(error.contains("flexor list"), "{error}");
    let (exit, error) = run_failing(&dir, "new other.toml --from reciprocal --seconds 3");
    assert_eq!(
        (exit, error.contains("--seconds")),
        (Some(2), true),
        "{error}"
    );
}

/// Copies of each session with its wearers, and of each declaration with its sessions, pass the
/// check in a folder of their own, as the shipped files do.
#[test]
fn every_copy_stands_on_its_own() {
    let dir = test_folder("stands_alone");
    let listing = run_json(&dir, "list");
    for (index, name) in listed(&listing, "sessions").iter().enumerate() {
        std::fs::create_dir(dir.join(index.to_string())).unwrap();
        run_json(
            &dir,
            &format!("new {index}/own.toml --from sessions/{name}"),
        );
        run_json(&dir, &format!("check {index}/own.toml"));
    }
    for name in [
        "harris-wall",
        "harris-wall-decides",
        "harris-wall-gentle",
        "hamana-4",
    ] {
        std::fs::create_dir(dir.join(name)).unwrap();
        run_json(
            &dir,
            &format!("new {name}/study.toml --from studies/{name}"),
        );
        run_json(
            &dir,
            &format!("experiment {name}/study.toml --draws 0 --out {name}/played"),
        );
    }
}
