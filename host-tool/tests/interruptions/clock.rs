//! Test against jumps of the clock: no timing uses the wall clock.

use std::path::{Path, PathBuf};

/// Sources of the wall clock's time.
const WALL: [&str; 4] = ["SystemTime", "UNIX_EPOCH", "Local::now", "Utc::now"];

/// Files below `src` where the wall clock is only a label, and the reason.
const LABELS: [(&str, &str); 3] = [
    (
        "cli/moment.rs",
        "a folder's name, and when a run began, in UTC",
    ),
    (
        "serve/trace.rs",
        "when a line was written, to compare with the times of another process",
    ),
    ("python/src/session.rs", "when a run began, in UTC"),
];

fn sources(dir: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn only_labels_know_the_wall_clock() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    sources(&root.join("src"), &mut found);
    sources(&root.join("python/src"), &mut found);
    sources(&root.join("../hal-sim/src"), &mut found);
    assert!(found.len() > 200, "{}", found.len());
    for path in found {
        let text = std::fs::read_to_string(&path).unwrap();
        let is_label = LABELS.iter().any(|(file, _)| path.ends_with(file));
        let seen = WALL.iter().find(|name| text.contains(*name));
        assert!(
            seen.is_none() || is_label,
            "{}: {seen:?}: time by `Instant`; what is only a label is named in LABELS",
            path.display()
        );
    }
}
