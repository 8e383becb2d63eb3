//! Computes the intended trajectory of the hands, from the table to the target.

use super::declaration::Study;
use hal_sim::body::sagittal::{JOINTS, Links};

/// Number of trajectory steps per second.
pub(super) const RATE_HZ: f64 = 200.0;

/// Durations of the two parts of a movement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Duration of the lift to above the target, s.
    pub lift_s: f64,
    /// Duration of the drop onto the target, s.
    pub drop_s: f64,
    /// Fraction of the lift that overlaps with the drop.
    pub overlap: f64,
}

/// The intended movement in steps of 5 ms.
#[derive(Clone, Debug, PartialEq)]
pub struct LiftTrajectory {
    /// Flexion of elbow and shoulder, rad.
    pub flexions: Vec<[f64; JOINTS]>,
    /// Angular velocity of elbow and shoulder, rad/s.
    pub rates: Vec<[f64; JOINTS]>,
    /// Angular acceleration of elbow and shoulder, rad/s².
    pub accelerations: Vec<[f64; JOINTS]>,
    /// Position of the hand, forward and up from the shoulder, m.
    pub hand_m: Vec<[f64; 2]>,
    /// Acceleration of the hand, forward and up, m/s².
    pub hand_m_s2: Vec<[f64; 2]>,
}

/// Returns the minimum-jerk trajectory from 0 to 1 (Flash & Hogan 1985) and its second derivative,
/// for u from 0 to 1.
fn minimum_jerk(u: f64) -> [f64; 2] {
    let u = u.clamp(0.0, 1.0);
    [
        u * u * u * (10.0 + u * (6.0 * u - 15.0)),
        u * (60.0 + u * (120.0 * u - 180.0)),
    ]
}

/// Returns the positions for a height and a participant with this reach, m: start, above the
/// target, target.
#[must_use]
pub(super) fn waypoints(study: &Study, reach_m: f64, height: usize) -> [[f64; 2]; 3] {
    let way = &study.way;
    let z = way.heights[height].z;
    let points = [way.start, [way.over_x, z + way.over_z], [way.target_x, z]];
    points.map(|values| values.map(|part| part * reach_m))
}

impl LiftTrajectory {
    /// Combines two minimum-jerk movements, the second of which starts before the first ends.
    #[must_use]
    pub fn new(links: &Links, [start, over, end]: [[f64; 2]; 3], timing: Timing) -> Self {
        let begins_s = timing.lift_s * (1.0 - timing.overlap);
        let duration_s = (begins_s + timing.drop_s).max(timing.lift_s);
        let steps = (duration_s * RATE_HZ).ceil() as usize;
        let at = |n: usize| {
            let t = n as f64 / RATE_HZ;
            let [up, up2] = minimum_jerk(t / timing.lift_s);
            let [down, down2] = minimum_jerk((t - begins_s) / timing.drop_s);
            let axis = |axis: usize| {
                let (first, second) = (over[axis] - start[axis], end[axis] - over[axis]);
                let at = start[axis] + first * up + second * down;
                let turned =
                    first * up2 / timing.lift_s.powi(2) + second * down2 / timing.drop_s.powi(2);
                (at, turned)
            };
            [axis(0), axis(1)]
        };
        let samples: Vec<_> = (0..=steps).map(at).collect();
        let hand_m: Vec<[f64; 2]> = samples
            .iter()
            .map(|values| values.map(|pair| pair.0))
            .collect();
        Self::from_hand_path(
            links,
            hand_m,
            samples
                .iter()
                .map(|values| values.map(|pair| pair.1))
                .collect(),
        )
    }

    /// Converts the path of a hand to joint angles.
    fn from_hand_path(links: &Links, hand_m: Vec<[f64; 2]>, hand_m_s2: Vec<[f64; 2]>) -> Self {
        let flexions: Vec<_> = hand_m
            .iter()
            .map(|hand_m| links.flexions(*hand_m))
            .collect();
        let last = flexions.len() - 1;
        let slope = |series: &[[f64; JOINTS]], n: usize| -> [f64; JOINTS] {
            let (from, to) = (n.saturating_sub(1), (n + 1).min(last));
            let h = (to - from) as f64 / RATE_HZ;
            std::array::from_fn(|joint| (series[to][joint] - series[from][joint]) / h)
        };
        let rates: Vec<_> = (0..=last).map(|n| slope(&flexions, n)).collect();
        let accelerations = (0..=last).map(|n| slope(&rates, n)).collect();
        Self {
            flexions,
            rates,
            accelerations,
            hand_m,
            hand_m_s2,
        }
    }

    /// Returns the number of points of the trajectory, including start and end.
    #[must_use]
    pub fn len(&self) -> usize {
        self.flexions.len()
    }

    /// Always returns `false`, because a trajectory has at least one point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.flexions.is_empty()
    }

    /// Returns `n`, but at most the last step.
    #[must_use]
    pub fn step(&self, n: usize) -> usize {
        n.min(self.len() - 1)
    }

    /// Returns the torques of elbow and shoulder at step `n` with half of `object_kg` in the hand,
    /// N m.
    #[must_use]
    pub fn torques_nm(&self, links: &Links, n: usize, object_kg: f64) -> [f64; JOINTS] {
        let n = self.step(n);
        let half = 0.5 * object_kg;
        let [x, z] = self.hand_m_s2[n];
        let hand_n = [
            -half * x,
            -half * (z + hal_sim::body::sagittal::GRAVITY_M_S2),
        ];
        links.torques_nm(
            self.flexions[n],
            self.rates[n],
            self.accelerations[n],
            hand_n,
        )
    }
}
