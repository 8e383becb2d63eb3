//! The ablation as tables: what each term of the device's default is worth.

use super::campaign::Campaign;
use super::exercise::Wearers;
use super::target::Kind;
use super::wearer::Points;
use super::widened::{Failures, failures};
use serde_json::{Value, json};

/// Of the earlier wearers all, who follow one course; of the widened all and each
/// kind of course.
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

/// For people, at most 80 columns. The first contender is the whole default, and
/// there is no PID: `over_pid` is the difference to it.
pub fn text(campaigns: &[Campaign]) -> String {
    let mut out = String::from(
        "the device's default without one term, nothing tuned anew; simulated wearers\n",
    );
    for campaign in campaigns {
        let plan = campaign.plan;
        for points in Points::ALL {
            out += &format!(
                "\n{} wearers, {}: {} of seed {}, RMSE in degrees\n{:<20}{:>6}{:>6}{:>6}{:>7}{:>6}{:>7}  - whole [95 %]\n",
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
    out += "\nhold, h.f., ripple: mean, failures and 95th percentile of ripple of the holds\n";
    out
}

type Number = (&'static str, fn(&Failures) -> f64);

const NUMBERS: [Number; 9] = [
    ("mean_deg", |f| f.mean),
    ("median_deg", |f| f.median),
    ("p95_deg", |f| f.p95),
    ("worst_deg", |f| f.worst),
    ("ripple_p95_deg", |f| f.ripple_p95),
    ("swing_p95_deg", |f| f.swing_p95),
    ("over_whole_deg", |f| f.over_pid.mean),
    ("over_whole_low_deg", |f| f.over_pid.low),
    ("over_whole_high_deg", |f| f.over_pid.high),
];

/// A line per population, number of points, term and kind of course.
pub fn csv(campaigns: &[Campaign]) -> String {
    let names = NUMBERS.map(|(name, _)| name).join(",");
    let mut out =
        format!("population,points,without,course,seed,wearers,failed,refused,restless,{names}\n");
    for campaign in campaigns {
        for points in Points::ALL {
            for n in 0..campaign.contenders.len() {
                for kind in rows(campaign) {
                    let f = failures(campaign, points, n, *kind);
                    out += &format!(
                        "{},{},{},{},{},{},{},{},{}",
                        campaign.plan.wearers.name(),
                        points.name(),
                        name(campaign, n),
                        kind.map_or("all", Kind::name),
                        campaign.plan.seed,
                        f.wearers,
                        f.failed,
                        f.refused,
                        f.restless
                    );
                    for (_, of) in NUMBERS {
                        out += &format!(",{:.3}", of(&f));
                    }
                    out.push('\n');
                }
            }
        }
    }
    out
}

/// For machines.
pub fn json(campaigns: &[Campaign]) -> Value {
    let mut lines = Vec::new();
    for campaign in campaigns {
        for points in Points::ALL {
            for n in 0..campaign.contenders.len() {
                for kind in rows(campaign) {
                    let f = failures(campaign, points, n, *kind);
                    let mut line = json!({
                        "population": campaign.plan.wearers.name(), "points": points.name(),
                        "without": name(campaign, n), "course": kind.map_or("all", Kind::name),
                        "wearers": f.wearers, "failed": f.failed, "refused": f.refused,
                        "restless": f.restless,
                    });
                    for (name, of) in NUMBERS {
                        line[name] = of(&f).into();
                    }
                    lines.push(line);
                }
            }
        }
    }
    let seed = campaigns.first().map(|c| c.plan.seed);
    json!({ "seed": seed, "lines": lines })
}
