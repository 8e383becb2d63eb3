//! Tables of the widened wearers: where each controller fails, and which wearers it refuses.

use super::campaign::{Campaign, Case};
use super::columns::{Column, add_to_json, cells, names};
use super::exercise::{FAILS_DEG, RIPPLE_DEG};
use super::statistics::{Interval, mean, paired, percentile};
use super::target::Kind;
use super::wearer::Points;
use serde_json::{Value, json};

/// Largest part of the widened wearers that the default controller may refuse: a goal.
pub const REFUSED_AT_MOST: f64 = 0.10;

/// Results of one contender on a group of wearers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Failures {
    /// Number of wearers in the group.
    pub wearers: usize,
    /// Number of these wearers on whom the device refused or stopped.
    pub refused: usize,
    /// Number of `refused` wearers on whom the best PID did not fail, so that the refusal was
    /// unnecessary.
    pub refused_needlessly: usize,
    /// Number of wearers on whom the RMSE exceeds [`FAILS_DEG`] without a refusal.
    pub failed: usize,
    /// Mean RMSE over the wearers without a refusal, °.
    pub mean: f64,
    /// Median RMSE over the wearers without a refusal, °.
    pub median: f64,
    /// 95th percentile of the RMSE over the wearers without a refusal, °.
    pub p95: f64,
    /// Largest RMSE over the wearers without a refusal, °.
    pub worst: f64,
    /// 95th percentile of the RMS ripple of held angles, °; NaN if the group has no holds.
    pub ripple_p95: f64,
    /// 95th percentile of the peak-to-peak ripple of held angles, °; NaN if the group has no holds.
    pub swing_p95: f64,
    /// Number of holds whose RMS ripple exceeds [`RIPPLE_DEG`].
    pub restless: usize,
    /// Mean difference between the RMSE and that of the best PID on the same wearer, °, with its
    /// interval.
    pub over_pid: Interval,
}

/// Computes the results of a contender on the wearers with these points, for one kind of reference
/// or for all (`None`).
pub fn failures(
    campaign: &Campaign,
    points: Points,
    contender: usize,
    kind: Option<Kind>,
) -> Failures {
    let mut cases = campaign.cases_with(points);
    cases.retain(|c| kind.is_none_or(|k| c.kind == k));
    let outcome = |c: &Case| c.outcomes[contender].clone();
    let pid = campaign.best_pid(points);
    let refused = cases.iter().filter(|c| outcome(c).refused.is_some());
    let needless = |c: &&&Case| !c.outcomes[pid].has_failed();
    let tracked: Vec<&Case> = cases
        .iter()
        .copied()
        .filter(|c| outcome(c).refused.is_none())
        .collect();
    let errors: Vec<f64> = tracked.iter().map(|c| outcome(c).rmse).collect();
    let theirs: Vec<f64> = tracked.iter().map(|c| c.outcomes[pid].rmse).collect();
    let ripples = tracked.iter().filter_map(|c| outcome(c).ripple);
    let rms: Vec<f64> = ripples.clone().map(|r| r.rms_deg).collect();
    let swings: Vec<f64> = ripples.map(|r| r.peak_to_peak_deg).collect();
    Failures {
        wearers: cases.len(),
        refused: refused.clone().count(),
        refused_needlessly: refused.filter(needless).count(),
        failed: tracked.iter().filter(|c| outcome(c).has_failed()).count(),
        mean: mean(&errors),
        median: percentile(&errors, 0.5),
        p95: percentile(&errors, 0.95),
        worst: percentile(&errors, 1.0),
        ripple_p95: percentile(&rms, 0.95),
        swing_p95: percentile(&swings, 0.95),
        restless: rms.iter().filter(|r| **r > RIPPLE_DEG).count(),
        over_pid: paired(&errors, &theirs),
    }
}

/// Returns `None`, which stands for all kinds of reference together, then each kind.
fn kinds() -> impl Iterator<Item = Option<Kind>> {
    std::iter::once(None).chain(Kind::ALL.map(Some))
}

fn kind_name(kind: Option<Kind>) -> &'static str {
    kind.map_or("all", Kind::name)
}

/// Columns of the tables that contain RMSE and ripple.
pub(super) const NUMBERS: [Column<Failures>; 6] = [
    ("mean_deg", |f| f.mean),
    ("median_deg", |f| f.median),
    ("p95_deg", |f| f.p95),
    ("worst_deg", |f| f.worst),
    ("ripple_p95_deg", |f| f.ripple_p95),
    ("swing_p95_deg", |f| f.swing_p95),
];

