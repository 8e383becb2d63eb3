//! Tables of a campaign and of a search: text, JSON, CSV.

use super::campaign::{Campaign, Score};
use super::candidate::form_title;
use super::columns::{Column, add_to_json, cells, names};
use super::contender::Contender;
use super::gains::{Default, Row};
use super::target::Course;
use super::wearer::Points;
use super::widened::failures;
use hal_sim::body::random_finger::TWO_POINTS_NM;
use serde_json::{Value, json};

/// Goal of the default controller with two stimulation points: largest mean RMSE over the plants
/// that can reach the whole reference, °.
pub const TWO_POINT_MEAN: f64 = 1.0;
/// Goal of the default controller with two stimulation points: largest 95th percentile of the RMSE
/// over the plants that can reach the whole reference, °.
pub const TWO_POINT_P95: f64 = 1.6;
/// Goal of the default controller with two stimulation points: largest RMSE on the nominal wearer,
/// °.
const NOMINAL: f64 = 1.0;
/// Goal of the default controller: largest upper end of the confidence interval of its RMSE minus
/// that of the best PID, °.
const OVER_PID_DEG: f64 = 0.05;

impl Course {
    /// Returns the description of the reference in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sine => "45 ± 40° at 0.2 Hz",
            Self::Smooth { .. } => "four slow sines, 45 ± 40°",
            Self::SineAt { .. } => "45 ± 40° at 0.1…0.5 Hz",
            Self::Steps { .. } => "steps between 10 and 80°",
            Self::Hold { .. } => "a hold at 15…75°",
        }
    }
}

/// A goal of the default controller, with its measured value.
#[derive(Clone, PartialEq, Debug)]
pub struct Goal {
    /// Description of the goal for the table.
    pub name: String,
    /// Value that the campaign yielded, °.
    pub value: f64,
    /// Largest value at which the goal is met, °.
    pub at_most: f64,
}

impl Goal {
    /// Returns whether the measured value meets the goal.
    pub fn is_hit(&self) -> bool {
        self.value <= self.at_most
    }
}

/// Returns the goals of the default controller; empty if it does not take part in the campaign.
pub fn goals(campaign: &Campaign) -> Vec<Goal> {
    let Some(shipped) = campaign.shipped() else {
        return Vec::new();
    };
    let two = campaign.score(Points::Two, shipped);
    let goal = |name: &str, value, at_most| Goal {
        name: name.to_owned(),
        value,
        at_most,
    };
    let mut goals = vec![
        goal(
            "two-point, wearers in reach, mean",
            two.reaching,
            TWO_POINT_MEAN,
        ),
        goal(
            "two-point, wearers in reach, p95",
            two.reaching_p95,
            TWO_POINT_P95,
        ),
        goal("two-point, nominal wearer", two.nominal, NOMINAL),
    ];
    goals.extend(Points::ALL.map(|points| {
        let name = format!("{}, all wearers, minus best PID, upper end", points.name());
        let high = campaign.score(points, shipped).against_pid.high;
        goal(&name, high, OVER_PID_DEG)
    }));
    goals
}

/// Formats the results of a campaign as text of at most 80 columns.
pub fn text(campaign: &Campaign) -> String {
    let mut out = String::new();
    write_text(&mut out, campaign);
    out
}

fn write_text(out: &mut String, campaign: &Campaign) {
    let plan = campaign.plan;
    out.push_str(&format!(
        "{} simulated wearers, seed {}; reference: {}\n",
        plan.plants,
        plan.seed,
        plan.course.name()
    ));
    out.push_str(
        "RMSE in degrees against the reachable part of the reference, 10 to 30 s.\n\
         + marks controllers with add-ons. Simulated wearers, not people.\n",
    );
    for points in Points::ALL {
        write_points(out, campaign, points);
    }
    out.push_str("\ngoals of the default controller:\n");
    for goal in goals(campaign) {
        let verdict = if goal.is_hit() { "met   " } else { "missed" };
        out.push_str(&format!(
            "{verdict} {:<52}{:>6.2} (at most {:.2})\n",
            goal.name, goal.value, goal.at_most
        ));
    }
    if campaign.plan.optimum_plants == 0 {
        return;
    }
    let beaten = campaign.margin_below_optimum();
    out.push_str(&format!(
        "no controller is better than the optimum by more than {:.2}°\n",
        beaten.max(0.0)
    ));
}

