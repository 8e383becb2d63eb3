//! Summarises all replications for `result.json` and the report page.

use super::claims::{diagonal, errors, median_of, shares};
use super::course::Condition;
use super::declaration::{DECLARED, Study};
use super::error::EndpointError;
use super::figure_8;
use super::metrics::median;
use super::replication::{CONDITIONS, ParticipantResult, Replication, people, wearers};
use super::sheets::{figure_7, forces, table_1};
use crate::laboratory::{Outcome, Preregistration, Reach, Row, Share};
use host_core::record::sha256;
use host_core::statistics::{bootstrap_bca, cohens_d_pooled, mann_whitney, mean, wilcoxon};

/// Note in every result that the arms are simulated.
const SIMULATED: &str =
    "Simulated: random arms with mostly assumed parameters; no evidence about people.";
const MEANING: &str = "Ours is the median; low and high are the 5th and 95th percentiles. They \
                       are taken over participants; for numbers of a whole study (three \
                       participants), over studies.";
const FRAME: &str = "Uncalibrated means S1's frame: the muscle lines, gains and lengths that the \
                     calibration finds on participant S1 of the same study. Wearers are the \
                     participants S2 and S3.";
/// Number of bootstrap resamples for an interval.
const RESAMPLES: usize = 4_000;

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Seed of the draws.
    pub seed: u64,
    /// Requested number of studies.
    pub draws: u64,
    /// Command line that repeats the run.
    pub command: String,
    /// Device that played a condition, and the description of the comparison.
    pub played: Option<(String, String)>,
    /// Description of the missing part if the run was interrupted.
    pub cut_short: Option<String>,
    /// Reason for each missing study.
    pub failed: Vec<String>,
}

fn row(id: &str, quantity: &str, unit: &str, paper: Option<f64>, values: Vec<f64>) -> Row {
    Row::from_numbers(id.to_owned(), quantity.to_owned(), unit, paper, values)
}

/// Returns the rows of one condition over all participants.
fn condition_rows(study: &Study, all: &[Replication], name: &str) -> [Row; 5] {
    let of = |pick: &dyn Fn(&Condition) -> f64| -> Vec<f64> {
        let each = people(all).filter_map(|wearer| wearer.condition(name));
        each.map(pick).collect()
    };
    let printed = match name {
        "C2" => Some(study.paper.c2[0]),
        "C3" => Some(study.paper.c3[0]),
        _ => None,
    };
    let diagonal = of(&|condition| condition.measures.diagonal().iter().sum::<f64>() / 3.0);
    let part = of(&|condition| condition.measures.rmse_n[3] / condition.measures.range_n[3]);
    let angle = of(&|condition| median(&condition.measures.angles_deg));
    let named = |id: &str, quantity: &str, unit: &str, paper, values| {
        row(
            &format!("{name}/{id}"),
            &format!("{name}: {quantity}"),
            unit,
            paper,
            values,
        )
    };
    [
        named(
            "diagonal",
            "mean diagonal correlation",
            "",
            printed,
            diagonal,
        ),
        named(
            "median",
            "median error",
            "N",
            None,
            of(&|condition| condition.measures.median_n()),
        ),
        named(
            "rmse",
            "RMSE of the force vector",
            "N",
            None,
            of(&|condition| condition.measures.rmse_n[3]),
        ),
        named("part", "RMSE / largest reference", "", None, part),
        named("angle", "median angle to reference", "°", None, angle),
    ]
}

/// Returns all rows: conditions, best component, geometry, device, and tests.
fn rows(study: &Study, all: &[Replication]) -> Vec<Row> {
    let paper = &study.paper;
    let conditions = CONDITIONS.iter();
    let mut rows: Vec<Row> = conditions
        .flat_map(|name| condition_rows(study, all, name))
        .collect();
    let best = all.iter().map(|replication| {
        let all = ["C2", "C3", "C4"].map(|name| diagonal(replication, name));
        all.into_iter().flatten().fold(f64::NEG_INFINITY, f64::max)
    });
    let name = "best correlation of a study, C2 to C4";
    rows.push(row("best", name, "", Some(paper.best), best.collect()));
    rows.extend(geometry_rows(all));
    rows.extend(device_rows(all));
    rows.extend(tests(study, all));
    rows
}

