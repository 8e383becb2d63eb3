//! Generates random wearers and the points of a grid.

use super::declaration::{Declaration, RandomField, Uniformity};
use hal_sim::random::{unit, word};
use host_core::session::noise_seed;
use toml::Value;

/// Random stream from which the wearers' values are generated; [`noise_seed`] has that of their noise.
const WEARERS: u64 = 0x1AB0;

/// A unit of a sweep: one wearer at one point of the grid.
#[derive(Clone, PartialEq, Debug)]
pub struct Unit {
    /// Index of the unit, from 0.
    pub index: u64,
    /// Index of the wearer, from 0; every wearer recurs at each point of the grid.
    pub wearer: u64,
    /// Dotted paths of the random and the grid fields in the session, with the values of this unit.
    pub fields: Vec<(String, Value)>,
    /// Seed of the noise in the unit's simulation.
    pub seed: u64,
}

/// Returns the number of grid points; 1 without a grid.
#[must_use]
pub fn points(d: &Declaration) -> u64 {
    d.grid.iter().map(|grid| grid.values.len() as u64).product()
}

/// Returns unit `index` of a sweep with `draws` wearers. The wearer changes fastest: all wearers at
/// one grid point have consecutive indices.
#[must_use]
pub fn unit_of(d: &Declaration, seed: u64, draws: u64, index: u64) -> Unit {
    let (point, wearer) = (index / draws.max(1), index % draws.max(1));
    let stream = word(word(seed, WEARERS), wearer);
    let drawn = d.drawn.iter().zip(0..);
    let mut fields: Vec<(String, Value)> = drawn
        .map(|(drawn, nth)| (drawn.field.clone(), value(drawn, unit(stream, nth))))
        .collect();
    fields.extend(at_point(d, point));
    Unit {
        index,
        wearer,
        fields,
        seed: noise_seed(seed, wearer),
    }
}

/// Returns the grid fields with their values at grid point `point`; the last field changes fastest.
#[must_use]
pub fn at_point(d: &Declaration, point: u64) -> Vec<(String, Value)> {
    let values = crossed(point, d.grid.iter().map(|grid| &*grid.values));
    let fields = d.grid.iter().map(|grid| grid.field.clone());
    fields
        .zip(values.into_iter().map(|value| number(*value)))
        .collect()
}

/// Returns combination `index` of one element from each list; the last list changes fastest. An
/// empty list contributes nothing.
pub(super) fn crossed<'a, T>(
    index: u64,
    lists: impl DoubleEndedIterator<Item = &'a [T]>,
) -> Vec<&'a T> {
    let (mut rest, mut chosen) = (index, Vec::new());
    for list in lists.rev() {
        let count = (list.len() as u64).max(1);
        chosen.extend(list.get((rest % count) as usize));
        rest /= count;
    }
    chosen.reverse();
    chosen
}

/// Returns the grid point as text, for example "body.inertia_kg_m2 = 0.06; "; empty without a grid.
pub(super) fn point_in_words(declaration: &Declaration, point: u64) -> String {
    let fields = at_point(declaration, point).into_iter();
    let fields = fields.map(|(field, value)| format!("{field} = {value}; "));
    fields.collect()
}

/// Returns the smallest and the largest value that a random field can take.
pub(super) fn ends(drawn: &RandomField) -> [Value; 2] {
    match drawn.even {
        Uniformity::Whole => [drawn.low, drawn.high].map(|end| Value::Integer(end as i64)),
        Uniformity::Value | Uniformity::Logarithm => [drawn.low, drawn.high].map(Value::Float),
    }
}

/// Returns the value of a random field at the fraction `part` of its range, 0 to 1, on the field's
/// scale.
fn value(drawn: &RandomField, part: f64) -> Value {
    let RandomField { low, high, .. } = *drawn;
    match drawn.even {
        Uniformity::Value => Value::Float(low + part * (high - low)),
        Uniformity::Logarithm => Value::Float(low * libm::pow(high / low, part)),
        Uniformity::Whole => Value::Integer((low + (part * (high - low + 1.0)).floor()) as i64),
    }
}

/// Returns a number as a TOML value. Whole numbers become integers, because some session fields
/// accept nothing else.
fn number(value: f64) -> Value {
    match value.fract() == 0.0 && value.abs() < 1e15 {
        true => Value::Integer(value as i64),
        false => Value::Float(value),
    }
}
