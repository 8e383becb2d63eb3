//! The part of a reference that a plant can hold.

use super::TrackingError;
use super::plant::Plant;
use super::trial::SCORED_FROM_MS;
use super::wearer::{self, Points, Volts};
use firmware::arithmetic::fixed_point::Q;
use firmware::control::{Effort, Mapping};
use hal_sim::body::random_finger::Reach;

/// A reference as far as one plant can follow it, whatever the control law.
#[derive(Clone, PartialEq, Debug)]
pub struct Reachable {
    /// Reachable reference at each millisecond, °: the reference, clipped to the angles that the
    /// plant can hold with the nominal wearer's amplitudes. The plant is assumed to be as fatigued
    /// as following the reachable reference has made it so far ([`Reach`]).
    pub angles: Vec<f64>,
    /// Part of the scored time at which the reference is more than [`REACH_MARGIN_DEG`] outside
    /// these angles, 0 to 1.
    pub unreachable: f64,
}

/// Distance from the reachable angles above which a reference counts as out of reach, °.
pub const REACH_MARGIN_DEG: f64 = 0.5;
/// Interval at which the range of reachable angles is computed, ms.
const EVERY_MS: usize = 20;

/// Returns the amplitudes to which the nominal wearer's mapping turns this effort, −1 to 1; larger
/// efforts are clipped.
pub(super) fn volts_at(mapping: &Mapping, effort: f64) -> Volts {
    let effort = Effort::Fraction(Q::from_num(effort.clamp(-1.0, 1.0)));
    super::driver::volts(&mapping.amplitudes(effort).0)
}

impl Reachable {
    /// Computes the part of the reference `wanted` that this plant can follow with these points.
    ///
    /// # Errors
    /// Never fails: the nominal wearer is valid (tested).
    pub fn new(plant: &Plant, points: Points, wanted: &[f64]) -> Result<Self, TrackingError> {
        let mapping = wearer::mapping(points)?;
        let [flexing, extending] = [1.0, -1.0].map(|effort| volts_at(&mapping, effort));
        let mut reach = Reach::new(&plant.finger, flexing, extending);
        let mut angles = Vec::with_capacity(wanted.len());
        for window in wanted.chunks(EVERY_MS) {
            let [lowest, highest] = reach.range_deg();
            angles.extend(window.iter().map(|w| w.clamp(lowest, highest)));
            if let Some(first) = window.first() {
                reach.hold_reachable_target(*first, window.len() as f64 / 1000.0);
            }
        }
        let scored = || wanted.iter().zip(&angles).skip(SCORED_FROM_MS);
        let out = scored().filter(|(w, a)| (*w - *a).abs() > REACH_MARGIN_DEG);
        let unreachable = out.count() as f64 / scored().count().max(1) as f64;
        Ok(Self {
            angles,
            unreachable,
        })
    }
}
