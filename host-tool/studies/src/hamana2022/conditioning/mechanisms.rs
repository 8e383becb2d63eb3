//! Which single change of the model agrees with the paper: probability of the printed voltages,
//! probability of the claims of experiment 2, and what further measurements would tell.

use super::information::{WeightedOutcome, mutual_information};
use super::mechanism::Mechanism;
use super::study::{ConditioningStudy, Unit};
use super::weights::{WeightSummary, choose_by_weight};
use crate::hamana2022::participant::Participant;
use crate::hamana2022::replication::{Averages, Replication};
use crate::hamana2022::sessions::percent_text;
use crate::hamana2022::torque_claims::{jointly, torque_verdicts};
use crate::laboratory::{Grid, Sheet};
use hal_sim::random::{unit, word};

/// Fewest forearms with weight of each participant by which a change is judged.
const FEWEST: usize = 16;
/// Number of joint replications of experiment 2.
const REPLICATIONS: u64 = 200;
/// Random stream of the replications.
const REPLICATED: u64 = 0x7134;

/// Probability of a participant's printed voltages: natural logarithm, its standard error, and the
/// number of forearms with weight.
struct Evidence {
    logarithm: f64,
    error: f64,
    forearms: usize,
}

/// Returns the units of a participant under a change of the model.
fn own<'a>(units: &'a [Unit], mechanism: Mechanism, who: &'a Participant) -> Vec<&'a Unit> {
    // The statistic of the mean is judged on the forearms of the model as it stands.
    let simulated = match mechanism {
        Mechanism::MeanOfPoints => Mechanism::Default,
        other => other,
    };
    let own = units.iter();
    own.filter(|unit| unit.mechanism == simulated && unit.judged.participant == who.name)
        .collect()
}

fn weight(unit: &Unit) -> f64 {
    let candidate = unit.judged.candidate(false);
    candidate.map_or(0.0, |candidate| candidate.weight())
}

fn evidence(units: &[&Unit]) -> Evidence {
    let weights: Vec<f64> = units.iter().map(|unit| weight(unit)).collect();
    let count = weights.len().max(1) as f64;
    let mean = weights.iter().sum::<f64>() / count;
    let variance = weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / count;
    Evidence {
        logarithm: mean.ln(),
        error: (variance / count).sqrt() / mean,
        forearms: WeightSummary::of(&weights).positive,
    }
}

/// Chooses a forearm with experiment 2 by weight.
fn choose<'a>(units: &[&'a Unit], part: f64) -> Option<&'a Averages> {
    let simulated = units
        .iter()
        .filter_map(|unit| Some((unit.torque.as_ref()?, weight(unit))));
    let simulated: Vec<(&Averages, f64)> = simulated.collect();
    choose_by_weight(&simulated, part).copied()
}

/// Returns in how many joint replications all claims of experiment 2 hold, and of how many.
fn joint_replications(
    study: &ConditioningStudy,
    units: &[Unit],
    mechanism: Mechanism,
) -> (u64, u64) {
    let groups = study
        .participants
        .iter()
        .map(|who| own(units, mechanism, who));
    let groups: Vec<Vec<&Unit>> = groups.collect();
    let verdict = |number: u64| {
        let stream = word(study.seed ^ REPLICATED, number);
        let chosen = groups
            .iter()
            .zip(0..)
            .map(|(group, nth)| choose(group, unit(stream, nth)));
        let mut averages: Vec<Averages> = chosen.map(|own| own.cloned()).collect::<Option<_>>()?;
        if mechanism == Mechanism::MeanOfPoints {
            averages.iter_mut().for_each(take_mean_of_points);
        }
        let verdicts = torque_verdicts(
            &Replication::from_averages(&averages),
            study.protocol.significant,
        );
        jointly(verdicts.into_iter().map(|(_, verdict)| verdict))
    };
    let verdicts: Vec<bool> = (0..REPLICATIONS).filter_map(verdict).collect();
    let holds = verdicts.iter().filter(|holds| **holds).count();
    (holds as u64, verdicts.len() as u64)
}

/// Replaces the torque of one point, that of the stronger one, by the mean of A and B.
fn take_mean_of_points(averages: &mut Averages) {
    let [ac, ai, bc, bi] = averages.points;
    let mean = |a: Option<f64>, b: Option<f64>| Some(0.5 * (a? + b?));
    averages.one_point = mean(ac, bc).zip(mean(ai, bi)).map(|(c, i)| [c, i]);
}

