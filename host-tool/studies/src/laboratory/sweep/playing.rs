//! Adapts an experiment to a sweep: a unit is a wearer with a row for each condition.

use super::Sweep;
use super::drawing::Drawing;
use crate::laboratory::conduct::ConductedTrial;
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::experiment::{Experiment, TrialMeasures};
use crate::laboratory::open_loop::{Score, is_checked};
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;

/// An experiment as the drawing of a sweep, with the recorded output of its device if it has no
/// feedback, and with earlier trials for its page.
pub(super) struct Playing<'a> {
    pub(super) experiment: &'a Experiment,
    pub(super) score: Option<&'a Score>,
    pub(super) trials: &'a [ConductedTrial],
}

impl<'a> Playing<'a> {
    /// Creates the drawing without recorded output and trials, which do not affect the identity of
    /// the sweep.
    pub(super) const fn new(experiment: &'a Experiment) -> Self {
        Self {
            experiment,
            score: None,
            trials: &[],
        }
    }
}

impl Drawing for Playing<'_> {
    type Unit = Vec<TrialMeasures>;
    type Error = LaboratoryError;

    fn name(&self) -> &str {
        &self.experiment.declaration.name
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        self.experiment.hashes.iter().cloned().collect()
    }

    fn declaration(&self) -> &str {
        &self.experiment.text
    }

    fn columns(&self) -> Vec<String> {
        let unit = self.experiment.unit(0, 1, 0);
        let fields = unit.fields.iter().map(|(field, _)| field.clone());
        let measures = self
            .experiment
            .measures()
            .map(|measure| measure.id.to_owned());
        let mut names = vec!["unit".to_owned(), "wearer".to_owned()];
        names.extend(fields);
        names.push("condition".to_owned());
        names.extend(measures);
        names
    }

    fn units(&self, draws: u64) -> u64 {
        self.experiment.units(draws)
    }

    fn rows_per_unit(&self) -> usize {
        self.experiment.conditions.len()
    }

    fn row_prefixes(&self, sweep: &Sweep, unit: u64) -> Vec<String> {
        let unit = self.experiment.unit(sweep.seed, sweep.draws, unit);
        let fields = unit.fields.iter().map(|(_, value)| format!(",{value}"));
        let fields: String = fields.collect();
        let prefix =
            |condition: String| format!("{},{}{fields},{condition}", unit.index, unit.wearer);
        let names = self.experiment.conditions.iter();
        names
            .map(|condition| prefix(quote_csv(&condition.name())))
            .collect()
    }

    fn compute(
        &self,
        sweep: &Sweep,
        unit: u64,
        _: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Self::Unit>, Self::Error> {
        let position = sweep.shard.position(unit);
        let unit = self.experiment.unit(sweep.seed, sweep.draws, unit);
        let performed = match self.score {
            Some(score) => score.measure_unit(self.experiment, &unit, is_checked(position)),
            None => self.experiment.measure_unit(&unit),
        };
        performed.map(Some)
    }

    fn row_suffixes(&self, unit: &Self::Unit) -> Vec<String> {
        let number =
            |number: &Option<f64>| number.map_or_else(String::new, |value| value.to_string());
        let row =
            |measured: &TrialMeasures| measured.iter().map(number).collect::<Vec<_>>().join(",");
        unit.iter().map(row).collect()
    }

    fn parse_unit(&self, rest: &[&str]) -> Result<Self::Unit, (usize, String)> {
        let measures = self.experiment.measures().count();
        let row = |(row, rest): (usize, &&str)| {
            let fields: Vec<&str> = rest.split(',').collect();
            if fields.len() != measures {
                return Err((
                    row,
                    "the row does not have one number for each measure".to_owned(),
                ));
            }
            let numbers = fields.iter().map(|field| parse_number(field));
            let numbers: Result<TrialMeasures, String> = numbers.collect();
            numbers.map_err(|reason| (row, reason))
        };
        rest.iter().enumerate().map(row).collect()
    }

    fn outcome(
        &self,
        sweep: &Sweep,
        units: &BTreeMap<u64, Self::Unit>,
    ) -> Result<Outcome, Self::Error> {
        let decided = (sweep.seed, sweep.draws);
        Ok(
            Outcome::from_units(self.experiment, decided, units, Some(true))
                .with_trials(self.trials),
        )
    }

    fn trials(&self) -> &[ConductedTrial] {
        self.trials
    }
}

/// Quotes a name so that it can be a field of a CSV file.
fn quote_csv(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// Parses a field of `draws.csv` as a number; an empty field is `None`.
///
/// # Errors
/// Returns a message if the field is no finite number.
pub fn parse_number(field: &str) -> Result<Option<f64>, String> {
    match (field, field.parse::<f64>()) {
        ("", _) => Ok(None),
        (_, Ok(number)) if number.is_finite() => Ok(Some(number)),
        _ => Err(format!("`{field}` is not a finite number")),
    }
}
