//! Checks of electrode placement: electrodes must lie on the forearm and must not overlap.

use super::field::Pad;
use super::spec::{HandSpec, RETURN};
use std::fmt;

/// Names of A, B, the extensor's electrode and the return, for messages.
const NAMES: [&str; RETURN + 1] = ["A", "B", "the extensor", "the return"];

/// Error of electrode placement. Its `Display` text is for messages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlacementError {
    /// The middle of an electrode is off the forearm.
    Off {
        /// Index of the electrode, as in [`super::spec`].
        point: usize,
        /// Distance from elbow to wrist, m.
        forearm_m: f64,
        /// Circumference of the forearm, m.
        around_m: f64,
    },
    /// Two electrodes overlap; contains their indices, as in [`super::spec`].
    Overlap(usize, usize),
}

impl fmt::Display for PlacementError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |point: usize| NAMES.get(point).copied().unwrap_or_default();
        match *self {
            Self::Off {
                point,
                forearm_m,
                around_m,
            } => write!(
                f,
                "the electrode of {} lies outside the forearm; allowed: 0 to {:.0} mm from the \
                 elbow along it, -{2:.0} to {2:.0} mm from the palmar midline around it",
                name(point),
                1e3 * forearm_m,
                500.0 * around_m
            ),
            Self::Overlap(one, other) => {
                let (first, other) = (name(one), name(other));
                write!(f, "the electrodes of {first} and of {other} overlap")
            }
        }
    }
}

impl HandSpec {
    /// Returns the placement errors of electrodes A, B and E at `points`, together with the return;
    /// empty for a valid placement.
    #[must_use]
    pub fn placement_errors(&self, points: &[Pad; RETURN]) -> Vec<PlacementError> {
        let (forearm_m, around_m) = (self.forearm_m, self.around_m);
        let is_on =
            |pad: &Pad| (0.0..=forearm_m).contains(&pad.x_m) && pad.y_m.abs() <= 0.5 * around_m;
        let off = |point| PlacementError::Off {
            point,
            forearm_m,
            around_m,
        };
        let numbered = points.iter().enumerate();
        let mut wrong: Vec<_> = numbered
            .filter(|(_, pad)| !is_on(pad))
            .map(|(point, _)| off(point))
            .collect();
        let [a, b, e] = *points;
        let pads = [a, b, e, self.return_pad()];
        for (place, pad) in pads.iter().enumerate() {
            let others = pads.iter().enumerate().skip(place + 1);
            // Pads may also overlap across the dorsal midline, where the coordinates wrap around.
            let around = |other: &Pad, by_m: f64| Pad {
                y_m: other.y_m + by_m,
                ..*other
            };
            let overlaps = |other: &Pad| {
                let copies = [-around_m, 0.0, around_m].map(|by_m| around(other, by_m));
                copies.iter().any(|other| pad.overlaps(other))
            };
            let beneath = others.filter(|(_, other)| overlaps(other));
            wrong.extend(beneath.map(|(other, _)| PlacementError::Overlap(place, other)));
        }
        wrong
    }
}
