//! Figure of controllers on hands: every hand's error, and means.

use crate::hands::{Contender, DrivenHand, Hands};
use crate::tracking::wearer::Points;
use host_core::plot::ink::{Color, MUTED, PALETTE, stroke};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Shape};

const PITCH: f64 = 40.0;
/// Largest error on the axis, % of the range of angles that a hand holds; larger errors are drawn
/// at the edge.
const ERROR_TOP: f64 = 100.0;

/// Draws one row for each controller, as an SVG file, and returns its text.
pub fn picture(hands: &Hands) -> String {
    let dots = [
        ("one hand", MUTED, Shape::Disc),
        ("mean, device code", PALETTE[1], Shape::Star),
        ("mean, floating point", PALETTE[0], Shape::Square),
    ];
    let dots =
        dots.map(|(name, color, shape)| (Key::Dot(shape, Paint::Full(color)), name.to_owned()));
    let to = (
        Key::Line(stroke(MUTED, 2.0)),
        "from the mean to the 95th percentile".to_owned(),
    );
    let suffix = hands.wearer.as_ref().map(|wearer| format!(" of {wearer}"));
    Figure {
        title: "Controllers on simulated hands".to_owned(),
        subtitle: format!(
            "{} of {} random hands{} can be driven, seed {}: no evidence about people.",
            hands.cases.len(),
            hands.plan.draws,
            suffix.unwrap_or_default(),
            hands.plan.seed
        ),
        description: format!(
            "Tracking error of controllers on {} simulated hands",
            hands.cases.len()
        ),
        legend: dots.into_iter().chain([to]).collect(),
        rows: vec![Points::ALL.map(|points| errors(hands, points)).into()],
        notes: vec![
            "Reference: a sine between 15 and 85 % of the range that each hand can hold. Held \
             still: a finger that stays in the middle of the reference. + marks controllers with \
             add-ons. Table: "
                .to_owned()
                + &hands.file_stem()
                + ".csv.",
        ],
    }
    .file()
}

const fn mark(contender: &Contender) -> (Color, Shape) {
    match contender {
        Contender::Unknown | Contender::Calibrated => (PALETTE[1], Shape::Star),
        Contender::Searched(..) => (PALETTE[0], Shape::Square),
    }
}

fn errors(hands: &Hands, points: Points) -> Panel {
    let x = Axis::linear("RMSE (% of the range held)", (0.0, ERROR_TOP), 5.0);
    let x = x.reference_line(100.0 * DrivenHand::STILL, "held still", MUTED);
    let names = hands.contenders.iter().map(Contender::title);
    let y = Axis::rows("", names).hide_labels(points == Points::Two);
    let height = hands.contenders.len() as f64 * PITCH;
    let mut panel = Panel::new(points.name(), x, y, height);
    for (row, n) in (0..).map(f64::from).zip(0..hands.contenders.len()) {
        let tracked = hands.tracked(points, n);
        for (case, rmse) in &tracked {
            let at = ((100.0 * rmse / case.holds_deg).min(ERROR_TOP), row + 0.22);
            let paint = Paint::Full(MUTED);
            panel.marks.push(Mark::Dot(at, Shape::Disc, 1.8, paint));
        }
        if tracked.is_empty() {
            continue;
        }
        let (color, shape) = mark(&hands.contenders[n]);
        let score = hands.score(points, n);
        let at = |part: f64| ((100.0 * part).min(ERROR_TOP), row - 0.1);
        let (mean, p95) = (at(score.mean_part), at(score.p95_part));
        panel.marks.extend([
            Mark::Line(vec![mean, p95], stroke(color, 2.0)),
            Mark::Dot(p95, Shape::End, 4.0, Paint::Full(color)),
            Mark::Dot(mean, shape, 4.0, Paint::Full(color)),
        ]);
    }
    panel
}
