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
use hal_sim::random::{Random, unit, word};
use host_core::statistics::quantile;
use std::collections::BTreeMap;

/// Fewest forearms with weight of each participant by which a change is judged.
const FEWEST: usize = 16;
/// Number of joint replications of experiment 2.
const REPLICATIONS: u64 = 200;
/// Number of bootstrap samples of the evidence.
const SAMPLES: u64 = 1_000;
/// Random stream of the bootstrap.
const RESAMPLED: u64 = 0x7138;
/// Random stream of the replications.
const REPLICATED: u64 = 0x7134;

/// Numbers of forearms with weight and of effective ones.
struct Sizes {
    positive: usize,
    effective: f64,
}

/// Natural logarithm of the evidence of a change over that of the model as it stands, with a 95 %
/// interval (bootstrap over forearms, which are the same under both).
struct EvidenceRatio {
    logarithm: f64,
    low: f64,
    high: f64,
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

fn weights(units: &[&Unit]) -> Vec<f64> {
    units.iter().map(|unit| weight(unit)).collect()
}

/// Returns the ratio of the evidences of two models. Each pair has the weights of one participant's
/// forearms under the change and under the model as it stands, in the same order. `None` if one has no
/// weight.
fn evidence_ratio(pairs: &[[Vec<f64>; 2]], seed: u64) -> Option<EvidenceRatio> {
    let logarithm = |chosen: &[Vec<usize>]| -> Option<f64> {
        let of_pair = |([changed, default], chosen): (&[Vec<f64>; 2], &Vec<usize>)| {
            let sum = |weights: &[f64]| -> f64 { chosen.iter().map(|&at| weights[at]).sum() };
            let logarithm = libm::log(sum(changed) / sum(default));
            logarithm.is_finite().then_some(logarithm)
        };
        pairs.iter().zip(chosen).map(of_pair).sum()
    };
    let count = |[changed, default]: &[Vec<f64>; 2]| changed.len().min(default.len());
    let all: Vec<Vec<usize>> = pairs
        .iter()
        .map(|pair| (0..count(pair)).collect())
        .collect();
    let mut resampled = Vec::new();
    for sample in 0..SAMPLES {
        let mut random = Random::new(word(seed, sample));
        let chosen: Vec<Vec<usize>> = all
            .iter()
            .map(|own| {
                own.iter()
                    .map(|_| random.below(own.len() as u64) as usize)
                    .collect()
            })
            .collect();
        resampled.extend(logarithm(&chosen));
    }
    Some(EvidenceRatio {
        logarithm: logarithm(&all)?,
        low: quantile(&resampled, 0.025)?,
        high: quantile(&resampled, 0.975)?,
    })
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
    let of = |mechanism: Mechanism| -> Vec<Vec<f64>> {
        let participants = study.participants.iter();
        participants
            .map(|who| weights(&own(units, mechanism, who)))
            .collect()
    };
    let sizes = |weights: &Vec<f64>| {
        let summary = WeightSummary::of(weights);
        Sizes {
            positive: summary.positive,
            effective: summary.effective,
        }
    };
    let reference = of(Mechanism::Default);
    let row = |mechanism: Mechanism| {
        let all = of(mechanism);
        let own: Vec<Sizes> = all.iter().map(sizes).collect();
        let both = own.iter().map(|own| own.positive);
        let both = both.chain(reference.iter().map(|own| sizes(own).positive));
        let is_decided = both.min().unwrap_or_default() >= FEWEST;
        let pairs: Vec<[Vec<f64>; 2]> = all
            .into_iter()
            .zip(&reference)
            .map(|(own, default)| [own, default.clone()])
            .collect();
        let seed = study.seed ^ RESAMPLED;
        let ratio = evidence_ratio(&pairs, seed).filter(|_| is_decided);
        let evidence = ratio.map_or_else(
            || ["undecided".to_owned(), "-".to_owned()],
            |EvidenceRatio {
                 logarithm,
                 low,
                 high,
             }| {
                let [low, high] = [low, high].map(|value| format!("{:.1e}", libm::exp(value)));
                [
                    format!("{:.1e}", libm::exp(logarithm)),
                    format!("{low} to {high}"),
                ]
            },
        );
        let effective = own.iter().map(|own| own.effective);
        let effective = effective.fold(f64::INFINITY, f64::min);
        let joint = percent_text(joint_replications(study, units, mechanism), effective);
        let counts = own
            .iter()
            .map(|own| format!("{} ({:.0})", own.positive, own.effective));
        let counts: Vec<String> = counts.collect();
        let [factor, interval] = evidence;
        vec![
            mechanism.name().to_owned(),
            counts.join(", "),
            factor,
            interval,
            joint,
        ]
    };
    let heads = [
        "change",
        "forearms P, Q, R, S",
        "evidence",
        "95 %",
        "experiment 2, %",
    ];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: Mechanism::ALL.into_iter().map(row).collect(),
    };
    let caption = format!(
        "For each single change of the model: forearms with weight, and in brackets how many \
         effective ones; the probability of all printed greatest voltages, given the thresholds, \
         divided by that of the model as it stands, with a 95 % interval (bootstrap over forearms, \
         which are the same under both; undecided with fewer than {FEWEST} forearms with weight of a \
         participant); and the share of joint replications in which all eight claims of experiment 2 \
         hold, which did not enter the evidence, with a 95 % interval of as many replications as \
         there are effective forearms of a participant. Simulated."
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
    // Only a participant with table 7 stands for a volunteer with its voltages.
    let volunteers = study.participants.iter();
    let volunteers: Vec<&str> = volunteers
        .filter(|own| own.thresholds_v.is_some())
        .map(|own| &*own.name)
        .collect();
    let group = |unit: &Unit| {
        let mechanism = changes.iter().position(|own| *own == unit.mechanism)?;
        let who = volunteers
            .iter()
            .position(|own| *own == unit.judged.participant)?;
        let probability = unit.judged.posterior?.probability;
        unit.measured.as_ref()?;
        Some(((mechanism, who), probability))
    };
    let mut totals: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for (of, probability) in units.iter().filter_map(group) {
        *totals.entry(of).or_default() += probability;
    }
    let measurements = study.declaration.measurements.iter().enumerate();
    let row = |(place, measurement): (usize, &super::declaration::FurtherMeasurement)| {
        let outcome = |unit: &Unit| {
            let ((mechanism, who), probability) = group(unit)?;
            let value = *unit.measured.as_ref()?.get(place)?;
            let scaled = value.map(|value| match measurement.logarithm {
                true => libm::log(value),
                false => value,
            });
            Some(WeightedOutcome {
                mechanism,
                forearm: who + volunteers.len() * unit.judged.index as usize,
                value: scaled.filter(|value| value.is_finite()),
                weight: probability / totals.get(&(mechanism, who))?,
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
         table 7 (P, Q and S count alike), in nine bins, less the mean over mechanisms permuted \
         within each forearm; bootstrap over forearms. Simulated.",
        libm::log2(count as f64)
    );
    let title = "what a further measurement would tell";
    Sheet::table("Design", title, caption, grid)
}