/// Returns the rows about geometry, switching and fatigue.
fn geometry_rows(all: &[Replication]) -> Vec<Row> {
    let worn =
        |at: usize| -> Vec<f64> { wearers(all).map(|wearer| wearer.geometry()[at]).collect() };
    let of =
        |pick: &dyn Fn(&ParticipantResult) -> f64| -> Vec<f64> { people(all).map(pick).collect() };
    let jumps = |at: usize| of(&|wearer| wearer.switches[at].jumps as f64);
    let step = |at: usize| of(&|wearer| wearer.switches[at].greatest);
    let left = |at: usize| of(&|wearer| wearer.freshness[at]);
    let reversed = of(&|wearer| {
        wearer.geometry_deg[1]
            .iter()
            .filter(|geometry_deg| **geometry_deg > 90.0)
            .count() as f64
    });
    let all = [
        (
            "geometry/before",
            "geometry error, S1's frame",
            "°",
            worn(0),
        ),
        ("geometry/after", "geometry error, calibrated", "°", worn(1)),
        (
            "geometry/rested",
            "geometry error, calibrated at rest",
            "°",
            wearers(all)
                .map(|wearer| median(&wearer.rested_deg))
                .collect(),
        ),
        (
            "geometry/reversed",
            "reversed lines of nine, calibrated",
            "lines",
            reversed,
        ),
        (
            "jumps/near",
            "nearest neighbour: jumps in 1080°",
            "jumps",
            jumps(0),
        ),
        (
            "jumps/squares",
            "least squares: jumps in 1080°",
            "jumps",
            jumps(1),
        ),
        (
            "step/near",
            "nearest neighbour: max step, 1°",
            "of range",
            step(0),
        ),
        (
            "step/squares",
            "least squares: max step, 1°",
            "of range",
            step(1),
        ),
        (
            "left/C2",
            "C2: lowest force left by fatigue",
            "of force",
            left(0),
        ),
        (
            "left/C3",
            "C3: lowest force left by fatigue",
            "of force",
            left(1),
        ),
        (
            "left/C4",
            "C4: lowest force left by fatigue",
            "of force",
            left(2),
        ),
    ];
    let each = all.into_iter();
    each.map(|(id, name, unit, values)| row(id, name, unit, None, values))
        .collect()
}

/// Returns the rows about the device's rate, number format and limits.
fn device_rows(all: &[Replication]) -> Vec<Row> {
    let of =
        |pick: &dyn Fn(&ParticipantResult) -> f64| -> Vec<f64> { people(all).map(pick).collect() };
    let walk = |at: usize| of(&|wearer| wearer.walks[at].part);
    let beyond = |name: &'static str| {
        of(&move |wearer: &ParticipantResult| {
            let targets = wearer
                .condition(name)
                .map_or(&[][..], |condition| &condition.targets);
            let beyond = targets.iter().filter(|target| target.is_beyond).count();
            100.0 * beyond as f64 / targets.len() as f64
        })
    };
    let slower = of(&|wearer| 100.0 * (wearer.walks[1].part / wearer.walks[0].part - 1.0));
    let each = [
        (
            "walk/200",
            "force circle, 200 Hz: RMSE / reference",
            "",
            walk(0),
        ),
        (
            "walk/20",
            "force circle, 20 Hz: RMSE / reference",
            "",
            walk(1),
        ),
        (
            "walk/change",
            "force circle: RMSE at 20 against 200 Hz",
            "%",
            slower,
        ),
        (
            "numbers/share",
            "micromath's share of C3's error",
            "%",
            of(&|wearer| 100.0 * wearer.share_of_numbers()),
        ),
        (
            "beyond/C2",
            "C2: targets above a muscle's limit",
            "%",
            beyond("C2"),
        ),
        (
            "beyond/C3",
            "C3: targets above a muscle's limit",
            "%",
            beyond("C3"),
        ),
        (
            "beyond/C4",
            "C4: targets above a muscle's limit",
            "%",
            beyond("C4"),
        ),
    ];
    let each = each.into_iter();
    each.map(|(id, name, unit, values)| row(id, name, unit, None, values))
        .collect()
}

/// Returns the rows of the paper's tests, each of them computed for each study.
fn tests(study: &Study, all: &[Replication]) -> Vec<Row> {
    let d = |replication: &Replication| {
        cohens_d_pooled(&diagonal(replication, "C3"), &diagonal(replication, "C2"))
            .unwrap_or(f64::NAN)
    };
    let w = |replication: &Replication| {
        let found = wilcoxon(&diagonal(replication, "C2"), &diagonal(replication, "C3"));
        found.map_or(f64::NAN, |wilcoxon| wilcoxon.p)
    };
    let u = |replication: &Replication| {
        let found = mann_whitney(&errors(replication, "C2"), &errors(replication, "C3"));
        found.map_or(f64::NAN, |mann_whitney| mann_whitney.p)
    };
    let of = |pick: &dyn Fn(&Replication) -> f64| all.iter().map(pick).collect();
    vec![
        row(
            "d",
            "Cohen's d of a study, C3 against C2",
            "",
            Some(study.paper.cohens_d),
            of(&d),
        ),
        row(
            "wilcoxon",
            "Wilcoxon p of a study, C2 and C3",
            "",
            None,
            of(&w),
        ),
        row(
            "mann-whitney",
            "Mann-Whitney p of a study, C2 and C3",
            "",
            None,
            of(&u),
        ),
    ]
}

