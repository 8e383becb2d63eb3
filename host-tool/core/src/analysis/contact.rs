//! Hits of a virtual wall: how deep the limb went and how it swung.

use crate::record::{Sample, Trial, WallPlace};
use serde::{Deserialize, Serialize};

/// Time outside the wall and its pre-wall after which a hit is over, s. It is longer than a bounce
/// of the limb and shorter than the time until a wearer's next attempt.
const GAP_S: f64 = 1.0;
/// Time before the hit over which the speed of the approach is computed, s.
const APPROACH_S: f64 = 0.1;
/// Smallest movement back that counts as a turning point, degrees; it is well above a sensor's
/// noise.
const TURN_DEG: f64 = 0.5;
/// Part of a hit in which the limb's swing is judged, as shares of the hit's length. It begins
/// after the impact has settled and ends before the limb leaves the wall.
const LATE: (f64, f64) = (0.5, 0.75);

/// One hit of a virtual wall: the time from the moment at which the limb enters the wall or its
/// pre-wall until it has stayed outside for 1 s.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct WallContact {
    /// Start of the hit: first sample inside the wall or its pre-wall, s since the start of the
    /// trial.
    pub at_s: f64,
    /// Time from the first to the last sample inside the wall or its pre-wall, s.
    pub for_s: f64,
    /// Mean speed over the last 0.1 s before the hit, °/s, positive into the wall; 0 if the trial
    /// has no sample before the hit.
    pub speed_deg_per_s: f64,
    /// Deepest penetration of the wall, degrees; negative if the limb entered only the pre-wall.
    pub deepest_deg: f64,
    /// Number of reversals of the limb's movement during the hit; only movements of at least half a
    /// degree count.
    pub turns: usize,
    /// Peak-to-peak movement of the limb during the third quarter of the hit, degrees.
    pub late_swing_deg: f64,
    /// Mean penetration of the wall during the third quarter of the hit, degrees; negative in front
    /// of the wall.
    pub late_depth_deg: f64,
}

/// Returns the hits of a trial in the order of time; an empty list without a wall. Uses the true
/// angle where it is known, otherwise the sensor's angle.
pub fn wall_contacts(trial: &Trial) -> Vec<WallContact> {
    let Some(wall) = trial.wall else {
        return Vec::new();
    };
    let course: Vec<(f64, f64)> = trial
        .samples
        .map_each(|s| Some((s.t_s, penetration(&wall, s)?)))
        .flatten()
        .collect();
    let is_near = |(_, depth): &(f64, f64)| *depth > -wall.pre_wall_deg;
    let mut visits: Vec<(usize, usize)> = Vec::new();
    for (n, sample) in course.iter().enumerate().filter(|(_, s)| is_near(s)) {
        match visits.last_mut() {
            Some((_, last)) if sample.0 - course[*last].0 <= GAP_S => *last = n,
            _ => visits.push((n, n)),
        }
    }
    visits
        .into_iter()
        .map(|(first, last)| measure_contact(&course, first, last))
        .collect()
}

/// Returns how far the limb is inside the wall, degrees, negative in front of it; `None` if no
/// angle is known.
fn penetration(wall: &WallPlace, sample: &Sample) -> Option<f64> {
    let inside = sample.true_deg.or(sample.measured_deg)? - wall.at_deg;
    Some(if wall.stops_flexion { inside } else { -inside })
}

