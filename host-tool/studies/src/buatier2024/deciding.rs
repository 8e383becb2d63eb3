//! Determines which assumptions decide a claim by changing each of them alone.

use super::comparisons::holds;
use super::declaration::{Form, Scale, Study};
use super::error::LiftError;
use super::participant::{Participant, participant};
use super::person::{LiftWearer, nominal_values};
use crate::laboratory::{Grid, Sheet};
use hal_sim::random;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Random stream of the nominal participants.
const STREAM: u64 = 0xDEC1;

/// One changed assumption, and its effect on every claim.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ChangeEffect {
    /// Description of the change.
    pub named: String,
    /// Number of participants in whom each claim holds, in the declaration's order.
    pub holds: Vec<usize>,
    /// Number of simulated participants.
    pub of: usize,
}

/// Results of the sensitivity analysis, in which one assumption at a time is changed.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sensitivity {
    /// Result with no assumption changed.
    pub middle: ChangeEffect,
    /// Results with one parameter at the low and at the high end of its range, in the order of the
    /// ranges.
    pub ends: Vec<[ChangeEffect; 2]>,
    /// Results with each ablation of the model.
    pub models: Vec<ChangeEffect>,
}

/// Returns the ablations of the device's activation model, by name.
fn models(study: &Study) -> Vec<(&'static str, Study)> {
    let with = |change: &dyn Fn(&mut Study)| {
        let mut other = study.clone();
        change(&mut other);
        other
    };
    vec![
        (
            "C = k (not scaled to its peak)",
            with(&|spec| spec.model.scale = Scale::Raw),
        ),
        (
            "I = C·I₀ (not from the threshold)",
            with(&|spec| spec.model.form = Form::Scaled),
        ),
        (
            "C = k and I = C·I₀ (equation 4)",
            with(&|spec| (spec.model.scale, spec.model.form) = (Scale::Raw, Form::Scaled)),
        ),
        (
            "model without co-contraction",
            with(&|spec| spec.model.co_contraction = 0.0),
        ),
    ]
}

/// Evaluates every claim with each assumption changed alone. `is_asked` is called before each
/// change and returns whether to end.
///
/// # Errors
/// Fails as [`participant`] does, or if asked to end.
pub fn compute_sensitivity(
    study: &Study,
    seed: u64,
    is_asked: &(dyn Fn() -> bool + Sync),
) -> Result<Sensitivity, LiftError> {
    let nominal = nominal_values(study);
    let mut cases = vec![("no change".to_owned(), study.clone(), nominal.clone())];
    for (place, range) in study.ranges.iter().enumerate() {
        for end in [0.0, 1.0] {
            let mut values = nominal.clone();
            values[place] = range.at(end);
            let named = format!("{} {}", range.field, short(values[place]));
            cases.push((named, study.clone(), values));
        }
    }
    let others = models(study).into_iter();
    cases.extend(others.map(|(name, other)| (name.to_owned(), other, nominal.clone())));
    let effect = |(named, study, values): &(String, Study, Vec<f64>)| {
        if is_asked() {
            return Err(LiftError::Asked);
        }
        evaluate_change(study, (named, values), seed)
    };
    let results: Result<Vec<ChangeEffect>, LiftError> = cases.par_iter().map(effect).collect();
    let mut effects = results?.into_iter();
    let nothing = || LiftError::Declaration("there is no assumption to change".to_owned());
    let middle = effects.next().ok_or_else(nothing)?;
    let mut ends = Vec::new();
    for _ in &study.ranges {
        let (low, high) = (
            effects.next().ok_or_else(nothing)?,
            effects.next().ok_or_else(nothing)?,
        );
        ends.push([low, high]);
    }
    Ok(Sensitivity {
        middle,
        ends,
        models: effects.collect(),
    })
}

fn evaluate_change(
    study: &Study,
    (named, values): (&str, &[f64]),
    seed: u64,
) -> Result<ChangeEffect, LiftError> {
    let simulated_person = |nth: usize| -> Result<Participant, LiftError> {
        let own = random::word(random::word(seed, STREAM), nth as u64);
        let mut person = LiftWearer::new(study, values.to_vec(), own)?;
        person.one_day = true;
        participant(study, &person, study.deciding.target_sets)
    };
    let people = (0..study.deciding.persons).map(simulated_person);
    let people = people.collect::<Result<Vec<_>, LiftError>>()?;
    let count = |claim| {
        let is_confirmed =
            |participant: &&Participant| holds(study, participant, claim) == Some(true);
        people.iter().filter(is_confirmed).count()
    };
    Ok(ChangeEffect {
        named: named.to_owned(),
        holds: study.claims.iter().map(count).collect(),
        of: people.len(),
    })
}

fn short(value: f64) -> String {
    let digits = if value.abs() < 1.0 { 3 } else { 1 };
    format!("{value:.digits$}")
}

impl ChangeEffect {
    /// Returns whether claim `at` holds in all participants, in none, or in some.
    fn verdict(&self, at: usize) -> &'static str {
        match self.holds.get(at) {
            Some(0) => "no",
            Some(count) if *count == self.of => "yes",
            _ => "some",
        }
    }
}

impl Sensitivity {
    /// Returns the names of the assumptions that decide claim `at`: ranges with which it holds in
    /// all participants at one end and in none at the other, and ablations that reverse it.
    #[must_use]
    pub fn deciding_factors(&self, at: usize) -> Vec<&str> {
        let opposite = |a: &str, b: &str| matches!((a, b), ("yes", "no") | ("no", "yes"));
        let ends = self
            .ends
            .iter()
            .filter(|[low, high]| opposite(low.verdict(at), high.verdict(at)));
        let ends = ends.filter_map(|[low, _]| low.named.split(' ').next());
        let models = self.models.iter();
        let models = models.filter(|change| opposite(change.verdict(at), self.middle.verdict(at)));
        ends.chain(models.map(|change| &*change.named)).collect()
    }

    /// Returns a table with a row for each change and a column for each claim.
    pub(super) fn sheet(&self, study: &Study) -> Sheet {
        let mut heads = vec!["changed assumption".to_owned()];
        heads.extend(study.claims.iter().map(|claim| claim.id.clone()));
        let row = |change: &ChangeEffect| {
            let cells = (0..study.claims.len()).map(|at| change.verdict(at).to_owned());
            std::iter::once(change.named.clone()).chain(cells).collect()
        };
        let changes = std::iter::once(&self.middle).chain(self.ends.iter().flatten());
        let rows = changes.chain(&self.models).map(row).collect();
        let caption = "Wearers with the middle value of every range, who believe targets at the \
                       same positions in all conditions and differ in noise only. Each row \
                       changes one assumption: a range to one of its ends, or the model. Yes, no \
                       or some: the claim holds in all, none or some of these wearers.";
        let title = "which assumption decides a claim";
        Sheet::table("Ours", title, caption.to_owned(), Grid { heads, rows })
    }

    /// Returns a note for each claim that names the assumptions that decide it.
    pub(super) fn notes(&self, study: &Study) -> Vec<String> {
        let claims = study.claims.iter().enumerate();
        let note = |(at, claim): (usize, &super::declaration::Claim)| {
            let decides = self.deciding_factors(at);
            let middle = self.middle.verdict(at);
            match decides.is_empty() {
                true => format!(
                    "{}: {middle} with middle values; no single assumption reverses it.",
                    claim.says
                ),
                false => format!(
                    "{}: {middle} with middle values; decided by {}.",
                    claim.says,
                    decides.join(", ")
                ),
            }
        };
        claims.map(note).collect()
    }
}
