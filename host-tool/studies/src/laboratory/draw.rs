//! Wearers drawn at random and points of a grid.

use super::declaration::{Declaration, RandomField, Uniformity};
use hal_sim::random::{unit, word};
use toml::Value;

/// Of a wearer's numbers; noise has another.
const WEARERS: u64 = 0x1AB0;
const NOISE: u64 = 0x1AB1;

/// One wearer at one point of the grid.
#[derive(Clone, PartialEq, Debug)]
pub struct Unit {
    /// From 0, over all.
    pub index: u64,
    /// The wearer, from 0: alike at every point of the grid.
    pub wearer: u64,
    /// Fields of the session and what they become.
    pub fields: Vec<(String, Value)>,
    /// Of the simulated noise.
    pub seed: u64,
}

/// Points of the grid: 1 without one.
#[must_use]
pub fn points(d: &Declaration) -> u64 {
    d.grid.iter().map(|grid| grid.values.len() as u64).product()
}

/// Unit `index` of `seed`: wearers within points, so that one more wearer is one
/// more at each point.
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
        seed: word(word(seed, NOISE), wearer),
    }
}

/// The values of point `point` of the grid, the last field changing first.
#[must_use]
pub fn at_point(d: &Declaration, point: u64) -> Vec<(String, Value)> {
    let values = crossed(point, d.grid.iter().map(|grid| &*grid.values));
    let fields = d.grid.iter().map(|grid| grid.field.clone());
    fields
        .zip(values.into_iter().map(|value| number(*value)))
        .collect()
}

/// Element `index` of these lists crossed, one of each, the last list changing first;
/// none of an empty list.
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

/// "body.inertia_kg_m2 = 0.06; ", nothing without a grid.
pub(super) fn point_in_words(declaration: &Declaration, point: u64) -> String {
    let fields = at_point(declaration, point).into_iter();
    let fields = fields.map(|(field, value)| format!("{field} = {value}; "));
    fields.collect()
}

/// The least and the most that a draw gives.
pub(super) fn ends(drawn: &RandomField) -> [Value; 2] {
    match drawn.even {
        Uniformity::Whole => [drawn.low, drawn.high].map(|end| Value::Integer(end as i64)),
        Uniformity::Value | Uniformity::Logarithm => [drawn.low, drawn.high].map(Value::Float),
    }
}

/// Where `part` of the way, 0 to 1, lies.
fn value(drawn: &RandomField, part: f64) -> Value {
    let RandomField { low, high, .. } = *drawn;
    match drawn.even {
        Uniformity::Value => Value::Float(low + part * (high - low)),
        Uniformity::Logarithm => Value::Float(low * (high / low).powf(part)),
        Uniformity::Whole => Value::Integer((low + (part * (high - low + 1.0)).floor()) as i64),
    }
}

/// A whole number as such: some fields take no other.
fn number(value: f64) -> Value {
    match value.fract() == 0.0 && value.abs() < 1e15 {
        true => Value::Integer(value as i64),
        false => Value::Float(value),
    }
}
