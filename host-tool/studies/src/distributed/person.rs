//! Random wearers: a muscle, and the parts of it that each electrode reaches.

use super::declared::{Condition, DistributedDeclaration};
use super::error::DistributedError;
use crate::laboratory::Range;
use hal_sim::body::CHANNELS;
use hal_sim::body::muscle::tiring::Fatigue;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::body::shared::{Electrode, SharedSpec};
use hal_sim::random;

/// Fatigue constants of the human quadriceps: αA in s⁻², αK in N⁻¹s⁻¹ and ατ1 in N⁻¹, then the
/// muscle constant A for which they were measured (Ding 2003, cited by others).
const QUADRICEPS: (f64, f64, f64, f64) = (0.4, 1.9e-5, 2.1e-5, 3009.0);
/// Largest values that fatigue may reach: of K, and of τ1 in s.
const ENDS: (f64, f64) = (5.0, 0.2);
/// Pulse rate at which the parameter `activation` makes no difference to the fatigue of a rested
/// unit, Hz: pulses and force then reduce its A equally.
const ACTIVATION_HZ: f64 = 25.0;
/// Seed of the order in which the nominal wearer's motor units are recruited.
const MIDDLE: u64 = 0x0d15;

/// Simulated wearer: one value for each range of the declaration.
#[derive(Clone, Debug)]
pub struct DistributedWearer {
    /// Parameter values, in the order of the declared ranges.
    pub drawn: Vec<f64>,
    ranges: Vec<Range>,
    seed: u64,
}

impl DistributedWearer {
    /// Generates the random wearer with this index; seed and index determine all values.
    #[must_use]
    pub fn random(declared: &DistributedDeclaration, seed: u64, index: u64) -> Self {
        Self {
            drawn: Range::draw_values(&declared.ranges, seed, index),
            ranges: declared.ranges.clone(),
            seed: random::word(random::word(seed, index), u64::MAX),
        }
    }

    /// Returns the nominal wearer, whose parameters are all in the middle of their ranges.
    #[must_use]
    pub fn nominal(declared: &DistributedDeclaration) -> Self {
        Self {
            drawn: declared.ranges.iter().map(|range| range.at(0.5)).collect(),
            ranges: declared.ranges.clone(),
            seed: MIDDLE,
        }
    }

    /// Sets the parameter `field` to `value`; an unknown name changes nothing.
    #[must_use]
    pub fn with_value(mut self, field: &str, value: f64) -> Self {
        let place = self.ranges.iter().position(|range| range.field == field);
        if let Some(own) = place.and_then(|place| self.drawn.get_mut(place)) {
            *own = value;
        }
        self
    }

    /// Returns the value of the parameter `field`.
    ///
    /// # Errors
    /// Returns E722 if no range has this name.
    pub fn value(&self, field: &str) -> Result<f64, DistributedError> {
        let value = Range::value(&self.ranges, &self.drawn, field);
        value.ok_or_else(|| DistributedError::Declaration(format!("it has no range for `{field}`")))
    }

    /// Returns the constants of the muscle model, scaled so that the mean force of the whole muscle
    /// at `hz` is 1.
    fn dynamics(&self, hz: f64) -> Result<Parameters, DistributedError> {
        let subject = self.value("subject")? as usize; // 0 to 9
        Ok(SUBJECTS[subject % SUBJECTS.len()].normalised_at(hz))
    }

    /// Returns this wearer's muscle with the electrodes of `condition`, which are on the first
    /// channels.
    ///
    /// # Errors
    /// Returns E722 if a range is missing.
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
        // All wearers who work at the same share of their strength tire equally.
        let carried = alpha / alpha_a * a / dynamics.a_n_per_s;
        let fatigue = Fatigue {
            alpha_a_per_s2: alpha * (1.0 - activation),
            alpha_k_per_n_s: alpha_k * carried,
            alpha_tau1_per_n: alpha_tau1 * carried,
            tau_fat_s: self.value("tau_fat_s")?,
            k_max: ENDS.0,
            tau1_max_s: ENDS.1,
        };
        // Mean force of a rested unit per A.
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
            // There are as many electrodes as channels.
            electrodes: electrodes.unwrap_or_default(),
            seed: self.seed,
        })
    }

    /// Returns the electrode of this channel, or `None` if the condition does not use the channel.
    /// A single electrode reaches a part of every group of motor units. One of several electrodes
    /// reaches its own groups and, through crosstalk, a part of the others.
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
