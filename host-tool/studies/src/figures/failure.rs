//! Figure of controllers on widened wearers: failures against delay and strength.

use crate::tracking::campaign::{Campaign, Case};
use crate::tracking::contender::Contender;
use crate::tracking::exercise::FAILS_DEG;
use crate::tracking::target::Kind;
use crate::tracking::wearer::Points;
use crate::tracking::widened::failures;
use host_core::plot::ink::{Color, MUTED, PALETTE, stroke};
use host_core::plot::{Axis, Figure, Key, Mark, Paint, Panel, Scale, Shape};

/// Heights of a plot of wearers and of a plot of shares, pixels.
const HEIGHTS: (f64, f64) = (210.0, 170.0);
/// Number of intervals into which delay or strength is divided for counting wearers.
const STRETCHES: usize = 5;
/// Range of the electromechanical delay on its axis, ms.
const DELAYS: (f64, f64) = (0.0, 100.0);
/// Range of the strength on its axis, relative to the nominal wearer.
const STRENGTHS: (f64, f64) = (0.4, 3.2);
const HELD: Color = MUTED;
const FAILED: Color = PALETTE[1];
const REFUSED: Color = PALETTE[5];

/// Draws for each of three controllers on which wearers it fails, as an SVG file, and returns its
/// text.
pub fn picture(campaign: &Campaign) -> String {
    let shown = shown(campaign);
    let line = |(place, n): (usize, &usize)| {
        let (color, shape) = series(place);
        let name = campaign.contenders[*n].title();
        (Key::Marked(stroke(color, 2.0), shape), name)
    };
    let dots = [
        (
            Shape::Disc,
            Paint::Full(HELD),
            format!("succeeds: RMSE up to {FAILS_DEG}°"),
        ),
        (
            Shape::Disc,
            Paint::Full(FAILED),
            "fails at a sine".to_owned(),
        ),
        (
            Shape::Square,
            Paint::Full(FAILED),
            "fails at steps".to_owned(),
        ),
        (Shape::Up, Paint::Full(FAILED), "fails at a hold".to_owned()),
        (
            Shape::Diamond,
            Paint::Ring(REFUSED, 1.5),
            "refused".to_owned(),
        ),
    ];
    let dots = dots.map(|(shape, paint, name)| (Key::Dot(shape, paint), name));
    let scatter = |points| {
        shown
            .iter()
            .map(move |n| wearers(campaign, points, *n))
            .collect()
    };
    let mut rows: Vec<Vec<Panel>> = Points::ALL.map(scatter).into();
    rows.extend(Points::ALL.map(|points| shares(campaign, &shown, points)));
    Figure {
        title: "Where controllers fail on wearers that vary more widely".to_owned(),
        subtitle: format!(
            "{} simulated wearers, seed {}: no evidence about people.",
            campaign.plan.plants, campaign.plan.seed
        ),
        description: format!(
            "Failures of controllers on {} widely varied simulated wearers, by delay and strength",
            campaign.plan.plants
        ),
        legend: dots
            .into_iter()
            .chain(shown.iter().enumerate().map(line))
            .collect(),
        rows,
        notes: vec![
            "Besides the default controller, the PID controller and the other controller with the \
             smallest mean RMSE in two-point control are shown; + marks controllers with add-ons. \
             The controllers know only the nominal wearer file, not the strength. Table: \
             control_widened.csv."
                .to_owned(),
        ],
    }
    .file()
}

/// Returns the indices of the three controllers that are drawn: the default, the best PID, and the
/// best other one with two points.
fn shown(campaign: &Campaign) -> Vec<usize> {
    let is_other = |c: &Contender| matches!(c, Contender::Searched(..)) && !c.is_pid();
    let two = Points::Two;
    let mut shown: Vec<usize> = campaign.shipped().into_iter().collect();
    shown.extend([campaign.best_pid(two), campaign.best(two, is_other)]);
    shown
}

fn series(place: usize) -> (Color, Shape) {
    [
        (PALETTE[1], Shape::Star),
        (PALETTE[0], Shape::Square),
        (PALETTE[2], Shape::Up),
    ][place.min(2)]
}

fn delay(name: &str) -> Axis {
    Axis::linear(name, DELAYS, 5.0)
}

fn strength(name: &str) -> Axis {
    let ticks = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0].map(|x| (x, format!("{x}")));
    Axis::new(name, Scale::Linear(STRENGTHS.0, STRENGTHS.1)).ticks(ticks.into())
}

