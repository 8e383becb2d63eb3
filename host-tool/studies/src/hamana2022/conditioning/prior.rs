//! Prior of a simulated participant: what is drawn for its forearm, and what for each session.

use super::data::Table;
use super::declaration::Declaration;
use super::forearm::Forearm;
use super::mechanism::Mechanism;
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::participant::{Participant, seed_of};
use crate::hamana2022::population::Population;
use crate::laboratory::Range;
use hal_sim::body::hand::{HandSpec, SkinSpec};
use hal_sim::random::word;

/// Random stream of a forearm for the ranges of the declaration.
const PERSON: u64 = 0x7131;

/// Prior of one participant at one seed.
#[derive(Clone, Copy)]
pub struct Prior<'a> {
    pub declaration: &'a Declaration,
    pub population: &'a Population,
    pub participant: &'a Participant,
    pub mechanism: Mechanism,
    pub seed: u64,
}

/// Values that are drawn for a session.
#[derive(Clone, Debug)]
pub struct SessionDraw {
    /// Parameters of the hand with the session's skin.
    pub spec: HandSpec,
    /// Random stream of the session.
    pub stream: u64,
}

impl Prior<'_> {
    /// Returns the seed of this participant's draws.
    pub fn own_seed(&self) -> u64 {
        seed_of(&self.participant.name, self.seed)
    }

    /// Returns the values of the declaration's ranges for forearm `index`.
    pub fn person_values(&self, index: u64) -> Vec<f64> {
        Range::draw_values(&self.declaration.person, self.own_seed() ^ PERSON, index)
    }

    /// Returns the names of all drawn parameters, in the order of [`Self::values`]: those of the
    /// forearm, then those of a session.
    pub fn fields(&self) -> impl Iterator<Item = &str> {
        let person = self
            .population
            .ranges
            .iter()
            .filter(|range| is_of_forearm(range));
        let person = person.chain(&self.declaration.person);
        person
            .chain(self.session_ranges())
            .map(|range| &*range.field)
    }

    /// Returns the values of all drawn parameters of forearm `index` in session `number` of `table`.
    pub fn values(&self, index: u64, table: Table, number: u64) -> Vec<f64> {
        let drawn = self.population.draw_values(self.own_seed(), index);
        let own = drawn.into_iter().zip(&self.population.ranges);
        let own = own
            .filter(|(_, range)| is_of_forearm(range))
            .map(|(value, _)| value);
        own.chain(self.person_values(index))
            .chain(self.session_values(index, table, number))
            .collect()
    }

    /// Creates forearm `index` with all places for electrodes, which takes some 40 ms.
    ///
    /// # Errors
    /// Fails if a range is missing.
    pub fn forearm(&self, index: u64) -> Result<Forearm, TwoPointsError> {
        let drawn = self.person_values(index);
        let tried = match self.person_value(&drawn, "first_found")? > 0.5 {
            _ if self.mechanism == Mechanism::Earlier => Some(1.0),
            true => None,
            false => Some(self.declaration.tried),
        };
        Forearm::new(self.forearm_spec(index)?, tried)
    }

    /// Returns the parameters of forearm `index`.
    ///
    /// # Errors
    /// Fails if a range is missing.
    pub fn forearm_spec(&self, index: u64) -> Result<HandSpec, TwoPointsError> {
        let person = self.population.draw_person(self.own_seed(), index)?;
        let drawn = self.person_values(index);
        let spec = HandSpec {
            around_m: self.participant.around_m,
            scatter: self.person_value(&drawn, "scatter")?,
            limiter_a: 1e-3 * self.person_value(&drawn, "limiter_ma")?,
            ..person.spec.with_reach(self.participant.reach_m)
        };
        Ok(self.mechanism.changed(spec))
    }

    /// Draws session `number` of `table` on the forearm with these parameters.
    ///
    /// # Errors
    /// Fails if a range is missing.
    pub fn session(
        &self,
        forearm: &HandSpec,
        (index, table, number): (u64, Table, u64),
    ) -> Result<SessionDraw, TwoPointsError> {
        let drawn = self.session_values(index, table, number);
        let ranges: Vec<&Range> = self.session_ranges().collect();
        let value = |field: &str| {
            let place = ranges.iter().position(|range| range.field == field);
            let value = place.and_then(|place| drawn.get(place).copied());
            value.ok_or_else(|| TwoPointsError::missing(field))
        };
        let skin = SkinSpec {
            farad_per_cm2: 1e-9 * value("skin_nf_per_cm2")?,
            ohm_cm2: 1e3 * value("skin_kohm_cm2")?,
            series_ohm: value("skin_series_ohm")?,
            half_a_per_cm2: 1e-3 * value("skin_half_ma_per_cm2")?,
        };
        let spec = HandSpec {
            skin: match self.mechanism {
                Mechanism::Earlier => skin,
                _ => skin.times(value("skin_factor")?),
            },
            return_factor: value("return_factor")?,
            ..forearm.clone()
        };
        let stream = self.session_stream(index, table);
        Ok(SessionDraw {
            spec: self.mechanism.changed_session(spec),
            stream: word(stream, number),
        })
    }

    /// Returns the random stream of the sessions of `table` on forearm `index`.
    pub fn session_stream(&self, index: u64, table: Table) -> u64 {
        word(word(self.own_seed(), index), table.number())
    }

    fn session_values(&self, index: u64, table: Table, number: u64) -> Vec<f64> {
        let ranges: Vec<Range> = self.session_ranges().cloned().collect();
        Range::draw_values(&ranges, self.session_stream(index, table), number)
    }

    /// Returns the ranges that are drawn for each session.
    fn session_ranges(&self) -> impl Iterator<Item = &Range> {
        let skin = self
            .population
            .ranges
            .iter()
            .filter(|range| is_of_skin(range));
        skin.chain(&self.declaration.session)
    }

    fn person_value(&self, drawn: &[f64], field: &str) -> Result<f64, TwoPointsError> {
        let value = Range::value(&self.declaration.person, drawn, field);
        value.ok_or_else(|| TwoPointsError::missing(field))
    }
}

fn is_of_skin(range: &Range) -> bool {
    range.field.starts_with("skin_")
}

/// Returns whether the range is of the forearm: neither of the skin nor of a size that table 1
/// prints, nor of a threshold.
fn is_of_forearm(range: &Range) -> bool {
    const KNOWN: [&str; 5] = [
        "reach_m",
        "around_m",
        "threshold_v",
        "other_v",
        "extensor_v",
    ];
    !is_of_skin(range) && !KNOWN.contains(&&*range.field)
}