/// Formats the results on widened wearers as text of at most 80 columns.
pub fn text(campaign: &Campaign) -> String {
    let plan = campaign.plan;
    let mut out = format!(
        "{} widened wearers, seed {}: strength × 0.5…2.8, delay 0…100 ms, an object\n\
         taken and dropped, a knock; references: sines, steps and holds in turn.\n\
         A controller fails on a wearer if the RMSE in reach is above {FAILS_DEG}°.\n\
         Simulated wearers, not people.\n",
        plan.plants, plan.seed
    );
    for points in Points::ALL {
        out += &format!(
            "\n{}\n{:<22}{:>6}{:>6}{:>6}{:>6}{:>7}{:>8}{:>6}{:>7}{:>7}\n",
            points.name(),
            "controller",
            "fails",
            "sine",
            "steps",
            "hold",
            "refused",
            "mean",
            "p95",
            "worst",
            "ripple"
        );
        for (n, contender) in campaign.contenders.iter().enumerate() {
            let [all, sine, steps, hold] =
                [None, Some(Kind::Sine), Some(Kind::Steps), Some(Kind::Hold)]
                    .map(|kind| failures(campaign, points, n, kind));
            out += &format!(
                "{:<22}{:>6}{:>6}{:>6}{:>6}{:>7}{:>8.2}{:>6.2}{:>7.2}{:>7.2}\n",
                contender.title(),
                all.failed,
                sine.failed,
                steps.failed,
                hold.failed,
                all.refused,
                all.mean,
                all.p95,
                all.worst,
                all.ripple_p95
            );
        }
        let pid = campaign.contenders[campaign.best_pid(points)].title();
        out += &format!("best PID: {pid}\n");
        out += &verdict(campaign, points);
    }
    out
}

/// Describes whether the default controller meets its goals with these points.
fn verdict(campaign: &Campaign, points: Points) -> String {
    let Some(shipped) = campaign.shipped() else {
        return String::new();
    };
    let f = failures(campaign, points, shipped, None);
    let holds = failures(campaign, points, shipped, Some(Kind::Hold));
    let share = f.refused as f64 / f.wearers.max(1) as f64;
    let hit = |is: bool| if is { "met   " } else { "missed" };
    let mut out = format!("{}:\n", campaign.contenders[shipped].title());
    out += &format!(
        "{} fails on no wearer: {} of {}\n",
        hit(f.failed == 0),
        f.failed,
        f.wearers
    );
    out += &format!(
        "{} refuses at most {:.0} %: {:.1} %; the best PID does not fail on {} of these\n",
        hit(share <= REFUSED_AT_MOST && f.refused_needlessly == 0),
        REFUSED_AT_MOST * 100.0,
        share * 100.0,
        f.refused_needlessly
    );
    out += &format!(
        "{} ripple of holds at most {RIPPLE_DEG}° RMS: above it in {} of {} (p95 {:.2}°)\n",
        hit(holds.restless == 0),
        holds.restless,
        holds.wearers - holds.refused,
        holds.ripple_p95
    );
    for name in refusals(campaign, points, shipped) {
        out += &format!("  refused {} times: {}\n", name.1, name.0);
    }
    out
}

/// Returns each reason for which a contender was refused, with its number of wearers.
fn refusals(campaign: &Campaign, points: Points, contender: usize) -> Vec<(String, usize)> {
    let mut counts = std::collections::BTreeMap::new();
    for case in campaign.cases_with(points) {
        if let Some(name) = &case.outcomes[contender].refused {
            *counts.entry(name.clone()).or_insert(0) += 1;
        }
    }
    counts.into_iter().collect()
}

/// Formats the results on widened wearers as CSV, with a line for each contender, number of points
/// and kind of reference.
pub fn csv(campaign: &Campaign) -> String {
    let mut out = "points,law,arithmetic,course,seed,wearers,failed,refused,refused_needlessly"
        .to_owned()
        + &names(&NUMBERS)
        + ",restless,over_pid_deg,over_pid_low_deg,over_pid_high_deg\n";
    for points in Points::ALL {
        for (n, contender) in campaign.contenders.iter().enumerate() {
            for kind in kinds() {
                let f = failures(campaign, points, n, kind);
                let (law, seed) = (contender.name(), campaign.plan.seed);
                out += &format!(
                    "{},{law},{},{},{seed},{},{},{},{}{},{},{:.3},{:.3},{:.3}\n",
                    points.name(),
                    contender.arithmetic(),
                    kind_name(kind),
                    f.wearers,
                    f.failed,
                    f.refused,
                    f.refused_needlessly,
                    cells(&NUMBERS, &f),
                    f.restless,
                    f.over_pid.mean,
                    f.over_pid.low,
                    f.over_pid.high
                );
            }
        }
    }
    out
}

/// Formats the results on widened wearers as JSON.
pub fn json(campaign: &Campaign) -> Value {
    let points = Points::ALL.map(|points| {
        let laws = campaign
            .contenders
            .iter()
            .enumerate()
            .map(|(n, contender)| {
                let courses = kinds().map(|kind| {
                    let f = failures(campaign, points, n, kind);
                    let mut line = json!({
                        "course": kind_name(kind), "wearers": f.wearers, "failed": f.failed,
                        "refused": f.refused, "refused_needlessly": f.refused_needlessly,
                        "restless": f.restless,
                        "over_best_pid_deg": { "mean": f.over_pid.mean, "low": f.over_pid.low,
                                               "high": f.over_pid.high },
                    });
                    add_to_json(&NUMBERS, &f, &mut line);
                    line
                });
                json!({
                    "law": contender.name(), "courses": courses.collect::<Vec<_>>(),
                    "refusals": refusals(campaign, points, n),
                })
            });
        json!({
            "points": points.name(),
            "best_pid": campaign.contenders[campaign.best_pid(points)].name(),
            "laws": laws.collect::<Vec<_>>(),
        })
    });
    json!({
        "seed": campaign.plan.seed, "wearers": campaign.plan.wearers.name(),
        "plants": campaign.plan.plants, "fails_above_deg": FAILS_DEG,
        "ripple_at_most_deg": RIPPLE_DEG, "points": points,
    })
}
