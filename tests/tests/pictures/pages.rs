//! Pages of the shipped sessions, and the README's picture.

use super::drawing::Drawing;
use super::{SCREENS, findings, top};
use host_core::record::Run;
use host_core::report::{Report, page};
use host_core::run::{DeviceName, edges_of_one_period};
use host_tool::cli::overview_svg;
use tests::desk::{load_session, play};

const RENEW: &str = "cargo demo && cp out/demo/picture.svg docs/demo.svg";
/// Background of a page in light and dark.
const PAPER: [[f64; 3]; 2] = [[255.0; 3], [15.0, 19.0, 24.0]];
/// Smallest legible height of letters, CSS pixels.
const LOWEST: f64 = 9.0;

/// Returns the page of one session on the native simulator.
fn page_of(file: &str) -> String {
    let session = load_session(file);
    let played = play(&session, &DeviceName::Native);
    let mut trial = played.outcome.trial;
    trial.edges = edges_of_one_period(&session.session, &played.trace, played.epoch_us, 2_000_000);
    let run = Run {
        title: session.session.title.clone(),
        device: DeviceName::Native.to_string(),
        // With four trials, a single panel lies below three.
        trials: vec![trial.clone(), trial.clone(), trial.clone(), trial],
        ..Run::default()
    };
    page(&Report {
        run: &run,
        paper: &[],
        assumptions: &[],
        command: "flexor run",
    })
}

/// Returns every figure of a page, with the page's style.
fn figures(html: &str) -> Vec<String> {
    let between = |text: &str, open: &str, close: &str| {
        let from = text.find(open)? + open.len();
        let to = from + text[from..].find(close)?;
        Some((text[from..to].to_owned(), to))
    };
    let (style, mut at) = between(html, "<style>", "</style>").expect("a style");
    let mut drawings = Vec::new();
    while let Some((body, to)) = between(&html[at..], "<svg ", "</svg>") {
        let (head, rest) = body.split_once('>').expect("an open tag");
        drawings.push(format!("<svg {head}><style>{style}</style>{rest}</svg>"));
        at += to;
    }
    drawings
}

fn smallest(svg: &str) -> (f64, f64) {
    let drawing = Drawing::read(svg).expect("an SVG");
    let sizes = drawing.words().map(|words| words.size);
    (sizes.fold(f64::MAX, f64::min), drawing.width)
}

#[test]
fn the_figures_of_every_page_can_be_read() {
    let mut wrong = Vec::new();
    for (file, least) in [
        ("ten_channels_and_finger.toml", 4),
        ("ten_forces.toml", 3),
        ("harris_wall/1_pre_wall.toml", 2),
    ] {
        let html = page_of(file);
        for rule in [
            "@media screen and (prefers-color-scheme:dark)",
            "@media screen and (max-width:700px)",
            "@media print",
            "@page{size:A4",
            "min-width:820px",
        ] {
            assert!(html.contains(rule), "no {rule} in the page of {file}");
        }
        let figures = figures(&html);
        assert!(
            figures.len() >= least,
            "{} figures of {file}",
            figures.len()
        );
        for (n, svg) in figures.iter().enumerate() {
            let name = format!("{file}, figure {}", n + 1);
            let found = findings(svg, PAPER).into_iter();
            wrong.extend(found.map(|finding| format!("{name}: {finding}")));
            // On a narrow screen a figure keeps 820 pixels and is scrolled sideways.
            let (size, width) = smallest(svg);
            let size = size * 820.0 / width;
            assert!(size >= LOWEST, "{name}: letters of {size:.1} px");
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_readme_shows_what_the_simulator_gives() {
    let committed = std::fs::read_to_string(top().join("docs/demo.svg")).unwrap_or_default();
    let drawn = overview_svg(1).expect("a picture");
    let wrong = findings(&drawn, SCREENS);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let drawing = Drawing::read(&drawn).expect("an SVG");
    let words: Vec<&str> = drawing.words().map(|w| w.text.as_str()).collect();
    for part in [
        "Simulated",
        "reference",
        "default controller, RMSE",
        "paper's controller, RMSE",
    ] {
        let is_there = words.iter().any(|text| text.contains(part));
        assert!(is_there, "no {part} in {words:?}");
    }
    // The number labels an electrode and a lane.
    for number in (1..=10).map(|number| number.to_string()) {
        let times = words.iter().filter(|text| **text == number).count();
        assert!(times >= 2, "{number} stands {times} times");
    }
    // GitHub leaves 16 pixels at either side of a screen of 360.
    let (size, width) = smallest(&drawn);
    let size = size * 328.0 / width;
    assert!(size >= LOWEST, "letters of {size} px");
    let is_current = committed == drawn;
    assert!(
        is_current,
        "docs/demo.svg is stale: renew it with\n  {RENEW}"
    );
}
