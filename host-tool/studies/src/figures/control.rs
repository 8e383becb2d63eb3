//! Figure of controllers on random wearers: cycles, mean and 95th percentile of the error.

use crate::tracking::campaign::Campaign;
use crate::tracking::candidate::Equipment;
use crate::tracking::contender::Contender;
use crate::tracking::table::{TWO_POINT_MEAN, TWO_POINT_P95};
use crate::tracking::wearer::Points;
use host_core::plot::ink::{Color, MUTED, PALETTE, SHADE, stroke};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Scale, Shape};

const PITCH: f64 = 24.0;
/// Largest error on the axis, °; a larger error ends at the edge with an arrow and its number.
const ERROR_TOP: f64 = 10.0;

/// Draws one row per controller, sorted by cycles, as an SVG file and returns its text.
pub fn picture(campaign: &Campaign) -> String {
    let mut order: Vec<usize> = (0..campaign.contenders.len()).collect();
    order.sort_by_key(|n| campaign.cycles[*n].map_or(u64::MAX, |c| c.whole));
    let errors = Points::ALL.map(|points| errors(campaign, &order, points));
    let dots = [
        ("mean, controller alone", PALETTE[0], Shape::Disc),
        ("mean, with add-ons (+)", PALETTE[2], Shape::Up),
        ("mean, default controller", PALETTE[1], Shape::Star),
    ];
    let dots =
        dots.map(|(name, color, shape)| (Key::Dot(shape, Paint::Full(color)), name.to_owned()));
    let to = (
        Key::Line(stroke(MUTED, 2.0)),
        "from the mean to the 95th percentile".to_owned(),
    );
    Figure {
        description: format!(
            "Tracking error and cycles of {} controllers on {} random simulated wearers",
            order.len(),
            campaign.plan.plants
        ),
        legend: dots.into_iter().chain([to]).collect(),
        rows: vec![[cost(campaign, &order)].into_iter().chain(errors).collect()],
        notes: vec![
            "Optimum: mean of the smallest possible error, computed offline with the whole \
             reference known. Goals: values set in advance for the mean and the 95th percentile \
             of two-point control. Simulated wearers, not people."
                .to_owned(),
        ],
        ..Figure::default()
    }
    .file()
}

const fn mark(contender: &Contender) -> (Color, Shape) {
    match contender {
        Contender::Shipped | Contender::Ablated(_) => (PALETTE[1], Shape::Star),
        Contender::Searched(Equipment::Equipped, _) => (PALETTE[2], Shape::Up),
        Contender::Searched(Equipment::Alone, _) => (PALETTE[0], Shape::Disc),
    }
}

/// Returns a panel without data, in which the row of the device's default controller is shaded.
fn panel(campaign: &Campaign, order: &[usize], title: &str, x: Axis, silent: bool) -> Panel {
    let names = order.iter().map(|n| campaign.contenders[*n].title());
    let is_shipped = |n: &usize| matches!(campaign.contenders[*n], Contender::Shipped);
    let shaded = order.iter().position(is_shipped).map(|row| {
        let (row, full_width) = (row as f64, (f64::NEG_INFINITY, f64::INFINITY));
        Mark::Area(full_width, (row - 0.5, row + 0.5), Paint::Full(SHADE))
    });
    let y = Axis::rows("", names).hide_labels(silent);
    Panel {
        ground: shaded.into_iter().collect(),
        ..Panel::new(title, x, y, order.len() as f64 * PITCH)
    }
}

fn cost(campaign: &Campaign, order: &[usize]) -> Panel {
    let cycles = [100.0, 300.0, 1000.0, 3000.0, 10_000.0].map(|n| (n, format!("{n}")));
    let x = Axis::new(
        "cycles of the controller per tick",
        Scale::Log(100.0, 10_000.0),
    );
    let mut panel = panel(campaign, order, "Cost", x.ticks(cycles.into()), false);
    panel.share = 0.8;
    for (row, n) in (0..).map(f64::from).zip(order) {
        let (color, shape) = mark(&campaign.contenders[*n]);
        if let Some(cycles) = campaign.cycles[*n] {
            let at = (cycles.whole as f64, row);
            panel
                .marks
                .push(Mark::Dot(at, shape, 4.0, Paint::Full(color)));
            panel
                .marks
                .push(Mark::Beside(at, 10.0, cycles.whole.to_string()));
        }
    }
    panel
}

fn errors(campaign: &Campaign, order: &[usize], points: Points) -> Panel {
    let name = "RMSE to the reachable reference (°)";
    let mut x = Axis::linear(name, (0.0, ERROR_TOP), 5.0);
    x = x.reference_line(campaign.optimum(points).0, "optimum", MUTED);
    if points == Points::Two {
        x = x.reference_line(TWO_POINT_MEAN, "goal, mean", MUTED);
        x = x.reference_line(TWO_POINT_P95, "goal, 95 %", MUTED);
    }
    let mut panel = panel(campaign, order, points.name(), x, true);
    for (row, n) in (0..).map(f64::from).zip(order) {
        let (color, shape) = mark(&campaign.contenders[*n]);
        let score = campaign.score(points, *n);
        let (mean, p95) = ((score.mean, row), (score.p95, row));
        let end = match score.p95 > ERROR_TOP {
            true => Shape::Beyond,
            false => Shape::End,
        };
        panel.marks.extend([
            Mark::Line(vec![mean, p95], stroke(color, 2.0)),
            Mark::Dot(p95, end, 4.0, Paint::Full(color)),
            Mark::Dot(mean, shape, 4.0, Paint::Full(color)),
        ]);
        if score.p95 > ERROR_TOP {
            panel.y = panel.y.far_label(row, &format!("{:.1}", score.p95));
        }
    }
    panel
}