/// Describes the relative change of the median error from C2 to the condition `less`: the median
/// over studies, with a bootstrap interval.
fn interval(study: &Study, all: &[Replication], less: &str) -> Option<String> {
    let each: Vec<f64> = all
        .iter()
        .map(|replication| {
            let wearers = replication.people.iter().skip(1);
            let part = wearers
                .map(|wearer| 100.0 * (median_of(wearer, less) / median_of(wearer, "C2") - 1.0));
            mean(part)
        })
        .collect::<Option<_>>()?;
    let level = study.claims.level;
    let found = bootstrap_bca(&each, median, RESAMPLES, level, 1).ok()?;
    Some(format!(
        "Change of the median error from C2 to {less}, %: {:.1} ({:.0} % interval {:.1} to \
         {:.1}). It is averaged over the wearers of a study; the number is the median over \
         studies.",
        found.value,
        100.0 * level,
        found.low,
        found.high
    ))
}

/// Describes in how many wearers twitches did not turn the limb, and the consequences.
fn who_did_not_twitch(all: &[Replication]) -> Vec<String> {
    let mut notes = Vec::new();
    let of = |pick: &dyn Fn(&ParticipantResult) -> &[usize]| {
        let each: Vec<usize> = wearers(all).map(|wearer| pick(wearer).len()).collect();
        let who = each.iter().filter(|n| **n > 0).count();
        (who, each.iter().sum::<usize>())
    };
    let (who, channels) = of(&|wearer| &wearer.untwitched);
    let (at_rest, few) = of(&|wearer| &wearer.rested_untwitched);
    if who > 0 {
        notes.push(format!(
            "In {who} wearers, the twitches of some channels ({channels} in total) did not turn \
             the joint; these channels kept S1's frame. If each twitch waits until the arm is at \
             rest, this happens in {at_rest} wearers ({few} channels)."
        ));
    }
    for item in all.iter().filter(|replication| replication.in_vain > 0) {
        notes.push(format!(
            "Study {}: the twitches of a channel of S1 did not turn its joint, so another S1 was \
             generated; discarded draws: {}.",
            item.index, item.in_vain
        ));
    }
    notes
}

/// Describes whether the expectation was met, judged by the interval of the share and not by the
/// share alone.
fn expectation_note(study: &Study, lower: &Share) -> Option<String> {
    let (low, high) = lower.low.zip(lower.high)?;
    let verdict = match lower.reaches(study.claims.share)? {
        Reach::Met => "met".to_owned(),
        Reach::Missed => "not met".to_owned(),
        Reach::Undecided => format!("undecided with {} wearers", lower.of),
    };
    Some(format!(
        "Preregistered expectation: calibration (C3) gives a lower median error than S1's frame \
         (C2) in at least {:.0} % of wearers. Result: {verdict} ({} of {}, {}; 95 % interval \
         {:.1} to {:.1} %).",
        100.0 * study.claims.share,
        lower.holds,
        lower.of,
        lower.percent(),
        100.0 * low,
        100.0 * high
    ))
}

/// Assembles the outcome of the study from all replications.
///
/// # Errors
/// Returns E715 if the declaration is invalid.
pub fn outcome(
    study: &Study,
    all: &[Replication],
    told: RunInfo,
) -> Result<Outcome, EndpointError> {
    let mut sheets = vec![
        table_1(study, all),
        figure_7(all),
        figure_8::figure(all),
        figure_8::tests(all),
    ];
    sheets.extend(forces(all));
    let mut notes: Vec<String> = [SIMULATED, MEANING, FRAME].map(str::to_owned).to_vec();
    notes.extend(
        ["C3", "C4", "fresh", "rested"]
            .iter()
            .filter_map(|text| interval(study, all, text)),
    );
    notes.extend(who_did_not_twitch(all));
    let shares = shares(all);
    notes.extend(
        shares
            .first()
            .and_then(|share| expectation_note(study, share)),
    );
    let (device, played) = told.played.unzip();
    notes.extend(played);
    notes.extend(
        told.failed
            .iter()
            .map(|why| format!("Missing result, {why}.")),
    );
    let as_declared = (told.seed, told.draws) == (study.seed, study.replications);
    Ok(Outcome {
        name: "sierotowicz".to_owned(),
        title: study.title.clone(),
        seed: told.seed,
        simulated: Some(true),
        cut_short: told.cut_short,
        declared: Preregistration {
            asked: "sierotowicz".to_owned(),
            command: Some(told.command),
            device,
            sha256: [("study.toml".to_owned(), sha256(DECLARED.as_bytes()))].into(),
            source: study.source.clone(),
            draws: told.draws,
            drawn: None,
            as_declared,
        },
        conditions: Vec::new(),
        rows: rows(study, all),
        shares,
        decides: Vec::new(),
        sheets,
        notes,
    })
}
