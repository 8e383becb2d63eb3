//! Voluntary movement of the wearer.

use super::TICK_S;
use super::spec::{MotorBehaviour, VisionSpec, VoluntaryApproach};
use std::collections::VecDeque;

/// Gain of the return to the start angle: speed per remaining angle, 1/s.
const RETURN_PER_S: f64 = 4.0;

/// State of a wearer's visual feedback: the angles seen and the intended speed.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct VisualFeedback {
    /// Angles of the latest milliseconds, oldest first, degrees.
    angles: VecDeque<f64>,
    /// Milliseconds since the latest correction.
    since: u32,
    /// Intended speed before and after the latest correction, °/s; `None` before the first.
    meant: Option<(f64, f64)>,
}

impl VisualFeedback {
    /// Shows the wearer one millisecond of `angle_deg` on the screen. Returns the intended speed,
    /// °/s, at most `speed_deg_per_s` in either direction.
    pub(super) fn correct(
        &mut self,
        sight: VisionSpec,
        angle_deg: f64,
        speed_deg_per_s: f64,
    ) -> f64 {
        self.angles.push_back(angle_deg);
        if self.angles.len() as f64 * TICK_S > sight.delay_s + TICK_S {
            self.angles.pop_front();
        }
        self.since += 1;
        let gone_s = f64::from(self.since) * TICK_S;
        if self.meant.is_none() || gone_s >= sight.every_s {
            let seen_deg = self.angles.front().copied().unwrap_or(angle_deg);
            let wanted = (sight.line_deg - seen_deg) / sight.every_s;
            let wanted = wanted.clamp(-speed_deg_per_s, speed_deg_per_s);
            let before = self.meant.map_or(0.0, |(_, meant)| meant);
            (self.meant, self.since) = (Some((before, wanted)), 0);
        }
        let gone_s = f64::from(self.since) * TICK_S;
        let (before, meant) = self.meant.unwrap_or_default();
        before + (meant - before) * minimum_jerk(gone_s / sight.every_s)
    }
}

impl MotorBehaviour {
    /// Returns the voluntary torque at this time and motion, N·m, flexion positive, at most
    /// `push_nm` in either direction.
    pub(super) fn torque_nm(
        &self,
        push_nm: f64,
        seen: &mut VisualFeedback,
        t_s: f64,
        angle_rad: f64,
        rate_rad_per_s: f64,
    ) -> f64 {
        let under_way = |a: &&VoluntaryApproach| (a.at_s..a.at_s + a.for_s).contains(&t_s);
        let approach = self.approaches.iter().find(under_way);
        let meant = match (self.sight, approach) {
            (Some(sight), Some(approach)) => {
                let speed = approach.speed_deg_per_s;
                seen.correct(sight, angle_rad.to_degrees(), speed)
                    .to_radians()
            }
            _ => {
                *seen = VisualFeedback::default();
                self.intended_rad_per_s(t_s, angle_rad)
            }
        };
        let wanted = self.gain_nm_s_per_rad * (meant - rate_rad_per_s);
        wanted.clamp(-push_nm, push_nm)
    }

    /// Returns the intended joint rate of a wearer without visual feedback, rad/s, flexion
    /// positive.
    fn intended_rad_per_s(&self, t_s: f64, angle_rad: f64) -> f64 {
        let under_way = |a: &&VoluntaryApproach| (a.at_s..a.at_s + a.for_s).contains(&t_s);
        match self.approaches.iter().find(under_way) {
            Some(a) => {
                let rise = minimum_jerk((t_s - a.at_s) / self.onset_s);
                rise * a.speed_deg_per_s.to_radians()
            }
            None => {
                let top = self.return_deg_per_s.to_radians();
                let way = self.start_deg.to_radians() - angle_rad;
                (RETURN_PER_S * way).clamp(-top, top)
            }
        }
    }
}

/// Returns the minimum-jerk trajectory from 0 to 1, for u from 0 to 1.
fn minimum_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}
