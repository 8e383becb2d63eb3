//! RMSE of this run beside what a paper printed.

use super::canvas::{
    Area, Drawn, GRID, INK, Key, MUTED, PALETTE, WIDTH, anchored, bold, legend, line, px,
    shortened, svg, text,
};
use super::map::{EDGE, HALO};
use super::series::round_step;
use super::tables::degrees;
use crate::analysis::metrics;
use crate::record::{PaperRow, Trial};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const LEGEND: i32 = 32;
const LABELS: i32 = 300;
const RIGHT: i32 = 96;
const BAR: i32 = 24;
const SPACE: i32 = 16;
const AXIS: i32 = 44;

/// One bar.
struct Bar<'a> {
    label: &'a str,
    value: f64,
    dots: &'a [f64],
}

/// Bars of every trial that has paper rows, or nothing.
pub(super) fn figure(trials: &[Trial], paper: &[PaperRow]) -> String {
    let groups: Vec<(&str, Vec<Bar>)> = trials
        .iter()
        .filter_map(|trial| group(trial, paper).map(|bars| (trial.name.as_str(), bars)))
        .collect();
    if groups.is_empty() {
        return String::new();
    }
    let bars = || groups.iter().flat_map(|(_, bars)| bars);
    let values = bars().flat_map(|bar| bar.dots.iter().copied().chain([bar.value]));
    let most = values.filter(|value| value.is_finite()).fold(1.0, f64::max);
    let body = bars().count() as i32 * BAR + groups.len() as i32 * SPACE;
    svg(
        LEGEND + body + AXIS,
        "RMSE of this run and of the paper",
        |root| {
            let keys = [
                (Key::Box(PALETTE[0].filled()), "this run"),
                (Key::Box(PALETTE[4].filled()), "mean of the paper's trials"),
                (Key::Dot(INK.filled()), "each of the paper's trials"),
            ];
            legend(root, LABELS, 12, &keys)?;
            let px_per_deg = f64::from(WIDTH - LABELS - RIGHT) / (most * 1.02);
            let x = |value: f64| px(LABELS) + (value * px_per_deg * 4.0) as i32;
            draw_axis(root, &x, most, LEGEND + body)?;
            let mut top = LEGEND;
            for (name, bars) in &groups {
                let middle = px(top + BAR / 2);
                root.draw(&Text::new(*name, (0, middle), bold(text(13, INK))))?;
                for bar in bars {
                    draw_bar(root, &x, bar, top)?;
                    top += BAR;
                }
                top += SPACE;
            }
            Ok(())
        },
    )
}

fn group<'a>(trial: &Trial, paper: &'a [PaperRow]) -> Option<Vec<Bar<'a>>> {
    let rows = paper.iter().filter(|row| row.trial == trial.name);
    let printed = rows.filter_map(|row| {
        Some(Bar {
            label: &row.source,
            value: row.mean()?,
            dots: &row.values,
        })
    });
    let mut bars = vec![Bar {
        label: "this run",
        value: metrics(trial)?.rmse_deg,
        dots: &[],
    }];
    bars.extend(printed);
    (bars.len() > 1).then_some(bars)
}

fn draw_bar(root: &Area<'_>, x: &impl Fn(f64) -> i32, bar: &Bar, top: i32) -> Drawn {
    let middle = top + BAR / 2;
    let right = anchored(text(12, MUTED), HPos::Right);
    let color = if bar.dots.is_empty() {
        PALETTE[0]
    } else {
        PALETTE[4]
    };
    let corners = [(x(0.0), px(top + 4)), (x(bar.value), px(top + BAR - 4))];
    root.draw(&Rectangle::new(corners, color.filled()))?;
    if !bar.dots.is_empty() {
        let label = shortened(12, bar.label, LABELS - 28);
        root.draw(&Text::new(label, (px(LABELS - 8), px(middle)), right))?;
    }
    for &dot in bar.dots {
        let at = (x(dot), px(middle));
        root.draw(&Circle::new(at, px(4), HALO.filled()))?;
        root.draw(&Circle::new(at, px(3), EDGE.filled()))?;
    }
    // Beyond the last dot, or the number would sit on one.
    let end = bar.dots.iter().copied().fold(bar.value, f64::max);
    let at = (x(end) + px(8), px(middle));
    let value = match bar.dots {
        [] => degrees(bar.value),
        _ => format!("mean {}", degrees(bar.value)),
    };
    root.draw(&Text::new(value, at, bold(text(12, INK))))?;
    Ok(())
}

fn draw_axis(root: &Area<'_>, x: &impl Fn(f64) -> i32, most: f64, bottom: i32) -> Drawn {
    let step = round_step(most, 6.0);
    let style = anchored(text(11, MUTED), HPos::Center);
    for tick in 0..=(most / step) as i32 {
        let value = f64::from(tick) * step;
        let grid = [(x(value), px(LEGEND)), (x(value), px(bottom))];
        root.draw(&PathElement::new(grid, line(GRID, 8)))?;
        let at = (x(value), px(bottom + 12));
        root.draw(&Text::new(format!("{value}"), at, style.clone()))?;
    }
    let at = (px((LABELS + WIDTH - RIGHT) / 2), px(bottom + 32));
    let style = anchored(text(12, INK), HPos::Center);
    root.draw(&Text::new("RMSE (°)", at, style))?;
    Ok(())
}
