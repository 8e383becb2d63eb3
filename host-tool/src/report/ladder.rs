//! Error of each rung of the muscle ladder over four kinds of scene.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, WIDTH, anchored, bold, legend, line, px,
    standalone, svg, text, turned,
};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

/// One line of a panel: a colour of the palette, and the error in % at each
/// place of the axis, if measured.
#[derive(Clone, Debug)]
pub struct Course {
    /// Which rung, 0 to 3.
    pub rung: usize,
    /// Worst error, % of peak.
    pub worst_pct: Vec<Option<f64>>,
}

/// One kind of scene.
#[derive(Clone, Debug)]
pub struct Panel {
    /// What is done to the muscle.
    pub title: &'static str,
    /// What the axis is.
    pub axis: &'static str,
    /// Its places, evenly apart.
    pub places: Vec<String>,
    /// The rungs.
    pub courses: Vec<Course>,
}

const NAMES: [&str; 4] = [
    "static",
    "lag",
    "calcium–force",
    "calcium–force with fatigue",
];
/// The scale's ends, powers of ten of a percent.
const DECADES: (i32, i32) = (-3, 2);
/// Pixels.
const TOP: i32 = 44;
const LEFT: i32 = 70;
const GAP: i32 = 86;
const PANEL: (i32, i32) = (400, 200);
const PITCH: i32 = 290;

/// Four panels in two rows, as a file of its own.
#[must_use]
pub fn picture(panels: &[Panel; 4]) -> String {
    let what = "Worst error of each muscle model in four kinds of scene";
    standalone(&svg(TOP + 2 * PITCH, what, |root| {
        let mut keys: Vec<_> = NAMES
            .iter()
            .enumerate()
            .map(|(i, name)| (Key::Dot(PALETTE[i].filled()), *name))
            .collect();
        keys.push((Key::Line(line(INK, 14)), "just noticeable: 10 %"));
        legend(root, LEFT, 16, &keys)?;
        for (i, panel) in (0..).zip(panels) {
            let left = LEFT + (i % 2) * (PANEL.0 + GAP);
            draw_panel(root, panel, left, TOP + 34 + (i / 2) * PITCH)?;
        }
        Ok(())
    }))
}

/// Height of an error above the panel's foot, drawing units; what is below the
/// scale lies on its foot.
fn height(pct: f64) -> i32 {
    let (low, high) = DECADES;
    let part = (pct.max(1e-9).log10() - f64::from(low)) / f64::from(high - low);
    (f64::from(px(PANEL.1)) * part.clamp(0.0, 1.02)) as i32
}

fn draw_panel(root: &Area<'_>, panel: &Panel, left: i32, top: i32) -> Drawn {
    let foot = px(top + PANEL.1);
    let right = px((left + PANEL.0).min(WIDTH - 10));
    let title = bold(text(13, INK));
    root.draw(&Text::new(panel.title, (px(left), px(top - 16)), title))?;
    for decade in DECADES.0..=DECADES.1 {
        let pct = 10f64.powi(decade);
        let y = foot - height(pct);
        root.draw(&PathElement::new(
            [(px(left), y), (right, y)],
            line(GRID, 8),
        ))?;
        let label = format!("{pct} %");
        let style = anchored(text(11, MUTED), HPos::Right);
        root.draw(&Text::new(label, (px(left - 8), y), style))?;
    }
    let y = foot - height(10.0);
    root.draw(&PathElement::new(
        [(px(left), y), (right, y)],
        line(INK, 14),
    ))?;
    let count = panel.places.len().max(2) as i32;
    let x = |i: usize| px(left + 24) + px(PANEL.0 - 48) / (count - 1) * i as i32;
    for (i, place) in panel.places.iter().enumerate() {
        let at = (x(i), foot + px(14));
        let style = anchored(text(11, MUTED), HPos::Center);
        root.draw(&Text::new(place.clone(), at, style))?;
    }
    let at = (px(left + PANEL.0 / 2), foot + px(34));
    let style = anchored(text(12, INK), HPos::Center);
    root.draw(&Text::new(panel.axis, at, style))?;
    let at = (px(left - 58), px(top + PANEL.1 / 2));
    let name = turned(text(12, INK));
    root.draw(&Text::new("worst error (% of peak)", at, name))?;
    for course in &panel.courses {
        let color = PALETTE[course.rung];
        let points: Vec<_> = course
            .worst_pct
            .iter()
            .enumerate()
            .filter_map(|(i, pct)| Some((x(i), foot - height((*pct)?))))
            .collect();
        root.draw(&PathElement::new(points.clone(), line(color, 20)))?;
        for point in points {
            root.draw(&Circle::new(point, px(4), color.filled()))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_rise_and_stay_within_the_panel() {
        assert_eq!(height(0.0), 0);
        assert_eq!(height(1e-3), 0);
        assert!(height(0.1) < height(10.0));
        assert_eq!(height(100.0), px(PANEL.1));
        assert!(height(1e6) <= px(PANEL.1 + 5));
    }
}
