//! Tables of the ablation: the contribution of each term of the default controller.

use super::campaign::Campaign;
use super::columns::{Column, add_to_json, cells, names};
use super::exercise::Wearers;
use super::target::Kind;
use super::wearer::Points;
use super::widened::{Failures, NUMBERS, failures};
use serde_json::{Value, json};

/// Kinds of reference for which the table has a row; `None` is the row over all kinds. The earlier
/// wearers all follow one reference and have only this row.
const ROWS: [Option<Kind>; 4] = [None, Some(Kind::Sine), Some(Kind::Steps), Some(Kind::Hold)];

fn rows(campaign: &Campaign) -> &'static [Option<Kind>] {
    match campaign.plan.wearers {
        Wearers::Earlier => &ROWS[..1],
        Wearers::Widened => &ROWS,
    }
}

fn name(campaign: &Campaign, contender: usize) -> String {
    match contender {
        0 => "whole".to_owned(),
        n => campaign.contenders[n].name(),
    }
}

/// Formats the ablation as a text table of at most 80 columns. The first contender must be the
/// whole default controller. There is no PID contender, so that `over_pid` is the difference from
/// that first contender.
pub fn text(campaigns: &[Campaign]) -> String {
    let mut out = String::from(
        "default controller without one of its terms, not tuned again; simulated wearers\n",
    );
    for campaign in campaigns {
        let plan = campaign.plan;
        for points in Points::ALL {
            out += &format!(
                "\n{} wearers, {}: {} draws, seed {}, RMSE in degrees\n\
                 {:<20}{:>6}{:>6}{:>6}{:>7}{:>6}{:>7}  minus whole [95 %]\n",
                plan.wearers.name(),
                points.name(),
                plan.plants,
                plan.seed,
                "without",
                "mean",
                "p95",
                "fails",
                "hold",
                "h.f.",
                "ripple"
            );
            for n in 0..campaign.contenders.len() {
                let f = failures(campaign, points, n, None);
                let h = failures(campaign, points, n, Some(Kind::Hold));
                let d = f.over_pid;
                out += &format!(
                    "{:<20}{:>6.2}{:>6.2}{:>6}{:>7.2}{:>6}{:>7.2}  {:+.2} [{:+.2} {:+.2}]\n",
                    name(campaign, n),
                    f.mean,
                    f.p95,
                    f.failed,
                    h.mean,
                    h.failed,
                    f.ripple_p95,
                    d.mean,
                    d.low,
                    d.high
                );
            }
        }
    }
    out += "\nhold: mean RMSE of the holds; h.f.: failed holds;\n\
            ripple: 95th percentile of the ripple of the holds\n";
    out
}

const OVER_WHOLE: [Column<Failures>; 3] = [
    ("over_whole_deg", |f| f.over_pid.mean),
    ("over_whole_low_deg", |f| f.over_pid.low),
    ("over_whole_high_deg", |f| f.over_pid.high),
];

/// Calls `line` for each population, number of points, term and kind of reference, and returns what
/// it returned. It receives the campaign, the names of these four, and the results.
fn lines<T>(campaigns: &[Campaign], line: impl Fn(&Campaign, [&str; 4], &Failures) -> T) -> Vec<T> {
    let mut lines = Vec::new();
    for campaign in campaigns {
        for points in Points::ALL {
            for n in 0..campaign.contenders.len() {
                for kind in rows(campaign) {
                    let (without, course) = (name(campaign, n), kind.map_or("all", Kind::name));
                    let population = campaign.plan.wearers.name();
                    let names = [population, points.name(), &without, course];
                    lines.push(line(campaign, names, &failures(campaign, points, n, *kind)));
                }
            }
        }
    }
    lines
}

/// Formats the ablation as CSV.
pub fn csv(campaigns: &[Campaign]) -> String {
    let line = |campaign: &Campaign, names: [&str; 4], f: &Failures| {
        let (seed, numbers) = (
            campaign.plan.seed,
            cells(&NUMBERS, f) + &cells(&OVER_WHOLE, f),
        );
        let counts = format!("{},{},{},{}", f.wearers, f.failed, f.refused, f.restless);
        format!("{},{seed},{counts}{numbers}\n", names.join(","))
    };
    let names = names(&NUMBERS) + &names(&OVER_WHOLE);
    format!("population,points,without,course,seed,wearers,failed,refused,restless{names}\n")
        + &lines(campaigns, line).concat()
}

/// Formats the ablation as JSON.
pub fn json(campaigns: &[Campaign]) -> Value {
    let line = |_: &Campaign, [population, points, without, course]: [&str; 4], f: &Failures| {
        let mut line = json!({
            "population": population, "points": points, "without": without, "course": course,
            "wearers": f.wearers, "failed": f.failed, "refused": f.refused,
            "restless": f.restless,
        });
        add_to_json(&NUMBERS, f, &mut line);
        add_to_json(&OVER_WHOLE, f, &mut line);
        line
    };
    let seed = campaigns.first().map(|c| c.plan.seed);
    json!({ "seed": seed, "lines": lines(campaigns, line) })
}
