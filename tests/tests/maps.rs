//! Checks docs/maps/*.txt against the code, so that a change of a map shows in the diff.

use std::path::{Path, PathBuf};
use studies::figures::map_picture;
use studies::stability::{MAPS, Map, SEED};

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

#[test]
fn every_map_has_its_text_and_its_picture_and_no_file_is_left_over() {
    let mut known = MAPS.map(|(name, _)| name);
    known.sort_unstable();
    assert_eq!(committed("txt"), known);
    assert_eq!(committed("svg"), known);
}

#[test]
fn the_committed_maps_are_those_of_the_code() {
    let names = committed("txt");
    let drawn = std::thread::scope(|scope| {
        // One thread for each map; two would do, because the maps are few and differ much in
        // length.
        let work = names.iter().map(|name| scope.spawn(|| draw(name)));
        let work: Vec<_> = work.collect();
        let drawn = work.into_iter().map(|w| w.join().expect("a map"));
        drawn.collect::<Vec<_>>()
    });
    let mut stale = Vec::new();
    for map in drawn {
        let read = |extension| {
            let file = folder().join(format!("{}.{extension}", map.name));
            std::fs::read_to_string(file).unwrap_or_default()
        };
        let (was, is) = (read("txt"), map.text());
        if was != is {
            let lines = difference(&was, &is);
            stale.push(format!("docs/maps/{}.txt\n{lines}", map.name));
        } else if read("svg") != map_picture(&map) {
            stale.push(format!("docs/maps/{}.svg\n", map.name));
        }
    }
    assert!(
        stale.is_empty(),
        "these are not what the code does; if that is meant, renew them with\n  {RENEW}\n{}",
        stale.join("\n")
    );
}

fn draw(name: &str) -> Map {
    let entry = MAPS.iter().find(|(known, _)| *known == name);
    let (_, draw) = entry.unwrap_or_else(|| panic!("docs/maps/{name}.txt has no map"));
    draw(SEED, &mut |_| {})
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
