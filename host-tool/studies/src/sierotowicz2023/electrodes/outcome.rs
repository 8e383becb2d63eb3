//! Summarises all wearers for `result.json` and the report page.

use super::declaration::{DECLARED, Study};
use super::sets::{METHODS, MissedForce, SETS, best};
use super::wearer::{DIRECTION_NAMES, MUSCLES, NAMES};
use crate::laboratory::{Grid, Matrix, Outcome, Preregistration, Row, Share, Sheet};
use crate::sierotowicz2023::median;
use host_core::record::sha256;
use host_core::statistics::mean;

/// Name of the study on the command line.
pub const NAME: &str = "electrode-choice";
/// Set of all ten electrodes.
const ALL: usize = SETS - 1;
const SIMULATED: &str =
    "Simulated: random arms with mostly assumed parameters; no evidence about people.";
const MEANING: &str = "Ours is the median; low and high are the 5th and 95th percentiles over \
                       wearers.";
const LINEAR: &str = "The force at the cuff is proportional to the activation, 0 to 1, of each \
                      electrode; crosstalk, fatigue and noise are left out. The miss is the part \
                      of a reference force that a set of electrodes cannot make. `squares` is \
                      least squares with the moment arms of the simulated arm itself. `nearest` \
                      is the device's algorithm 1 (nearest neighbour), which has rough anatomical \
                      lines and the true strengths.";

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Seed of the draws.
    pub seed: u64,
    /// Requested number of wearers.
    pub draws: u64,
    /// Description of the missing part if the run was interrupted.
    pub cut_short: Option<String>,
}

/// A wearer, and the wearer of the preceding draw, on whose arm a set of electrodes is chosen.
type Pair<'a> = (&'a MissedForce, &'a MissedForce);

fn pairs(all: &[MissedForce]) -> Vec<Pair<'_>> {
    let before = all.iter().cycle().skip(all.len().saturating_sub(1));
    all.iter().zip(before).collect()
}

fn percent(part: f32) -> f64 {
    100.0 * f64::from(part)
}

/// Returns for each reference force the error of the best set of `count` electrodes, %.
fn missed_by_best(miss: &MissedForce, method: usize, count: u32) -> Vec<f64> {
    let each = miss.0[method].iter();
    each.map(|parts| percent(parts[best(parts, count)]))
        .collect()
}

/// Returns the mean error of the set of `count` electrodes that is best over all forces, %.
fn missed_by_one_set(miss: &MissedForce, method: usize, count: u32) -> f64 {
    let all = miss.mean_by_set(method);
    percent(all[best(&all, count)])
}

fn share_of(all: &[f64], most: f64) -> f64 {
    100.0 * all.iter().filter(|value| **value <= most).count() as f64 / all.len().max(1) as f64
}

/// Returns the percentage of reference forces for which a set of `count` electrodes is good enough
/// on the wearer's own arm, although it was chosen as the best one on the other arm.
fn good_enough(study: &Study, (own, other): Pair<'_>, method: usize, count: u32) -> f64 {
    let both = own.0[method].iter().zip(&other.0[method]);
    let more: Vec<f64> = both
        .map(|(own, other)| percent(own[best(other, count)] - own[best(own, count)]))
        .collect();
    share_of(&more, 100.0 * study.judged.within)
}

