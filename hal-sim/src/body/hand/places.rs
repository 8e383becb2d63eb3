//! A forearm on which electrodes are placed many times: the field of every place is solved once.
//!
//! Takes a hand and the places at which an electrode may lie; returns hands with electrodes at any
//! three of them, with skin and current limits of their own. The hands equal those of
//! [`Hand::new`] except for rounding.

use super::field::{Field, Pad};
use super::force::Forces;
use super::forearm::{Forearm, Unit};
use super::response::{Hand, InvalidHand};
use super::spec::{ELECTRODES, HandSpec, RETURN, Rule};
use std::collections::BTreeMap;
use std::sync::Arc;

fn nerve_drive(field: &Field, rule: Rule, (pad, unit): (&Pad, &Unit)) -> f64 {
    rule.nerve_drive(&field.transfer(pad, unit.at_m), unit)
}

/// Places on a forearm, with the drive of every motor unit from each.
#[derive(Debug, Clone)]
pub struct Places {
    field: Arc<Field>,
    units: Vec<Unit>,
    pads: Vec<Pad>,
    /// Drive of each unit per ampere, by place; the return is last. Of a place that has not been
    /// used, only the flexors are solved: the other units lie on the far side of the forearm, and
    /// cost the most.
    drives: Vec<Vec<f64>>,
    rule: Rule,
    /// Resistances of the tissue between two places that have been used, Ω.
    resistance_ohm: BTreeMap<[usize; 2], f64>,
    /// Forces that every hand knows from the start.
    forces: Forces,
}

impl Places {
    /// Solves the field of every place in `pads` and of the return on the forearm of `spec`.
    ///
    /// # Errors
    /// Fails if the tissue is invalid.
    pub fn new(spec: &HandSpec, mut pads: Vec<Pad>) -> Result<Self, InvalidHand> {
        let field = Arc::new(Field::coarse(spec.tissue)?);
        let units = spec.motor_units();
        pads.push(spec.return_pad());
        let is_flexor = |unit: &&Unit| unit.pool.flexed_digit().is_some();
        let of_pad = |pad: &Pad| {
            let flexors = units.iter().take_while(is_flexor);
            flexors
                .map(|unit| nerve_drive(&field, spec.rule, (pad, unit)))
                .collect()
        };
        Ok(Self {
            drives: pads.iter().map(of_pad).collect(),
            rule: spec.rule,
            field,
            units,
            pads,
            resistance_ohm: BTreeMap::new(),
            forces: Hand::warm_forces(),
        })
    }

    /// Returns the motor units of the forearm.
    #[must_use]
    pub fn units(&self) -> &[Unit] {
        &self.units
    }

    /// Returns the places, in the order in which they were given; the return is last.
    #[must_use]
    pub fn pads(&self) -> &[Pad] {
        &self.pads
    }

    /// Returns how strongly each flexor unit is driven per ampere that enters at this place; they are
    /// the first ones of [`Self::units`]. Empty if there is no such place.
    #[must_use]
    pub fn flexor_drives(&self, place: usize) -> &[f64] {
        self.drives.get(place).map_or(&[], Vec::as_slice)
    }

    /// Creates the hand with electrodes A, B and E at these places. `spec` may differ from that of
    /// the places in skin, return, current limit, couplings, membrane and muscles, but must have
    /// the same tissue, activation rule and motor units.
    ///
    /// # Errors
    /// Fails if the circuit of the hand is invalid.
    ///
    /// # Panics
    /// Panics if there is no such place.
    pub fn hand(&mut self, spec: HandSpec, points: [usize; RETURN]) -> Result<Hand, InvalidHand> {
        let [a, b, e] = points;
        let places = [a, b, e, self.pads.len() - 1];
        for place in places {
            self.solve_rest(place);
        }
        let resistance_ohm = places.map(|from| places.map(|to| self.resistance_ohm(from, to)));
        let pads = places.map(|place| self.pads[place]);
        let of_unit = |unit: usize| -> [f64; ELECTRODES] {
            let mut drives = places.map(|place| self.drives[place][unit]);
            let coupled = drives.iter_mut().zip(spec.coupling);
            coupled.for_each(|(drive, coupling)| *drive *= coupling);
            drives
        };
        let drives = (0..self.units.len()).map(of_unit).collect();
        let resistance_ohm = resistance_ohm.map(|row| row.to_vec());
        let units = self.units.clone();
        let forearm = Forearm::with_drives(&spec, &pads, &resistance_ohm, (units, drives))?;
        let shared = (Arc::clone(&self.field), self.forces.clone());
        Ok(Hand::from_forearm(spec, pads, forearm, shared))
    }

    /// Solves the field of a place at the units that are no flexors, unless that is done.
    fn solve_rest(&mut self, place: usize) {
        let solved = self.drives[place].len();
        let (field, rule, pad) = (&*self.field, self.rule, self.pads[place]);
        let rest = self.units[solved..].iter();
        let rest = rest.map(|unit| nerve_drive(field, rule, (&pad, unit)));
        self.drives[place].extend(rest);
    }

    /// Returns the resistance between two places, Ω, which is solved once.
    fn resistance_ohm(&mut self, from: usize, to: usize) -> f64 {
        let (field, pads) = (&*self.field, &self.pads);
        let solve = || field.resistance(&pads[from], &pads[to]);
        let pair = [from.min(to), from.max(to)];
        *self.resistance_ohm.entry(pair).or_insert_with(solve)
    }
}
