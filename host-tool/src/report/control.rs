//! Control laws on random wearers: cycles, mean and 95th percentile of the error.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, SHADE, WIDTH, anchored, bold, legend, line, px,
    standalone, svg, text,
};
use crate::tracking::campaign::Campaign;
use crate::tracking::contender::Contender;
use crate::tracking::table::{TWO_POINT_MEAN, TWO_POINT_P95};
use crate::tracking::wearer::Points;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const TOP: i32 = 78;
const PITCH: i32 = 24;
const AXIS: i32 = 52;
/// Left and right edge of the three panels.
const CYCLES: (i32, i32) = (190, 400);
const ERRORS: [(i32, i32); 2] = [(440, 695), (730, 985)];
/// Cycles at the ends of their scale, logarithmic.
const CYCLES_SCALE: (f64, f64) = (100.0, 10_000.0);
/// Errors run from 0 to this, degrees; what goes beyond ends at the edge in an
/// arrow.
const ERROR_TOP: f64 = 10.0;

/// Rows by cycles; a file of its own.
pub fn picture(campaign: &Campaign) -> String {
    let mut order: Vec<usize> = (0..campaign.contenders.len()).collect();
    order.sort_by_key(|n| campaign.cycles[*n].unwrap_or(u64::MAX));
    let bottom = TOP + order.len() as i32 * PITCH;
    let what = format!(
        "Tracking error and cycles of {} control laws on {} random simulated wearers",
        order.len(),
        campaign.plan.plants
    );
    standalone(&svg(bottom + AXIS, &what, |root| {
        let keys = [
            (Key::Dot(PALETTE[0].filled()), "mean, law alone"),
            (Key::Dot(PALETTE[2].filled()), "mean, with add-ons (+)"),
            (Key::Dot(PALETTE[1].filled()), "mean, device default"),
            (Key::Line(line(MUTED, 20)), "to the 95th percentile"),
        ];
        legend(root, 30, 16, &keys)?;
        for (row, n) in (0i32..).zip(&order) {
            if matches!(campaign.contenders[*n], Contender::Shipped) {
                let corners = [
                    (px(10), px(TOP + row * PITCH)),
                    (px(WIDTH - 5), px(TOP + (row + 1) * PITCH)),
                ];
                root.draw(&Rectangle::new(corners, SHADE.filled()))?;
            }
        }
        draw_cycles_axis(root, bottom)?;
        for (points, edges) in Points::ALL.into_iter().zip(ERRORS) {
            draw_errors_axis(root, campaign, points, edges, bottom)?;
        }
        for (row, n) in (0i32..).zip(&order) {
            draw_row(root, campaign, *n, TOP + row * PITCH + PITCH / 2)?;
        }
        Ok(())
    }))
}

/// Place of `part` (0…1) between two edges, drawing units.
fn between((left, right): (i32, i32), part: f64) -> i32 {
    px(left) + (f64::from(px(right - left)) * part.clamp(0.0, 1.0)) as i32
}

fn cycles_at(cycles: f64) -> i32 {
    let (low, high) = CYCLES_SCALE;
    between(CYCLES, (cycles / low).ln() / (high / low).ln())
}

fn heading(root: &Area<'_>, (left, right): (i32, i32), words: &str) -> Drawn {
    let style = bold(anchored(text(13, INK), HPos::Center));
    root.draw(&Text::new(
        words.to_owned(),
        (px((left + right) / 2), px(44)),
        style,
    ))?;
    Ok(())
}

fn tick(root: &Area<'_>, x: i32, bottom: i32, words: String) -> Drawn {
    root.draw(&PathElement::new(
        [(x, px(TOP)), (x, px(bottom))],
        line(GRID, 8),
    ))?;
    let style = anchored(text(11, MUTED), HPos::Center);
    root.draw(&Text::new(words, (x, px(bottom + 12)), style))?;
    Ok(())
}

fn caption(root: &Area<'_>, (left, right): (i32, i32), bottom: i32, words: &str) -> Drawn {
    let at = (px((left + right) / 2), px(bottom + 34));
    let style = anchored(text(12, INK), HPos::Center);
    root.draw(&Text::new(words.to_owned(), at, style))?;
    Ok(())
}

fn draw_cycles_axis(root: &Area<'_>, bottom: i32) -> Drawn {
    heading(root, CYCLES, "cost")?;
    for cycles in [100, 300, 1000, 3000, 10_000] {
        tick(
            root,
            cycles_at(f64::from(cycles)),
            bottom,
            cycles.to_string(),
        )?;
    }
    caption(root, CYCLES, bottom, "cycles of the law in its tick")
}

fn draw_errors_axis(
    root: &Area<'_>,
    campaign: &Campaign,
    points: Points,
    edges: (i32, i32),
    bottom: i32,
) -> Drawn {
    heading(root, edges, points.name())?;
    for degrees in [0, 2, 4, 6, 8, 10] {
        let x = between(edges, f64::from(degrees) / ERROR_TOP);
        tick(root, x, bottom, format!("{degrees}°"))?;
    }
    let (optimum, _) = campaign.optimum(points);
    mark(root, edges, bottom, optimum, "optimum")?;
    if points == Points::Two {
        mark(root, edges, bottom, TWO_POINT_MEAN, "goal")?;
        mark(root, edges, bottom, TWO_POINT_P95, "p95")?;
    }
    caption(root, edges, bottom, "RMSE to the reachable target, degrees")
}

fn mark(root: &Area<'_>, edges: (i32, i32), bottom: i32, degrees: f64, words: &str) -> Drawn {
    let x = between(edges, degrees / ERROR_TOP);
    root.draw(&PathElement::new(
        [(x, px(TOP - 6)), (x, px(bottom))],
        line(MUTED, 14),
    ))?;
    let style = anchored(text(11, MUTED), HPos::Center);
    root.draw(&Text::new(words.to_owned(), (x, px(TOP - 14)), style))?;
    Ok(())
}

fn draw_row(root: &Area<'_>, campaign: &Campaign, n: usize, middle: i32) -> Drawn {
    let contender = &campaign.contenders[n];
    let name = contender.name();
    let (color, style) = match contender {
        Contender::Shipped => (PALETTE[1], bold(text(12, INK))),
        Contender::Searched(..) if name.ends_with('+') => (PALETTE[2], text(12, INK)),
        Contender::Searched(..) => (PALETTE[0], text(12, INK)),
    };
    let at = (px(CYCLES.0 - 12), px(middle));
    root.draw(&Text::new(name, at, anchored(style, HPos::Right)))?;
    let y = px(middle);
    if let Some(cycles) = campaign.cycles[n] {
        let x = cycles_at(cycles as f64);
        root.draw(&Circle::new((x, y), px(4), color.filled()))?;
        let words = Text::new(cycles.to_string(), (x + px(9), y), text(11, MUTED));
        root.draw(&words)?;
    }
    for (points, edges) in Points::ALL.into_iter().zip(ERRORS) {
        let score = campaign.score(points, n);
        let [mean, p95] = [score.mean, score.p95].map(|d| between(edges, d / ERROR_TOP));
        root.draw(&PathElement::new([(mean, y), (p95, y)], line(color, 20)))?;
        // A bar that goes on beyond the edge ends in an arrow.
        let back = if score.p95 > ERROR_TOP { px(5) } else { 0 };
        let end = [(p95 - back, y - px(4)), (p95, y), (p95 - back, y + px(4))];
        root.draw(&PathElement::new(end, line(color, 20)))?;
        root.draw(&Circle::new((mean, y), px(4), color.filled()))?;
    }
    Ok(())
}
