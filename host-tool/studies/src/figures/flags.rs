//! Figure of the compiler flags: cycles, load, margin and latency against flash.

use crate::flags::{FLASH_LIMIT, Row, choose};
use host_core::plot::ink::{INK, MUTED, PALETTE};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};

const KIB: f64 = 1024.0;

/// Draws one panel for each figure of merit, as an SVG file, and returns its text.
pub fn picture(rows: &[Row]) -> String {
    let levels = ["s", "2", "3"];
    let legend = (0..).zip(levels).map(|(n, level): (usize, _)| {
        let key = Key::Dot(Shape::SERIES[n], Paint::Full(PALETTE[n]));
        (key, format!("opt-level {level}"))
    });
    let legend = legend.chain([(
        Key::Dot(Shape::Disc, Paint::Ring(INK, 1.6)),
        "chosen".to_owned(),
    )]);
    type Value = fn(&Row) -> Option<f64>;
    let panels: [(&str, &str, Value); 4] = [
        (
            "Cycles of 36 algorithms",
            "mean, relative to before",
            |row| Some(row.mean_cycles()),
        ),
        ("Load at ten channels", "core awake (%)", |row| {
            Some(row.load.as_ref()?.load_percent)
        }),
        ("Refill margin", "cycles until DMA reads", |row| {
            Some(row.load.as_ref()?.margin as f64)
        }),
        ("Latency of USB", "cycles", |row| {
            Some(row.load.as_ref()?.usb_latency as f64)
        }),
    ];
    let panels = panels.map(|(title, name, value)| panel(rows, title, name, value));
    let [a, b, c, d] = panels;
    Figure {
        title: "Compiler flags of the stimulator's image".to_owned(),
        description: "Cycles, load, margin and latency against flash for each set of flags"
            .to_owned(),
        legend: legend.collect(),
        rows: vec![vec![a, b], vec![c, d]],
        notes: vec![
            "Simulated: counted by the chip simulator, the worse of both interpretations of the \
             flash prefetch; cycles: geometric mean over both. The number at a mark is the \
             threshold of inlining; LLVM's default is 225. An image that does not play has a mark \
             for its cycles only."
                .to_owned(),
        ],
        ..Figure::default()
    }
    .file()
}

fn panel(rows: &[Row], title: &str, name: &str, value: fn(&Row) -> Option<f64>) -> Panel {
    let mut marks = Vec::new();
    let at = |row: &Row| Some((row.flash as f64 / KIB, value(row)?));
    for row in rows {
        let Some(at) = at(row) else {
            continue;
        };
        let n = match row.flags.opt_level {
            "s" => 0,
            "2" => 1,
            _ => 2,
        };
        let paint = Paint::Full(PALETTE[n]);
        marks.push(Mark::Dot(at, Shape::SERIES[n], 4.5, paint));
        marks.push(Mark::Label(at, row.flags.inline.to_string(), MUTED));
    }
    if let Some(at) = choose(rows).and_then(|n| at(rows.get(n)?)) {
        marks.push(Mark::Dot(at, Shape::Disc, 8.0, Paint::Ring(INK, 1.6)));
    }
    let values: Vec<f64> = rows.iter().filter_map(value).collect();
    let flash: Vec<f64> = rows.iter().map(|row| row.flash as f64 / KIB).collect();
    let x = around("flash (KiB)", &flash);
    let limit = FLASH_LIMIT as f64 / KIB;
    let x = match flash.iter().any(|kib| *kib > limit) {
        true => x.reference_line(limit, "limit", MUTED),
        false => x,
    };
    Panel {
        marks,
        ..Panel::new(title, x, around(name, &values), 190.0)
    }
}

/// Returns a linear axis that shows all `values` with some margin.
fn around(name: &str, values: &[f64]) -> Axis {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let margin = 0.15 * (high - low).max(1e-9);
    Axis::linear(name, (low - margin, high + margin), 4.0)
}
