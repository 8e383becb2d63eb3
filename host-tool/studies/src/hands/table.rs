//! Formats the result of a campaign on hands as text, CSV and JSON.

use super::campaign::{Hands, Score};
use crate::tracking::columns::{Column, add_to_json, cells, names};
use crate::tracking::wearer::Points;
use serde_json::{Value, json};

/// Width of the column with the controllers' names, characters.
const LABEL: usize = 22;

/// Pads a controller's name to the width of its column; a longer name gets a line of its own.
fn label(title: &str) -> String {
    match title.chars().count() {
        0..=LABEL => format!("{title:<LABEL$}"),
        _ => format!("{title}\n{:<LABEL$}", ""),
    }
}

/// Formats the result as plain text of at most 80 columns.
pub fn text(hands: &Hands) -> String {
    let (plan, follow) = (hands.plan, hands.cases.len());
    let wearer_line = hands.wearer.as_deref().map_or(String::new(), |wearer| {
        format!("Wearer {wearer}; what the wearer file does not state is random.\n")
    });
    let mut out = format!(
        "{wearer_line}{} random hands (multibody forearm model), seed {}; {follow} can be driven.\n\
         Reference: a sine of 0.2 Hz from 15 to 85 % of the range that each hand can\n\
         hold. Errors are those from 10 to 30 s. Simulated hands, not people.\n",
        plan.draws, plan.seed
    );
    for (why, count) in &hands.missing {
        out += &format!("  {count} × {why}\n");
    }
    if hands.unsettled > 0 {
        out += &format!(
            "  {} intervals without current: the circuit had no solution\n",
            hands.unsettled
        );
    }
    for points in Points::ALL {
        let [low, middle, high] = hands.held_range_deg(points);
        out += &format!(
            "\n{}: range held {middle:.1}° ({low:.1} to {high:.1})\n\
             {}{:>7}{:>6}{:>6}{:>6}{:>6}{:>6}  minus PID, ° [95 %]\n",
            points.name(),
            label("controller"),
            "refused",
            "mean°",
            "p95°",
            "mean%",
            "p95%",
            "still"
        );
        for (n, contender) in hands.contenders.iter().enumerate() {
            let s = hands.score(points, n);
            let d = s.over_pid;
            let cell = label(&contender.title());
            if s.refused == follow {
                out += &format!("{cell}{:>7}\n", s.refused);
            } else {
                out += &format!(
                    "{cell}{:>7}{:>6.2}{:>6.2}{:>6.1}{:>6.1}{:>6}  {:+.2} [{:+.2} {:+.2}]\n",
                    s.refused,
                    s.mean_deg,
                    s.p95_deg,
                    100.0 * s.mean_part,
                    100.0 * s.p95_part,
                    s.no_better,
                    d.mean,
                    d.low,
                    d.high
                );
            }
            for (name, count) in hands.refusals(points, n) {
                out += &format!("  {count} × {name}\n");
            }
        }
        let pid = hands.contenders[hands.best_pid(points)].title();
        out += &format!("best PID: {pid}\n");
    }
    out + "\n%: of the range that the hand can hold. still: hands on which the controller is\n\
           no better than a finger held still in the middle of the reference.\n"
}

const NUMBERS: [Column<Score>; 7] = [
    ("mean_deg", |s| s.mean_deg),
    ("p95_deg", |s| s.p95_deg),
    ("mean_pct", |s| 100.0 * s.mean_part),
    ("p95_pct", |s| 100.0 * s.p95_part),
    ("over_pid_deg", |s| s.over_pid.mean),
    ("over_pid_low_deg", |s| s.over_pid.low),
    ("over_pid_high_deg", |s| s.over_pid.high),
];

/// Formats the result as CSV, with one row for each contender and number of points.
pub fn csv(hands: &Hands) -> String {
    let mut out = "points,law,arithmetic,seed,drawn,hands,held_p5_deg,held_median_deg,\
                   held_p95_deg,refused,no_better_than_still"
        .to_owned()
        + &names(&NUMBERS)
        + "\n";
    for points in Points::ALL {
        let [low, middle, high] = hands.held_range_deg(points);
        for (n, contender) in hands.contenders.iter().enumerate() {
            let s = hands.score(points, n);
            out += &format!(
                "{},{},{},{},{},{},{low:.2},{middle:.2},{high:.2},{},{}{}\n",
                points.name(),
                contender.name().replace(',', ""),
                contender.arithmetic(),
                hands.plan.seed,
                hands.plan.draws,
                hands.cases.len(),
                s.refused,
                s.no_better,
                cells(&NUMBERS, &s).replace("NaN", "")
            );
        }
    }
    out
}

/// Formats the result as JSON, with an entry for each number of points and contender.
pub fn json(hands: &Hands) -> Value {
    let points = Points::ALL.map(|points| {
        let laws = hands.contenders.iter().enumerate().map(|(n, contender)| {
            let s = hands.score(points, n);
            let mut law = json!({
                "law": contender.name(), "arithmetic": contender.arithmetic(),
                "refused": s.refused, "refusals": hands.refusals(points, n),
                "no_better_than_still": s.no_better,
            });
            add_to_json(&NUMBERS, &s, &mut law);
            law
        });
        let [low, middle, high] = hands.held_range_deg(points);
        json!({
            "points": points.name(),
            "held_deg": { "p5": low, "median": middle, "p95": high },
            "best_pid": hands.contenders[hands.best_pid(points)].name(),
            "laws": laws.collect::<Vec<_>>(),
        })
    });
    json!({
        "seed": hands.plan.seed, "wearers": "hands", "wearer": hands.wearer,
        "drawn": hands.plan.draws,
        "hands": hands.cases.len(), "missing": hands.missing,
        "unsettled": hands.unsettled, "points": points,
    })
}