fn write_points(out: &mut String, campaign: &Campaign, points: Points) {
    let (unreachable, reaching) = campaign.reach(points);
    let (optimum, optimum_p95) = campaign.optimum(points);
    let [low, high] = TWO_POINTS_NM;
    let assumed = match points {
        Points::One => String::new(),
        Points::Two => format!(" (both points together {low}…{high} N·m, assumed)"),
    };
    let optimum = match campaign.plan.optimum_plants {
        0 => String::new(),
        n => format!(";\noptimum {optimum:.2}°, p95 {optimum_p95:.2}°, on the first {n} wearers"),
    };
    out.push_str(&format!(
        "\n{}{assumed}:\n\
         reference out of reach for {:.1} % of the time; {:.0} % of wearers reach all of it\
         {optimum}\n",
        points.name(),
        unreachable * 100.0,
        reaching * 100.0
    ));
    out.push_str(&format!(
        "{:<22}{:>7}{:>6}{:>6}{:>7}{:>8}  minus best PID [95 %]\n",
        "controller", "cycles", "mean", "p95", "regret", "nominal"
    ));
    for (n, contender) in campaign.contenders.iter().enumerate() {
        let Score {
            mean,
            p95,
            regret,
            nominal,
            against_pid: d,
            ..
        } = campaign.score(points, n);
        let regret = match campaign.plan.optimum_plants {
            0 => String::new(),
            _ => format!("{regret:.2}"),
        };
        out.push_str(&format!(
            "{:<22}{:>7}{mean:>6.2}{p95:>6.2}{regret:>7}{nominal:>8.2}  {:+.2} [{:+.2} {:+.2}]\n",
            contender.title(),
            campaign.cycles[n].map_or_else(String::new, |c| c.whole.to_string()),
            d.mean,
            d.low,
            d.high
        ));
    }
    let title = |n: usize| campaign.contenders[n].title();
    out.push_str(&format!(
        "best: {}\n",
        title(campaign.best(points, |_| true))
    ));
    let pid = campaign.best_pid(points);
    out.push_str(&format!("best PID: {}\n", title(pid)));
    if let Some(shipped) = campaign.shipped() {
        let d = campaign.score(points, shipped).against_pid;
        out.push_str(&format!(
            "{} minus best PID: {:+.2}° [{:+.2} {:+.2}]\n",
            title(shipped),
            d.mean,
            d.low,
            d.high
        ));
    }
}

const NUMBERS: [Column<Score>; 7] = [
    ("mean_deg", |s| s.mean),
    ("p95_deg", |s| s.p95),
    ("regret_deg", |s| s.regret),
    ("regret_p95_deg", |s| s.regret_p95),
    ("in_reach_mean_deg", |s| s.reaching),
    ("in_reach_p95_deg", |s| s.reaching_p95),
    ("nominal_deg", |s| s.nominal),
];

const OVER_PID: [Column<Score>; 3] = [
    ("over_pid_deg", |s| s.against_pid.mean),
    ("over_pid_low_deg", |s| s.against_pid.low),
    ("over_pid_high_deg", |s| s.against_pid.high),
];

/// Formats the results of a campaign as CSV, with a line for each contender and number of points.
pub fn csv(campaign: &Campaign) -> String {
    let mut out = format!(
        "points,law,arithmetic,cycles,seed,plants,unreachable_pct,optimum_deg{}{},law_cycles,\
         differentiator_cycles,add_ons_cycles,refused,failed,optimum_plants\n",
        names(&NUMBERS),
        names(&OVER_PID)
    );
    for points in Points::ALL {
        let (unreachable, _) = campaign.reach(points);
        let (optimum, _) = campaign.optimum(points);
        for (n, contender) in campaign.contenders.iter().enumerate() {
            let s = campaign.score(points, n);
            let cycles = campaign.cycles[n].map_or_else(String::new, |c| c.whole.to_string());
            let f = failures(campaign, points, n, None);
            let (seed, plants) = (campaign.plan.seed, campaign.plan.plants);
            let (points, law, arithmetic) =
                (points.name(), contender.name(), contender.arithmetic());
            let unreachable = unreachable * 100.0;
            out += &format!(
                "{points},{law},{arithmetic},{cycles},{seed},{plants},{unreachable:.2},{optimum:.3}"
            );
            out += &(cells(&NUMBERS, &s) + &cells(&OVER_PID, &s));
            let parts = campaign.cycles[n].map_or_else(
                || ",,,".to_owned(),
                |c| format!(",{},{},{}", c.law, c.differentiator, c.add_ons),
            );
            let optimum_plants = campaign.plan.optimum_plants.min(plants);
            out += &format!("{parts},{},{},{optimum_plants}\n", f.refused, f.failed);
        }
    }
    out
}