/// Returns the rows about sets of `count` electrodes under one method.
fn rows_of(study: &Study, all: &[MissedForce], method: usize, count: u32) -> [Row; 5] {
    let name = METHODS[method];
    let of = |pick: &dyn Fn(Pair<'_>) -> f64| pairs(all).into_iter().map(pick).collect();
    let row = |id: &str, what: &str, values: Vec<f64>| {
        let id = format!("{name}/{count}/{id}");
        Row::from_numbers(id, format!("{name}, {count}: {what}"), "%", None, values)
    };
    let made = 100.0 * study.judged.made;
    [
        row(
            "missed",
            "median miss of best set",
            of(&|(miss, _)| median(&missed_by_best(miss, method, count))),
        ),
        row(
            "made",
            "achieved forces",
            of(&|(miss, _)| share_of(&missed_by_best(miss, method, count), made)),
        ),
        row(
            "one-set",
            "mean miss of one set",
            of(&|(miss, _)| missed_by_one_set(miss, method, count)),
        ),
        row(
            "another",
            "another's choice suffices",
            of(&|pair| good_enough(study, pair, method, count)),
        ),
        row(
            "another-set",
            "extra miss, another's set",
            of(&|(own, other)| {
                let (own, other) = (own.mean_by_set(method), other.mean_by_set(method));
                percent(own[best(&other, count)] - own[best(&own, count)])
            }),
        ),
    ]
}

/// Returns for each reference force the increase of the error if one of the ten electrodes is left
/// out, %.
fn cost(miss: &MissedForce, method: usize, electrode: usize) -> Vec<f64> {
    let each = miss.0[method].iter();
    each.map(|parts| percent(parts[ALL ^ (1 << electrode)] - parts[ALL]))
        .collect()
}

/// Returns for each electrode a row with the mean increase of the error if it is left out.
fn electrode_rows(all: &[MissedForce], method: usize) -> Vec<Row> {
    let name = METHODS[method];
    let costs: Vec<Vec<f64>> = (0..MUSCLES.len())
        .map(|at| {
            all.iter()
                .filter_map(|miss| mean(cost(miss, method, at)))
                .collect()
        })
        .collect();
    let rows = NAMES.iter().zip(costs).map(|(muscle, values)| {
        let what = format!("{name}, no {muscle}: extra miss");
        Row::from_numbers(format!("{name}/without/{muscle}"), what, "%", None, values)
    });
    rows.collect()
}

/// Counts over wearers how often each expectation or claim holds.
fn shares(study: &Study, all: &[MissedForce]) -> Vec<Share> {
    let count = |id: String, claim: String, cases: Vec<bool>| {
        let holds = cases.iter().filter(|case| **case).count() as u64;
        Share::from_counts(id, claim, None, (holds, cases.len() as u64))
    };
    let (made, within) = (100.0 * study.judged.made, 100.0 * study.judged.within);
    let mut shares = vec![count(
        "four-of-ten".to_owned(),
        format!(
            "squares: 4 electrodes achieve {:.0} % of what 10 do",
            100.0 * study.expected.four_of_ten
        ),
        all.iter()
            .map(|wearer| {
                let [four, ten] =
                    [4, 10].map(|count| share_of(&missed_by_best(wearer, 0, count), made));
                four >= study.expected.four_of_ten * ten
            })
            .collect(),
    )];
    for (method, name) in METHODS.iter().enumerate() {
        for electrodes in 1..10 {
            let good = pairs(all).into_iter().map(|(own, other)| {
                let (own, other) = (own.mean_by_set(method), other.mean_by_set(method));
                let more = own[best(&other, electrodes)] - own[best(&own, electrodes)];
                percent(more) <= within
            });
            shares.push(count(
                format!("{name}/{electrodes}"),
                format!("{name}: another's set of {electrodes} is good enough"),
                good.collect(),
            ));
        }
    }
    shares
}

/// Tabulates electrodes by directions for the largest reference force; each cell is a mean over
/// wearers.
fn matrix(
    all: &[MissedForce],
    (title, unit): (&str, &str),
    caption: String,
    cell: &dyn Fn(&MissedForce, usize, usize) -> f64,
) -> Sheet {
    let forces = all.first().map_or(0, |miss| miss.0[0].len());
    let first = forces.saturating_sub(DIRECTION_NAMES.len());
    let line = |electrode: usize| {
        let cells = (first..forces).map(|force| {
            let each: Vec<f64> = all
                .iter()
                .map(|miss| cell(miss, electrode, force))
                .collect();
            (10.0 * mean(&each).unwrap_or(f64::NAN)).round() / 10.0
        });
        (NAMES[electrode].to_owned(), cells.collect())
    };
    let matrix = Matrix {
        unit: unit.to_owned(),
        heads: DIRECTION_NAMES.map(str::to_owned).to_vec(),
        rows: (0..MUSCLES.len()).map(line).collect(),
    };
    Sheet::matrix("Electrodes", title, caption, matrix)
}

fn matrices(study: &Study, all: &[MissedForce]) -> Vec<Sheet> {
    let largest = study.wanted.sizes_n.last().copied().unwrap_or_default();
    let told = |what: &str| {
        format!(
            "Simulated, reference force of {largest} N: {what} Directions: f forward, b backward, \
             l left, r right, u up, d down."
        )
    };
    let shown = study.judged.shown;
    let mut sheets = Vec::new();
    for (method, name) in METHODS.iter().enumerate() {
        let member = |miss: &MissedForce, electrode: usize, force: usize| {
            100.0 * f64::from(best(&miss.0[method][force], shown) >> electrode & 1 == 1)
        };
        let cost = |miss: &MissedForce, electrode: usize, force: usize| {
            let parts = &miss.0[method][force];
            percent(parts[ALL ^ (1 << electrode)] - parts[ALL])
        };
        let lost = told("increase of the miss if the electrode is left out, mean over wearers.");
        let (title, unit) = (
            format!("{name}: extra miss without the electrode"),
            "% of the force",
        );
        sheets.push(matrix(all, (&title, unit), lost, &cost));
        let who = told(&format!(
            "percentage of wearers for whom the electrode is among the best {shown} for the force."
        ));
        let (title, unit) = (format!("{name}: among the best {shown}"), "% of wearers");
        sheets.push(matrix(all, (&title, unit), who, &member));
    }
    sheets
}

/// Tabulates the medians for every number of electrodes.
fn table(rows: &[Row]) -> Sheet {
    let ids = ["missed", "made", "one-set", "another", "another-set"];
    let line = |(name, count): (&str, u32)| {
        let mut cells = vec![format!("{name}, {count}")];
        cells.extend(ids.map(|id| {
            let row = rows
                .iter()
                .find(|row| row.id == format!("{name}/{count}/{id}"));
            let ours = row.and_then(|row| row.ours);
            ours.map_or_else(String::new, |value| format!("{value:.1}"))
        }));
        cells
    };
    let names = METHODS.iter();
    let lines = names.flat_map(|name| (1..=10).map(move |count| (*name, count)));
    let heads = ["", "miss", "achieved", "one set", "another's", "extra"];
    let caption = "Medians over wearers, %, by method and number of electrodes; simulated. miss: \
                   the part of a reference force that the best set for this force cannot make. \
                   achieved: reference forces that the best set makes with a small miss. one set: \
                   mean miss of the one set that is best over all forces. another's: forces for \
                   which the set chosen on another wearer is good enough. extra: increase of the \
                   miss with another wearer's one set.";
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: lines.map(line).collect(),
    };
    Sheet::table(
        "Electrodes",
        "number of electrodes",
        caption.to_owned(),
        grid,
    )
}