/// Tabulates evidence and joint probability of every change.
pub(super) fn evidence_table(study: &ConditioningStudy, units: &[Unit]) -> Sheet {
    let of = |mechanism: Mechanism| -> Vec<Evidence> {
        let groups = study
            .participants
            .iter()
            .map(|who| own(units, mechanism, who));
        groups.map(|group| evidence(&group)).collect()
    };
    let reference = of(Mechanism::Default);
    let row = |mechanism: Mechanism| {
        let all = of(mechanism);
        let fewest = all.iter().map(|own| own.forearms).min().unwrap_or_default();
        let evidence = match fewest < FEWEST {
            true => ["undecided".to_owned(), "-".to_owned()],
            false => {
                let sum = |all: &[Evidence]| all.iter().map(|own| own.logarithm).sum::<f64>();
                let error = all.iter().map(|own| own.error.powi(2)).sum::<f64>().sqrt();
                let factor = (sum(&all) - sum(&reference)).exp();
                [format!("{factor:.2e}"), format!("{:.0} %", 100.0 * error)]
            }
        };
        let joint = percent_text(joint_replications(study, units, mechanism));
        let counts: Vec<String> = all.iter().map(|own| own.forearms.to_string()).collect();
        let [factor, error] = evidence;
        vec![
            mechanism.name().to_owned(),
            counts.join(", "),
            factor,
            error,
            joint,
        ]
    };
    let heads = [
        "change",
        "forearms P, Q, R, S",
        "evidence",
        "error",
        "experiment 2, %",
    ];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: Mechanism::ALL.into_iter().map(row).collect(),
    };
    let caption = format!(
        "For each single change of the model: forearms with weight; the probability of all printed \
         voltages, divided by that of the model as it stands, with its relative standard error \
         (undecided with fewer than {FEWEST} forearms of a participant); and the share of joint \
         replications in which all eight claims of experiment 2 hold, which did not enter the \
         evidence, with a 95 % interval. Simulated."
    );
    let title = "single changes of the model";
    Sheet::table("Mechanisms", title, caption, grid)
}

/// Tabulates what each further measurement would tell about the mechanism.
pub(super) fn information_table(study: &ConditioningStudy, units: &[Unit]) -> Sheet {
    let simulated = Mechanism::ALL.into_iter();
    let changes: Vec<Mechanism> = simulated
        .filter(|own| !matches!(own, Mechanism::MeanOfPoints | Mechanism::Earlier))
        .collect();
    let measurements = study.declaration.measurements.iter().enumerate();
    let row = |(place, measurement): (usize, &super::declaration::FurtherMeasurement)| {
        let outcome = |unit: &Unit| {
            let mechanism = changes.iter().position(|own| *own == unit.mechanism)?;
            let value = *unit.measured.as_ref()?.get(place)?;
            let scaled = value.map(|value| match measurement.logarithm {
                true => value.ln(),
                false => value,
            });
            Some(WeightedOutcome {
                mechanism,
                value: scaled.filter(|value| value.is_finite()),
                weight: unit.judged.candidate(false)?.probability,
            })
        };
        let outcomes: Vec<WeightedOutcome> = units.iter().filter_map(outcome).collect();
        let noise = (measurement.noise, word(study.seed, place as u64));
        let information = mutual_information(&outcomes, changes.len(), noise);
        let cells = information.map_or_else(
            || ["-".to_owned(), "-".to_owned()],
            |own| {
                let interval = format!("{:.2} to {:.2}", own.low, own.high);
                [format!("{:.2}", own.bits), interval]
            },
        );
        let [bits, interval] = cells;
        vec![
            measurement.says.clone(),
            format!("{}", measurement.noise),
            bits,
            interval,
        ]
    };
    let heads = ["measurement", "noise", "bits", "95 %"];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: measurements.map(row).collect(),
    };
    let count = changes.len();
    let caption = format!(
        "Mutual information between the mechanism ({count}, equally likely beforehand: at most \
         {:.2} bits) and the outcome of one further measurement on a volunteer with voltages of \
         table 7, in nine bins, less the mean over permuted mechanisms; bootstrap over forearms. \
         Simulated.",
        (count as f64).log2()
    );
    let title = "what a further measurement would tell";
    Sheet::table("Design", title, caption, grid)
}
