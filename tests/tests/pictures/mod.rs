//! Legibility of every committed picture: no text overlaps another or leaves the canvas, every axis
//! has its own name, and text, lines and marks contrast with their background, on light and on dark
//! screens.
//!
//! `tests/pictures_known.txt` lists the defects that existed when this test was written. A new
//! defect fails; a removed one must leave the list.

mod axes;
mod contrast;
mod drawing;
mod font;
mod overlap;
mod pages;
mod style;

use drawing::Drawing;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// White, and GitHub's background behind a transparent picture in dark mode.
const SCREENS: [[f64; 3]; 2] = [[255.0; 3], [13.0, 17.0, 23.0]];
const KNOWN: &str = "pictures_known.txt";

/// Returns all defects of a picture, each once with its count.
fn findings(svg: &str, screens: [[f64; 3]; 2]) -> Vec<String> {
    let drawing = match Drawing::read(svg) {
        Ok(drawing) => drawing,
        Err(error) => return vec![format!("cannot be read: {error}")],
    };
    let mut counted: BTreeMap<String, u32> = BTreeMap::new();
    let defects = [
        overlap::find(&drawing),
        axes::find(&drawing),
        contrast::find(&drawing, screens),
    ];
    for defect in defects.into_iter().flatten() {
        *counted.entry(defect).or_default() += 1;
    }
    let texts = counted.into_iter().map(|(defect, times)| match times {
        1 => defect,
        _ => format!("{defect} ({times} times)"),
    });
    texts.collect()
}

fn top() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Collects every picture below a folder.
fn pictures(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            pictures(&path, files);
        } else if path.extension().is_some_and(|e| e == "svg") {
            files.push(path);
        }
    }
}

#[test]
fn every_committed_picture_can_be_read_but_for_what_is_listed() {
    let mut files = Vec::new();
    pictures(&top().join("docs"), &mut files);
    files.sort();
    assert!(
        files.len() >= 15,
        "only {} pictures below docs",
        files.len()
    );
    let mut found = BTreeSet::new();
    for file in &files {
        let svg = std::fs::read_to_string(file).expect("a picture");
        let name = file
            .strip_prefix(top())
            .expect("below the top")
            .display()
            .to_string();
        found.extend(
            findings(&svg, SCREENS)
                .into_iter()
                .map(|finding| format!("{name} | {finding}")),
        );
    }
    let list = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(KNOWN));
    let list = list.expect("the list is there");
    let lines = list
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    let known: BTreeSet<String> = lines
        .map(|line| {
            let (finding, reason) = line.rsplit_once(" | ").expect("picture | finding | reason");
            assert!(!reason.trim().is_empty(), "no reason: {line}");
            finding.to_owned()
        })
        .collect();
    let only = |a: &BTreeSet<String>, b: &BTreeSet<String>| {
        a.difference(b).cloned().collect::<Vec<_>>().join("\n")
    };
    let (new, gone) = (only(&found, &known), only(&known, &found));
    println!(
        "{} pictures, {} findings, all listed",
        files.len(),
        found.len()
    );
    assert!(new.is_empty(), "new in the pictures:\n{new}");
    assert!(
        gone.is_empty(),
        "no longer there, take them from tests/{KNOWN}:\n{gone}"
    );
}

const BACK: &str = "<rect x=\"-50\" y=\"-50\" width=\"300\" height=\"200\" fill=\"#FFFFFF\"/>";

/// Returns the defects of `body` on white.
fn on_white(body: &str) -> Vec<String> {
    small(&format!("{BACK}{body}"))
}

/// Returns the defects of `body` without a background, 200 wide and 100 high.
fn small(body: &str) -> Vec<String> {
    let svg =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 200 100\">{body}</svg>");
    findings(&svg, SCREENS)
}

fn text(at: (i32, i32), anchor: &str, rest: &str, words: &str) -> String {
    let (x, y) = at;
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-size=\"10\" fill=\"#333333\" text-anchor=\"{anchor}\" \
         {rest}>{words}</text>"
    )
}

#[test]
fn text_on_text_and_beyond_the_canvas_is_found() {
    let over = text((10, 50), "start", "", "force") + &text((30, 53), "start", "", "angle");
    assert_eq!(on_white(&over), ["text over text: \"force\" and \"angle\""]);
    // The same two, one turned so that it does not overlap the other.
    let turned = text((10, 50), "start", "", "force")
        + &text(
            (60, 53),
            "start",
            "transform=\"rotate(270, 60, 53)\"",
            "angle",
        );
    assert_eq!(on_white(&turned), [""; 0]);
    let out = text((190, 50), "start", "", "force") + &text((100, 5), "end", "", "angle");
    assert_eq!(
        on_white(&out),
        [
            "text leaves the canvas: \"angle\"",
            "text leaves the canvas: \"force\""
        ]
    );
}

#[test]
fn an_axis_needs_a_name_of_its_own() {
    let across = [(50, "0"), (80, "5"), (110, "10")].map(|(x, n)| text((x, 70), "middle", "", n));
    let up = [(60, "0"), (40, "50"), (20, "100")].map(|(y, n)| text((40, y), "end", "", n));
    let ticks = across.concat() + &up.concat();
    let (no_x, no_y) = (
        "axis across without a name: 0, 5 … 10",
        "axis up without a name: 100, 50 … 0",
    );
    assert_eq!(on_white(&ticks), [no_x, no_y]);
    let time = text((80, 85), "middle", "", "time (s)");
    assert_eq!(on_white(&(ticks.clone() + &time)), [no_y]);
    let double_name = text((80, 85), "middle", "", "time (s); up: angle (°)");
    assert_eq!(on_white(&(ticks.clone() + &double_name)), [no_x, no_y]);
    let angle = text(
        (10, 40),
        "middle",
        "transform=\"rotate(270, 10, 40)\"",
        "angle (°)",
    );
    assert_eq!(on_white(&(ticks + &time + &angle)), [""; 0]);
}

#[test]
fn faint_text_and_faint_lines_are_found_on_light_and_on_dark() {
    // No grey contrasts enough with both white and GitHub's dark background.
    let grey = "<text x=\"50\" y=\"50\" font-size=\"10\" fill=\"#808080\">force</text>";
    let text_finding = ["contrast 3.9 of text \"force\" in light, 1 times"];
    assert_eq!(small(grey), text_finding);
    assert_eq!(on_white(grey).len(), 2);
    let rules = "text{fill:#333333}@media (prefers-color-scheme:dark){text{fill:#DDDDDD}}";
    assert_eq!(small(&format!("<style>{rules}</style>{grey}")), [""; 0]);
    let line = "<line x1=\"10\" y1=\"10\" x2=\"90\" y2=\"10\" stroke=\"#E69F00\"/>";
    let line_finding = ["contrast 2.3 of lines #E69F00 in light, 1 times"];
    assert_eq!(small(line), line_finding);
    assert_eq!(on_white(line).len(), 2);
}
