//! Recruitment by a pulse at its point, and the effect of points that act as a pair.

use super::{A, B, EXTENSOR, FingerSpec, Site};
use crate::body::wearer::recruitment;

/// Time within which both flexor points must be pulsed to act as a pair, µs: one period of the
/// slowest usual stimulation, 20 Hz.
const PAIR_WINDOW_US: u64 = 50_000;

/// Effect of one pulse at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Recruited share of the muscle's full torque, 0 to 1.
    pub recruitment: f64,
    /// Torque of a full pair over that of one point; `None` for a point that acts alone.
    pub pair_factor: Option<f64>,
}

/// Effect of a finger's [`Pair`](super::spec::Pair) on its points.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PairEffect {
    /// Thresholds of A and B while both points are pulsed, V.
    threshold_v: [f64; 2],
    /// Torque of the pair divided by that of one point: of a conducted pair, then of an isolated
    /// one.
    factors: [f64; 2],
}

/// State of the points A, B and extensor of one finger.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    sites: [Site; 3],
    together: Option<PairEffect>,
    curvature: f64,
    /// Time of the last pulse at each point that was strong enough for a pair, µs.
    last_paired_us: [Option<u64>; 3],
}

impl Points {
    /// Creates the points of this finger, before any pulse.
    pub fn new(spec: &FingerSpec) -> Self {
        Self {
            sites: spec.sites(),
            together: spec.pair.map(|pair| PairEffect {
                threshold_v: pair.threshold_v,
                factors: pair.torque_nm.map(|nm| nm / spec.flexor_torque_nm),
            }),
            curvature: spec.recruitment_curvature,
            last_paired_us: [None; 3],
        }
    }

    /// Applies a pulse of `effective_v` volts at point `muscle` (0 A, 1 B, 2 extensor) and returns
    /// its effect.
    pub fn excite(
        &mut self,
        muscle: usize,
        t_us: u64,
        effective_v: f64,
        conducted: bool,
    ) -> Effect {
        let Site {
            threshold_v, max_v, ..
        } = self.sites[muscle];
        let mut threshold_v = threshold_v;
        let mut pair_factor = None;
        if muscle != EXTENSOR
            && let Some(together) = self.together
        {
            let paired_v = together.threshold_v[muscle];
            if effective_v >= paired_v {
                self.last_paired_us[muscle] = Some(t_us);
            }
            let other = self.last_paired_us[A + B - muscle];
            if other.is_some_and(|at| t_us.saturating_sub(at) <= PAIR_WINDOW_US) {
                threshold_v = threshold_v.min(paired_v);
                pair_factor = Some(together.factors[usize::from(!conducted)]);
            }
        }
        Effect {
            recruitment: recruitment(effective_v, threshold_v, max_v, self.curvature),
            pair_factor,
        }
    }
}