/// Assembles the outcome of the study from the errors of `all` wearers.
#[must_use]
pub fn outcome(study: &Study, all: &[MissedForce], told: RunInfo) -> Outcome {
    let methods = 0..METHODS.len();
    let mut rows: Vec<Row> = methods
        .clone()
        .flat_map(|method| (1..=10).flat_map(move |count| rows_of(study, all, method, count)))
        .collect();
    rows.extend(methods.flat_map(|method| electrode_rows(all, method)));
    let mut sheets = vec![table(&rows)];
    sheets.extend(matrices(study, all));
    Outcome {
        name: NAME.to_owned(),
        title: study.title.clone(),
        seed: told.seed,
        simulated: Some(true),
        cut_short: told.cut_short,
        declared: Preregistration {
            asked: NAME.to_owned(),
            command: Some(format!("experiment {NAME} --draws {}", told.draws)),
            device: None,
            sha256: [("electrodes.toml".to_owned(), sha256(DECLARED.as_bytes()))].into(),
            source: study.source.clone(),
            draws: told.draws,
            drawn: None,
            as_declared: (told.seed, told.draws) == (study.seed, study.draws),
        },
        conditions: Vec::new(),
        rows,
        shares: shares(study, all),
        decides: Vec::new(),
        sheets,
        notes: [SIMULATED, MEANING, LINEAR].map(str::to_owned).to_vec(),
    }
}
