//! Contrast of text, lines and marks with their background (WCAG 2.2).

use super::drawing::{Box2, Drawing, Form, Item, Paint};
use std::collections::BTreeMap;

/// Smallest contrast of text: WCAG 1.4.3, level AA.
const TEXT: f64 = 4.5;
/// Smallest contrast of lines and marks that carry data: WCAG 1.4.11.
const LINE: f64 = 3.0;
/// Colours of grid lines and frames on a light screen; they only guide the eye, and may be faint.
const FAINT: [[f64; 3]; 4] = [
    [216.0, 222.0, 228.0],
    [238.0, 240.0, 243.0],
    [154.0, 169.0, 184.0],
    [132.0, 150.0, 168.0],
];
/// Colour under a line or mark that sets it off.
const HALO: [f64; 3] = [253.0; 3];
const SCREENS: [&str; 2] = ["light", "dark"];

/// Returns items with too little contrast, each with its lowest contrast and count. `screen` is the
/// background behind a transparent picture, in light and dark.
pub fn find(drawing: &Drawing, screen: [[f64; 3]; 2]) -> Vec<String> {
    let mut worst: BTreeMap<(String, &str), (f64, u32)> = BTreeMap::new();
    for (dark, back) in screen.into_iter().enumerate() {
        for (n, item) in drawing.items.iter().enumerate() {
            let Some((ratio, wanted)) = contrast(&drawing.items[..n], item, dark, back) else {
                continue;
            };
            if ratio < wanted {
                let entry = worst.entry((name(item), SCREENS[dark]));
                let (lowest, times) = entry.or_insert((ratio, 0));
                *lowest = lowest.min(ratio);
                *times += 1;
            }
        }
    }
    let defects = worst
        .into_iter()
        .map(|((subject, screen), (ratio, times))| {
            format!("contrast {ratio:.1} of {subject} in {screen}, {times} times")
        });
    defects.collect()
}

/// Returns the contrast of an item with what was painted before, and the required contrast; `None`
/// if none is required.
fn contrast(before: &[Item], item: &Item, dark: usize, back: [f64; 3]) -> Option<(f64, f64)> {
    let paint = item.paint[dark]?;
    let (points, wanted) = match &item.form {
        Form::Words(words) => (sample_points(&words.bounds), TEXT),
        Form::Line(path, _) if stands_out(item) => (middle(path), LINE),
        Form::Area(corners) if is_mark(corners) && stands_out(item) => {
            (vec![Box2::around(corners).middle()], LINE)
        }
        _ => return None,
    };
    let ratios = points.into_iter().map(|at| {
        let below = background_color(before, at, dark, back, paint);
        ratio(mixed(below, paint.rgb, paint.cover), below)
    });
    Some((ratios.fold(f64::MAX, f64::min), wanted))
}

fn name(item: &Item) -> String {
    let light = item.paint[0].map_or([0.0; 3], |paint| paint.rgb);
    let [r, g, b] = light.map(|part| part as u8);
    match &item.form {
        Form::Words(words) => format!("text {:?}", words.text),
        Form::Line(..) => format!("lines #{r:02X}{g:02X}{b:02X}"),
        Form::Area(_) => format!("marks #{r:02X}{g:02X}{b:02X}"),
    }
}

fn stands_out(item: &Item) -> bool {
    !is_halo(item) && !item.paint[0].is_some_and(|paint| FAINT.contains(&paint.rgb))
}

fn is_halo(item: &Item) -> bool {
    item.paint[0].is_some_and(|paint| paint.rgb == HALO)
}

/// Returns whether the shape is a mark: small and not a box, as a dot, a triangle or a star.
fn is_mark(corners: &[(f64, f64)]) -> bool {
    let bounds = Box2::around(corners);
    let small = bounds.right - bounds.left < 22.0 && bounds.bottom - bounds.top < 22.0;
    small && corners.len() != 4
}

/// Returns five positions along a text.
fn sample_points(bounds: &Box2) -> Vec<(f64, f64)> {
    let part = |n: u32| f64::from(n) / 4.0;
    let x = |n| bounds.left + (bounds.right - bounds.left) * part(n);
    let y = |n| bounds.top + (bounds.bottom - bounds.top) * part(n);
    let upright = bounds.bottom - bounds.top > bounds.right - bounds.left;
    let (mx, my) = bounds.middle();
    (0..5)
        .map(|n| if upright { (mx, y(n)) } else { (x(n), my) })
        .collect()
}

/// Returns the middle of a path's longest segment.
fn middle(path: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let length = |pair: &&[(f64, f64)]| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1);
    let longest = path
        .windows(2)
        .max_by(|a, b| length(a).total_cmp(&length(b)));
    longest
        .map(|pair| ((pair[0].0 + pair[1].0) / 2.0, (pair[0].1 + pair[1].1) / 2.0))
        .into_iter()
        .collect()
}

/// Returns the colour at a position after some items are painted: areas and halos. Crossing lines
/// and marks are distinguished along their length, not where they meet; a line at the edge of an
/// area of its own colour is seen from the other side.
fn background_color(
    items: &[Item],
    at: (f64, f64),
    dark: usize,
    screen: [f64; 3],
    judged: Paint,
) -> [f64; 3] {
    let mut color = screen;
    for item in items {
        let covers = match &item.form {
            Form::Words(_) => false,
            Form::Area(corners) => (is_halo(item) || !is_mark(corners)) && inside(corners, at),
            Form::Line(path, width) => is_halo(item) && near(path, at) <= width / 2.0,
        };
        if let (true, Some(paint)) = (covers, item.paint[dark])
            && (paint.rgb != judged.rgb || paint.cover == 1.0)
        {
            color = mixed(color, paint.rgb, paint.cover);
        }
    }
    color
}

fn inside(corners: &[(f64, f64)], (x, y): (f64, f64)) -> bool {
    let next = corners.iter().skip(1).chain(corners.first());
    let crosses = |(a, b): (&(f64, f64), &(f64, f64))| {
        (a.1 > y) != (b.1 > y) && x < a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0)
    };
    corners
        .iter()
        .zip(next)
        .filter(|pair| crosses(*pair))
        .count()
        % 2
        == 1
}

/// Returns the distance of a position from a path.
fn near(path: &[(f64, f64)], (x, y): (f64, f64)) -> f64 {
    let from = |pair: &[(f64, f64)]| {
        let ((ax, ay), (bx, by)) = (pair[0], pair[1]);
        let (dx, dy) = (bx - ax, by - ay);
        let part = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-9);
        let part = part.clamp(0.0, 1.0);
        (x - ax - part * dx).hypot(y - ay - part * dy)
    };
    path.windows(2).map(from).fold(f64::MAX, f64::min)
}

fn mixed(below: [f64; 3], above: [f64; 3], cover: f64) -> [f64; 3] {
    [0, 1, 2].map(|n| below[n] + (above[n] - below[n]) * cover)
}

/// Computes WCAG's contrast ratio, 1 to 21.
fn ratio(a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

fn luminance(rgb: [f64; 3]) -> f64 {
    let linear = rgb.map(|part| {
        let part = part / 255.0;
        if part <= 0.04045 {
            part / 12.92
        } else {
            ((part + 0.055) / 1.055).powf(2.4)
        }
    });
    0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
}