/// Formats the results of a campaign as JSON.
pub fn json(campaign: &Campaign) -> Value {
    let points = Points::ALL.map(|points| {
        let (unreachable, reaching) = campaign.reach(points);
        let (optimum, optimum_p95) = campaign.optimum(points);
        let laws = campaign
            .contenders
            .iter()
            .enumerate()
            .map(|(n, contender)| {
                let s = campaign.score(points, n);
                let d = s.against_pid;
                let mut law = json!({
                    "law": contender.name(), "arithmetic": contender.arithmetic(),
                    "cycles": campaign.cycles[n].map(|c| json!({
                        "whole": c.whole, "law": c.law,
                        "differentiator": c.differentiator, "add_ons": c.add_ons,
                    })),
                    "over_best_pid_deg": { "mean": d.mean, "low": d.low, "high": d.high },
                });
                add_to_json(&NUMBERS, &s, &mut law);
                law
            });
        json!({
            "points": points.name(), "unreachable_share": unreachable,
            "plants_in_reach": reaching, "optimum_deg": optimum,
            "optimum_p95_deg": optimum_p95,
            "best": campaign.contenders[campaign.best(points, |_| true)].name(),
            "best_pid": campaign.contenders[campaign.best_pid(points)].name(),
            "laws": laws.collect::<Vec<_>>(),
        })
    });
    let goal = |g: Goal| json!({ "goal": g.name, "deg": g.value, "at_most_deg": g.at_most, "hit": g.is_hit() });
    json!({
        "seed": campaign.plan.seed, "plants": campaign.plan.plants,
        "course": campaign.plan.course.name(),
        "two_points_nm_assumed": { "low": TWO_POINTS_NM[0], "high": TWO_POINTS_NM[1] },
        "points": points,
        "goals": goals(campaign).into_iter().map(goal).collect::<Vec<_>>(),
        "optimum_beaten_by_deg": campaign.margin_below_optimum().max(0.0),
    })
}

/// Formats the results of a search as text; `evaluations` is the number of evaluations per law.
pub fn search_text(rows: &[Row], default: Option<&Default>, evaluations: usize) -> String {
    let mut out = format!(
        "{evaluations} evaluations for each controller; cost: geometric mean of the\n\
         root mean square RMSE on the earlier and on the widened training wearers\n"
    );
    for (equipment, found) in rows {
        let c = &found.candidate;
        out.push_str(&format!(
            "{:<22}{:<10}{:>6.2}°  {:>2} ms  {:?}{}  {:?}\n",
            form_title(c.form),
            equipment.name(),
            found.cost,
            c.period_ms,
            c.add_ons.derivative,
            if c.add_ons.feed_forward { " +ff" } else { "" },
            c.add_ons.delay
        ));
    }
    if let Some(found) = default {
        let title = Contender::Shipped.title();
        out.push_str(&format!("{title:<32}{:>6.2}°\n", found.cost));
        for (name, x) in &found.candidate {
            out.push_str(&format!("    {name:<26}{x:>10.3}\n"));
        }
    }
    out
}

/// Formats the results of a search as JSON; `evaluations` is the number of evaluations per law.
pub fn search_json(rows: &[Row], default: Option<&Default>, evaluations: usize) -> Value {
    let entry = |(equipment, found): &Row| {
        json!({
            "law": found.candidate.form.name(), "equipment": equipment.name(),
            "training_rmse_deg": found.cost, "numbers": found.candidate.values,
        })
    };
    json!({
        "evaluations": evaluations, "laws": rows.iter().map(entry).collect::<Vec<_>>(),
        "device_default": default.map(|found| json!({
            "training_rmse_deg": found.cost, "numbers": found.candidate,
        })),
    })
}
