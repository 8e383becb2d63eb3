//! Checks docs/maps against the code, so that a change of a map shows in the diff.
//!
//! A map that is computed in seconds is computed whole. Of every other map, a cell of the first panel
//! and one of the last are computed again, and text and picture are drawn from the committed numbers.

use std::path::{Path, PathBuf};
use studies::figures::map_picture;
use studies::stability::{Declaration, MAPS, Map, Place, SEED, Source};

const RENEW: &str = "cargo run --release -p host-tool -- chart stability";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/maps")
}

/// Returns the names of the committed files with this extension.
fn committed(extension: &str) -> Vec<String> {
    let files = std::fs::read_dir(folder()).expect("docs/maps is there");
    let mut names: Vec<String> = files
        .map(|file| file.expect("a readable folder").path())
        .filter(|path| path.extension().is_some_and(|e| e == extension))
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    names.sort();
    names
}

fn read(name: &str, extension: &str) -> String {
    let file = folder().join(format!("{name}.{extension}"));
    std::fs::read_to_string(file).unwrap_or_default()
}

#[test]
fn every_map_has_its_files_and_no_file_is_left_over() {
    let mut known = MAPS.map(|(name, _)| name);
    known.sort_unstable();
    for extension in ["csv", "txt", "svg"] {
        assert_eq!(committed(extension), known);
    }
}

#[test]
fn the_committed_maps_are_those_of_the_code() {
    let stale = std::thread::scope(|scope| {
        // One thread for each map; two would do, because the maps are few and differ much in
        // length.
        let work = MAPS.map(|(name, source)| scope.spawn(move || stale(name, source)));
        work.map(|w| w.join().expect("a map"))
    });
    let stale: Vec<String> = stale.into_iter().flatten().collect();
    assert!(
        stale.is_empty(),
        "these are not what the code does; if that is meant, renew them with\n  {RENEW}\n{}",
        stale.join("\n")
    );
}

/// Describes how the committed files of a map differ from the code; `None` if they do not.
fn stale(name: &str, source: Source) -> Option<String> {
    let map = match source {
        Source::Whole(draw) => draw(SEED, &mut |_| {}),
        Source::Cells(declare) => {
            let declared = declare(SEED);
            let Some(map) = declared.read(&read(name, "csv")) else {
                return Some(format!("docs/maps/{name}.csv has other axes or panels\n"));
            };
            if let Some(difference) = other_cell(&declared, &map) {
                return Some(difference);
            }
            map
        }
    };
    let files = [
        ("csv", map.csv()),
        ("txt", map.text()),
        ("svg", map_picture(&map)),
    ];
    let (extension, is) = files.into_iter().find(|(e, is)| read(name, e) != *is)?;
    let lines = match extension {
        "svg" => String::new(),
        _ => difference(&read(name, extension), &is),
    };
    Some(format!("docs/maps/{name}.{extension}\n{lines}"))
}

/// Computes a cell of the first panel and one of the last, in different rows and columns, and returns
/// the first that differs from the committed map.
fn other_cell(declared: &Declaration, map: &Map) -> Option<String> {
    let (rows, columns) = (map.down.labels.len(), map.across.labels.len());
    [0, map.panels.len() - 1].into_iter().find_map(|panel| {
        let (row, column) = ((3 * panel + 2) % rows, (5 * panel + 3) % columns);
        let (was, is) = (
            map.panels[panel].rows[row][column],
            declared.cell(Place { panel, row, column }),
        );
        let title = &map.panels[panel].title;
        let [down, across] = [&map.down.labels[row], &map.across.labels[column]];
        (was != is).then(|| {
            format!(
                "docs/maps/{}.csv, {title}, {down}, {across}\n- {was:?}\n+ {is:?}\n",
                map.name
            )
        })
    })
}

/// Returns the lines that differ, position by position.
fn difference(was: &str, is: &str) -> String {
    let (was, is): (Vec<_>, Vec<_>) = (was.lines().collect(), is.lines().collect());
    let line = |lines: &[&str], n| lines.get(n).copied().unwrap_or("").to_owned();
    (0..was.len().max(is.len()))
        .filter(|n| was.get(*n) != is.get(*n))
        .map(|n| format!("- {}\n+ {}\n", line(&was, n), line(&is, n)))
        .collect()
}
