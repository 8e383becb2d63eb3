//! Formats the comparison of files as text, CSV and JSON.

use super::campaign::{Comparison, Score};
use super::outcome::Files;
use crate::tracking::columns::{Column, add_to_json, cells, names};
use crate::tracking::wearer::Points;
use serde_json::{Value, json};

const NUMBERS: [Column<Score>; 6] = [
    ("mean_deg", |s| s.mean_deg),
    ("p95_deg", |s| s.p95_deg),
    ("limit_cycles", |s| s.limit_cycles),
    ("over_none_deg", |s| s.over_none.mean),
    ("over_none_low_deg", |s| s.over_none.low),
    ("over_none_high_deg", |s| s.over_none.high),
];

/// Returns the files with which a population is compared.
fn files(comparison: &Comparison) -> impl Iterator<Item = Files> {
    let population = comparison.population;
    let all = Files::ALL.into_iter();
    all.filter(move |files| population.has(*files))
}

/// Formats the results as plain text of at most 80 columns.
pub fn text(comparisons: &[Comparison]) -> String {
    let mut out =
        "The default controller with different wearer files; RMSE in degrees. Simulated\n\
                   wearers, not people.\n"
            .to_owned();
    for comparison in comparisons {
        for points in Points::ALL {
            out += &format!(
                "\n{}, {}, {} draws of seed {}\n{:<20}{:>8}{:>8}{:>7}{:>7}{:>8}  minus none [95 %]\n",
                comparison.population.name(),
                points.name(),
                comparison.draws,
                comparison.seed,
                "file",
                "wearers",
                "refused",
                "mean",
                "p95",
                "cycles"
            );
            for files in files(comparison) {
                let s = comparison.score(points, files);
                let d = s.over_none;
                out += &format!(
                    "{:<20}{:>8}{:>8}{:>7.2}{:>7.2}{:>8.2}  {:+.2} [{:+.2} {:+.2}]\n",
                    files.name(),
                    s.wearers,
                    s.refused,
                    s.mean_deg,
                    s.p95_deg,
                    s.limit_cycles,
                    d.mean,
                    d.low,
                    d.high
                );
                if s.beyond_stage > 0 {
                    out += &format!("  {} × more than the stage delivers\n", s.beyond_stage);
                }
                for (why, count) in comparison.refusals(points, files) {
                    out += &format!("  {count} × {why}\n");
                }
            }
        }
    }
    out + "\ncycles: mean number of limit cycles that the device detected in a trial.\n"
}

/// Formats the results as CSV, with a row for each population, number of points and file.
pub fn csv(comparisons: &[Comparison]) -> String {
    let mut out = "wearers,points,file,seed,drawn,driven,refused,beyond_stage".to_owned()
        + &names(&NUMBERS)
        + "\n";
    for comparison in comparisons {
        for points in Points::ALL {
            for files in files(comparison) {
                let s = comparison.score(points, files);
                out += &format!(
                    "{},{},{},{},{},{},{},{}{}\n",
                    comparison.population.name(),
                    points.name(),
                    files.name().replace(',', ""),
                    comparison.seed,
                    comparison.draws,
                    s.wearers,
                    s.refused,
                    s.beyond_stage,
                    cells(&NUMBERS, &s).replace("NaN", "")
                );
            }
        }
    }
    out
}

/// Formats the results as JSON, with an entry for each population, number of points and file.
pub fn json(comparisons: &[Comparison]) -> Value {
    let rows = comparisons.iter().flat_map(|comparison| {
        Points::ALL.into_iter().flat_map(move |points| {
            files(comparison).map(move |files| {
                let s = comparison.score(points, files);
                let mut row = json!({
                    "wearers": comparison.population.name(), "points": points.name(),
                    "file": files.name(), "seed": comparison.seed, "drawn": comparison.draws,
                    "driven": s.wearers, "refused": s.refused,
                    "beyond_stage": s.beyond_stage,
                    "refusals": comparison.refusals(points, files),
                });
                add_to_json(&NUMBERS, &s, &mut row);
                row
            })
        })
    });
    json!({ "files": rows.collect::<Vec<_>>() })
}