/// Measures one hit, from sample `first` to sample `last` of `course`, which has pairs of time (s)
/// and penetration (degrees).
fn measure_contact(course: &[(f64, f64)], first: usize, last: usize) -> WallContact {
    let visit = &course[first..=last];
    let (at_s, for_s) = (course[first].0, course[last].0 - course[first].0);
    let before = course[..first].iter().rev();
    let before = before.take_while(|(t, _)| at_s - t <= APPROACH_S).last();
    let speed = before.map_or(0.0, |(t, depth)| (course[first].1 - depth) / (at_s - t));
    let is_late = |(t, _): &&(f64, f64)| {
        let part = (t - at_s) / for_s;
        (LATE.0..=LATE.1).contains(&part)
    };
    let mut late: Vec<f64> = visit.iter().filter(is_late).map(|s| s.1).collect();
    if late.is_empty() {
        late.push(course[last].1); // too short to have a third quarter
    }
    let highest = |depths: &[f64]| depths.iter().copied().fold(f64::MIN, f64::max);
    let lowest = late.iter().copied().fold(f64::MAX, f64::min);
    let depths: Vec<f64> = visit.iter().map(|s| s.1).collect();
    WallContact {
        at_s,
        for_s,
        speed_deg_per_s: speed,
        deepest_deg: highest(&depths),
        turns: count_turning_points(&depths),
        late_swing_deg: highest(&late) - lowest,
        late_depth_deg: late.iter().sum::<f64>() / late.len() as f64,
    }
}

/// Counts the turning points of a course, after each of which it moves back by at least
/// [`TURN_DEG`].
fn count_turning_points(depths: &[f64]) -> usize {
    let mut count = 0;
    let (mut is_rising, mut extreme) = (true, f64::MIN);
    for &depth in depths {
        let ahead = if is_rising {
            depth - extreme
        } else {
            extreme - depth
        };
        if ahead > 0.0 {
            extreme = depth;
        } else if ahead < -TURN_DEG {
            (is_rising, extreme) = (!is_rising, depth);
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(pre_wall_deg: f64, angle: impl Fn(f64) -> f64) -> Trial {
        let sample = |n: u32| {
            let t_s = f64::from(n) * 0.01;
            Sample {
                t_s,
                measured_deg: Some(angle(t_s)),
                ..Sample::default()
            }
        };
        Trial {
            samples: (0..1000).map(sample).collect(),
            wall: Some(WallPlace {
                at_deg: 90.0,
                stops_flexion: true,
                pre_wall_deg,
            }),
            ..Trial::default()
        }
    }

    #[test]
    fn a_hit_is_measured_as_by_hand() {
        // The limb enters at 20 °/s from 80°, reaches 90° after 0.5 s, goes up to 94°, swings by
        // ±1° at 1 Hz about 93° for 4 s, and leaves.
        let course = |t: f64| match t {
            t if t < 0.7 => 80.0 + 20.0 * t,
            t if t < 5.0 => 93.0 + libm::cos(std::f64::consts::TAU * (t - 0.7)),
            t => 92.69 - 20.0 * (t - 5.0),
        };
        let hits = wall_contacts(&trial(0.0, course));
        let [hit] = hits.as_slice() else {
            panic!("{hits:?}")
        };
        assert!((hit.at_s - 0.51).abs() < 0.011, "{hit:?}");
        assert!((hit.for_s - 4.62).abs() < 0.011, "{hit:?}");
        assert!((hit.speed_deg_per_s - 20.0).abs() < 1e-6, "{hit:?}");
        assert!((hit.deepest_deg - 4.0).abs() < 1e-3, "{hit:?}");
        assert!((hit.late_swing_deg - 2.0).abs() < 0.01, "{hit:?}");
        // The limb goes down and up four times, down for the last third of a period, and out.
        assert_eq!(hit.turns, 9, "{hit:?}");
    }

    #[test]
    fn a_bounce_is_one_hit_and_a_new_try_another() {
        let course = |t: f64| {
            if t % 3.0 < 0.5 || (1.0..1.2).contains(&(t % 3.0)) {
                91.0
            } else {
                89.0
            }
        };
        assert_eq!(wall_contacts(&trial(0.0, course)).len(), 4);
        // Within a pre-wall no hit ends.
        assert_eq!(wall_contacts(&trial(9.0, course)).len(), 1);
        assert!(wall_contacts(&Trial::default()).is_empty());
    }
}
