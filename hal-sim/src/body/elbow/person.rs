//! What the person does of their own will.

use super::spec::{Approach, Person};

/// How fast the arm heads for its start angle when it goes back, 1/s.
const RETURN_PER_S: f64 = 4.0;

impl Person {
    /// Voluntary torque at this time and motion, N·m, flexion positive.
    pub(super) fn torque_nm(&self, t_s: f64, angle_rad: f64, rate_rad_per_s: f64) -> f64 {
        let meant = self.meant_rad_per_s(t_s, angle_rad);
        let wanted = self.gain_nm_s_per_rad * (meant - rate_rad_per_s);
        wanted.clamp(-self.push_nm, self.push_nm)
    }

    /// The rate the person means to move at, rad/s.
    fn meant_rad_per_s(&self, t_s: f64, angle_rad: f64) -> f64 {
        let under_way = |a: &&Approach| (a.at_s..a.at_s + a.for_s).contains(&t_s);
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

/// The course from 0 to 1 with the least jerk, for u from 0 to 1.
fn minimum_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)
}
