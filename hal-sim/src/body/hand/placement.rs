//! Where electrodes can lie: on the forearm, none on another.

use super::field::Pad;
use super::spec::{HandSpec, RETURN};
use std::fmt;

/// Names of A, B, the extensor's electrode and the return, for people.
const NAMES: [&str; RETURN + 1] = ["A", "B", "the extensor", "the return"];

/// What is wrong with where electrodes lie. Its text is for people.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlacementError {
    /// The middle of an electrode lies off the forearm.
    Off {
        /// Which, as in [`super::spec`].
        point: usize,
        /// Elbow to wrist, m.
        forearm_m: f64,
        /// Around the forearm, m.
        around_m: f64,
    },
    /// Two electrodes, of the points and the return, cover a common area.
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
                "the electrode of {} lies off the forearm: along 0 to {:.0} mm from the elbow, \
                 around -{2:.0} to {2:.0} mm from the palmar midline",
                name(point),
                1e3 * forearm_m,
                500.0 * around_m
            ),
            Self::Overlap(one, other) => {
                let (one, other) = (name(one), name(other));
                write!(f, "the electrodes of {one} and of {other} overlap")
            }
        }
    }
}

impl HandSpec {
    /// What is wrong with electrodes A, B and E on `points`, beside the return; nothing
    /// of electrodes that can lie so.
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
        let all = [a, b, e, self.return_pad()];
        for (place, pad) in all.iter().enumerate() {
            let others = all.iter().enumerate().skip(place + 1);
            // Also across the dorsal midline, where the forearm closes.
            let around = |other: &Pad, by_m: f64| Pad {
                y_m: other.y_m + by_m,
                ..*other
            };
            let overlaps = |other: &Pad| {
                let all = [-around_m, 0.0, around_m].map(|by_m| around(other, by_m));
                all.iter().any(|other| pad.overlaps(other))
            };
            let beneath = others.filter(|(_, other)| overlaps(other));
            wrong.extend(beneath.map(|(other, _)| PlacementError::Overlap(place, other)));
        }
        wrong
    }
}
