//! A drawn person: a muscle, and what electrodes reach of it.

use super::declared::{Condition, DistributedDeclaration};
use super::error::DistributedError;
use crate::laboratory::Range;
use hal_sim::body::CHANNELS;
use hal_sim::body::muscle::tiring::Fatigue;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::body::shared::{Electrode, SharedSpec};
use hal_sim::random;

/// Ding 2003's human quadriceps, second-hand: αA, αK and ατ1 in s⁻², N⁻¹s⁻¹ and N⁻¹, at A.
const QUADRICEPS: (f64, f64, f64, f64) = (0.4, 1.9e-5, 2.1e-5, 3009.0);
/// Where the model of a tiring muscle ends: K and τ1, s.
const ENDS: (f64, f64) = (5.0, 0.2);
/// At which pulses and force take equal parts of A from a rested unit, whatever `activation`.
const ACTIVATION_HZ: f64 = 25.0;
/// The seed of recruitment orders of a person who was not drawn.
const MIDDLE: u64 = 0x0d15;

/// Somebody.
#[derive(Clone, Debug)]
pub struct DistributedWearer {
    /// What was drawn, in the declaration's order.
    pub drawn: Vec<f64>,
    ranges: Vec<Range>,
    seed: u64,
}

impl DistributedWearer {
    /// Person `index` of `seed`.
    #[must_use]
    pub fn random(declared: &DistributedDeclaration, seed: u64, index: u64) -> Self {
        Self {
            drawn: Range::draw_values(&declared.ranges, seed, index),
            ranges: declared.ranges.clone(),
            seed: random::word(random::word(seed, index), u64::MAX),
        }
    }

    /// In the middle of every range.
    #[must_use]
    pub fn nominal(declared: &DistributedDeclaration) -> Self {
        Self {
            drawn: declared.ranges.iter().map(|range| range.at(0.5)).collect(),
            ranges: declared.ranges.clone(),
            seed: MIDDLE,
        }
    }

    /// The same with another value of this field.
    #[must_use]
    pub fn with_value(mut self, field: &str, value: f64) -> Self {
        let place = self.ranges.iter().position(|range| range.field == field);
        if let Some(own) = place.and_then(|place| self.drawn.get_mut(place)) {
            *own = value;
        }
        self
    }

    /// What was drawn of this field.
    ///
    /// # Errors
    /// E722: there is no such range.
    pub fn value(&self, field: &str) -> Result<f64, DistributedError> {
        let value = Range::value(&self.ranges, &self.drawn, field);
        value.ok_or_else(|| DistributedError::Declaration(format!("no range for `{field}`")))
    }

    /// Their dynamics, where a force of 1 is their whole muscle's mean at `hz`.
    fn dynamics(&self, hz: f64) -> Result<Parameters, DistributedError> {
        let subject = self.value("subject")? as usize; // from 0, below 10
        Ok(SUBJECTS[subject % SUBJECTS.len()].normalised_at(hz))
    }

    /// Their muscle under the electrodes of `condition`, on the first channels.
    ///
    /// # Errors
    /// E722: a range is missing.
    pub fn muscle(
        &self,
        declared: &DistributedDeclaration,
        condition: &Condition,
    ) -> Result<SharedSpec, DistributedError> {
        let own = declared.muscle;
        let dynamics = self.dynamics(own.strength_hz)?;
        let alpha = self.value("alpha_a_per_s2")?;
        let activation = self.value("activation")?;
        let (alpha_a, alpha_k, alpha_tau1, a) = QUADRICEPS;
        // Whoever works at the same share of his strength tires alike.
        let carried = alpha / alpha_a * a / dynamics.a_n_per_s;
        let fatigue = Fatigue {
            alpha_a_per_s2: alpha * (1.0 - activation),
            alpha_k_per_n_s: alpha_k * carried,
            alpha_tau1_per_n: alpha_tau1 * carried,
            tau_fat_s: self.value("tau_fat_s")?,
            k_max: ENDS.0,
            tau1_max_s: ENDS.1,
        };
        // Mean force of a rested unit for an A of 1.
        let per_a = 1.0 / dynamics.normalised_at(ACTIVATION_HZ).a_n_per_s;
        let electrodes = (0..CHANNELS).map(|index| self.electrode(own.groups, condition, index));
        let electrodes = electrodes.collect::<Result<Vec<_>, _>>()?;
        let electrodes = electrodes.try_into();
        Ok(SharedSpec {
            strength_n: self.value("strength_n")?,
            dynamics,
            fatigue,
            pulse_takes: activation * alpha * per_a / ACTIVATION_HZ,
            groups: own.groups,
            units_per_group: own.units_per_group,
            // As many as there are channels.
            electrodes: electrodes.unwrap_or_default(),
            seed: self.seed,
        })
    }

    /// The one electrode reaches a part of every group; one of several its own groups, and
    /// of the others a part.
    fn electrode(
        &self,
        groups: usize,
        condition: &Condition,
        channel: usize,
    ) -> Result<Option<Electrode>, DistributedError> {
        if channel >= condition.electrodes {
            return Ok(None);
        }
        let (single, own, crosstalk) = (
            self.value("reach")?,
            self.value("own")?,
            self.value("crosstalk")?,
        );
        let reach = (0..groups).map(|group| match condition.electrodes {
            1 => single,
            count if group * count / groups == channel => own,
            _ => crosstalk,
        });
        let threshold_ma = self.value("threshold_ma")?;
        Ok(Some(Electrode {
            threshold_ma,
            full_ma: threshold_ma + self.value("span_ma")?,
            foot: self.value("foot")?,
            reach: reach.collect(),
        }))
    }
}
