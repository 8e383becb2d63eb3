//! Mean and most cycles of each algorithm, on a logarithmic scale.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, WIDTH, anchored, bold, legend, line, px,
    standalone, svg, text,
};
use crate::bench::{Deadline, Row};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LEGEND: i32 = 40;
const LABELS: i32 = 230;
const RIGHT: i32 = 150;
const BAR: i32 = 11;
const PITCH: i32 = 32;
const AXIS: i32 = 48;
/// The scale's ends, powers of ten.
const DECADES: (i32, i32) = (1, 6);

/// Two bars per algorithm, as a file of its own.
pub fn picture(rows: &[&Row]) -> String {
    let bottom = LEGEND + rows.len() as i32 * PITCH;
    let what = "Mean and most core clock cycles of each algorithm on the chip simulator";
    standalone(&svg(bottom + AXIS, what, |root| {
        draw_axis(root, bottom)?;
        let keys = [
            (Key::Box(PALETTE[0].filled()), "mean"),
            (Key::Box(PALETTE[4].filled()), "most"),
        ];
        legend(root, LABELS, 14, &keys)?;
        for (deadline, name) in [(Deadline::Window, "window"), (Deadline::Tick, "tick")] {
            draw_deadline(root, deadline, name, bottom)?;
        }
        for (row, top) in rows.iter().zip((LEGEND..).step_by(PITCH as usize)) {
            draw_row(root, row, top + 4)?;
        }
        Ok(())
    }))
}

/// Place of so many cycles, drawing units.
fn x(cycles: u64) -> i32 {
    let (low, high) = DECADES;
    let part = (cycles.max(1) as f64).log10() - f64::from(low);
    let part = (part / f64::from(high - low)).clamp(0.0, 1.0);
    px(LABELS) + (f64::from(px(WIDTH - LABELS - RIGHT)) * part) as i32
}

fn draw_axis(root: &Area<'_>, bottom: i32) -> Drawn {
    let style = anchored(text(11, MUTED), HPos::Center);
    for decade in DECADES.0..=DECADES.1 {
        let cycles = 10u64.pow(decade.unsigned_abs());
        let grid = [(x(cycles), px(LEGEND)), (x(cycles), px(bottom))];
        root.draw(&PathElement::new(grid, line(GRID, 8)))?;
        let at = (x(cycles), px(bottom + 12));
        root.draw(&Text::new(grouped(cycles), at, style.clone()))?;
    }
    let at = (px((LABELS + WIDTH - RIGHT) / 2), px(bottom + 34));
    let words = "cycles of one call, five wait states, caches on, prefetched lines cached";
    root.draw(&Text::new(words, at, anchored(text(12, INK), HPos::Center)))?;
    Ok(())
}

fn draw_deadline(root: &Area<'_>, deadline: Deadline, name: &str, bottom: i32) -> Drawn {
    let place = x(deadline.cycles());
    let path = [(place, px(LEGEND - 6)), (place, px(bottom))];
    root.draw(&PathElement::new(path, line(MUTED, 14)))?;
    let style = anchored(text(11, MUTED), HPos::Center);
    root.draw(&Text::new(name.to_owned(), (place, px(LEGEND - 14)), style))?;
    Ok(())
}

fn draw_row(root: &Area<'_>, row: &Row, top: i32) -> Drawn {
    let label = row.name.replace('_', " ");
    let middle = px(top + BAR);
    let right = anchored(text(12, INK), HPos::Right);
    root.draw(&Text::new(label, (px(LABELS - 10), middle), right))?;
    let bars = [
        (row.mean, PALETTE[0], top),
        (row.max, PALETTE[4], top + BAR),
    ];
    for (cycles, color, top) in bars {
        let corners = [(px(LABELS), px(top)), (x(cycles), px(top + BAR - 1))];
        root.draw(&Rectangle::new(corners, color.filled()))?;
    }
    let words = format!("{} / {}", grouped(row.mean), grouped(row.max));
    let at = (px(WIDTH - RIGHT + 12), middle);
    root.draw(&Text::new(words, at, bold(text(12, INK))))?;
    Ok(())
}

/// Digits in groups of three, apart by thin spaces.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (n, digit) in digits.chars().enumerate() {
        if n > 0 && (digits.len() - n).is_multiple_of(3) {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped_and_places_grow_with_cycles() {
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(168_000), "168\u{2009}000");
        assert!(x(10) == px(LABELS) && x(11) > x(10));
        assert_eq!(x(1_000_000), px(WIDTH - RIGHT));
    }
}
