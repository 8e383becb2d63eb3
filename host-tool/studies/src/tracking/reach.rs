//! The part of a reference that a plant can hold.

use super::TrackingError;
use super::plant::Plant;
use super::trial::SCORED_FROM_MS;
use super::wearer::{self, Points, Volts};
use firmware::arithmetic::fixed_point::Q;
use firmware::control::{Effort, Mapping};
use hal_sim::body::random_finger::Reach;

/// A reference, as far as one plant can follow it.
#[derive(Clone, PartialEq, Debug)]
pub struct Reachable {
    /// Angle that is scored against at each millisecond, degrees: the reference, clipped to the
    /// range that the plant can hold inside the nominal wearer's amplitudes, as fatigued as
    /// following it so far has made the plant ([`Reach`]). No control law takes part.
    pub angles: Vec<f64>,
    /// Part of the scored time at which the reference is further than [`REACH_MARGIN_DEG`] out of
    /// reach.
    pub unreachable: f64,
}

/// Distance that counts as out of reach, degrees.
pub const REACH_MARGIN_DEG: f64 = 0.5;
/// Time between two computations of the reachable range, ms.
const EVERY_MS: usize = 20;

/// Returns the volts of the nominal wearer's amplitudes at this effort, −1…1.
pub(super) fn volts_at(mapping: &Mapping, effort: f64) -> Volts {
    let effort = Effort::Fraction(Q::from_num(effort.clamp(-1.0, 1.0)));
    super::driver::volts(&mapping.amplitudes(effort).0)
}

impl Reachable {
    /// Computes the part of a reference that this plant can follow with these points.
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