fn wearers(campaign: &Campaign, points: Points, n: usize) -> Panel {
    let x = delay(&format!("delay (ms), {}", points.name()));
    let y = strength("strength × nominal");
    let mut panel = Panel::new(&campaign.contenders[n].title(), x, y, HEIGHTS.0);
    let f = failures(campaign, points, n, None);
    panel.result = format!("{} fail", f.failed);
    let mut cases = campaign.cases_with(points);
    // Failures are drawn last, on top.
    cases.sort_by_key(|c| c.outcomes[n].has_failed() || c.outcomes[n].refused.is_some());
    for case in cases {
        let (shape, size, paint) = dot(case, n);
        let at = (case.delay_ms, case.strength);
        panel.marks.push(Mark::Dot(at, shape, size, paint));
    }
    panel
}

fn dot(case: &Case, n: usize) -> (Shape, f64, Paint) {
    let outcome = &case.outcomes[n];
    if outcome.refused.is_some() {
        return (Shape::Diamond, 4.0, Paint::Ring(REFUSED, 1.5));
    }
    if !outcome.has_failed() {
        return (Shape::Disc, 1.8, Paint::Full(HELD));
    }
    let shape = match case.kind {
        Kind::Sine => Shape::Disc,
        Kind::Steps => Shape::Square,
        Kind::Hold => Shape::Up,
    };
    (shape, 3.5, Paint::Full(FAILED))
}

/// Draws the share of wearers on whom each controller fails: over delay, over strength, and by kind
/// of reference.
fn shares(campaign: &Campaign, shown: &[usize], points: Points) -> Vec<Panel> {
    let name = "wearers that fail (%)";
    let y = || Axis::linear(name, (0.0, 100.0), 5.0);
    let over = |title: &str, x: Axis, span: (f64, f64), quantity: fn(&Case) -> f64| {
        let title = format!("{}, {title}", points.name());
        let mut panel = Panel::new(&title, x, y(), HEIGHTS.1);
        for (place, n) in shown.iter().enumerate() {
            let (color, shape) = series(place);
            let line = stretches(&campaign.cases_with(points), *n, span, quantity);
            let dots = line
                .iter()
                .map(|at| Mark::Dot(*at, shape, 4.0, Paint::Full(color)));
            let dots: Vec<Mark> = dots.collect();
            panel.marks.push(Mark::Line(line, stroke(color, 2.0)));
            panel.marks.extend(dots);
        }
        panel
    };
    let kinds = Axis::rows("reference", Kind::ALL.map(|k| k.name().to_owned()));
    let mut by_course = Panel::new(
        &format!("{}, by reference", points.name()),
        kinds,
        y(),
        HEIGHTS.1,
    );
    for (place, n) in shown.iter().enumerate() {
        let (color, shape) = series(place);
        for (column, kind) in (0..).map(f64::from).zip(Kind::ALL) {
            let f = failures(campaign, points, *n, Some(kind));
            let share = 100.0 * f.failed as f64 / f.wearers.max(1) as f64;
            let at = (column + 0.2 * (place as f64 - 1.0), share);
            by_course
                .marks
                .push(Mark::Dot(at, shape, 4.5, Paint::Full(color)));
        }
    }
    vec![
        over("over delay", delay("delay (ms)"), DELAYS, |c| c.delay_ms),
        over(
            "over strength",
            strength("strength × nominal"),
            STRENGTHS,
            |c| c.strength,
        ),
        by_course,
    ]
}

/// Returns the share of wearers on whom contender `n` fails, %, for each interval of the quantity
/// `quantity` that contains wearers, with the middle of the interval.
fn stretches(
    cases: &[&Case],
    n: usize,
    (low, high): (f64, f64),
    quantity: fn(&Case) -> f64,
) -> Vec<(f64, f64)> {
    let wide = (high - low) / STRETCHES as f64;
    let stretch = |s: usize| {
        let from = low + s as f64 * wide;
        let inside = cases
            .iter()
            .filter(|c| (from..from + wide).contains(&quantity(c)));
        let total = inside.clone().count();
        let failed = inside.filter(|c| c.outcomes[n].has_failed()).count();
        (total > 0).then(|| (from + wide / 2.0, 100.0 * failed as f64 / total as f64))
    };
    (0..STRETCHES).filter_map(stretch).collect()
}
