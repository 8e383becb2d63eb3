//! A muscle whose structure differs from the calcium-force model: a cascaded twitch with
//! potentiation, and Hill's dependence on length and velocity.

use crate::body::finger::TORQUE_FREQUENCY_HZ;

/// Parameters of one muscle. C is the output of two first-order stages in series (release and
/// binding), of which each pulse increments the first by one; r is the share of fibres that the
/// last pulse recruited:
///
/// ```text
/// c1' = Σ δ(t - ti) - c1/τ1      c2' = (c1 - c2)/τ2      x = c2²/(c2² + K²)
/// S = r·p·x/x50                  F' = (S - F)/τ,  τ = τ_rise if S > F, else τ_fall
/// p' = (1 + P·F - p)/τp          T = A·w·F·l(θ)·v(θ′)
/// ```
///
/// x50 is the mean of x at 50 Hz, so that F = 1 there at full recruitment; w is the share that
/// fatigue leaves. The structure differs from every model level of the firmware: second-order
/// calcium (Mannard & Stein 1973 found muscle to be a second-order low-pass; Riener & Fuhr 1998 use
/// two equal stages), cooperative binding with exponent 2 (Hill), a time constant that depends on
/// the direction (Zajac 1989), staircase potentiation (Rassier & MacIntosh 2000), force-length as a
/// Gaussian and force-velocity as Hill's hyperbola with its lengthening branch (Zajac 1989).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twitch {
    /// A, torque at full recruitment and 50 Hz, at optimal length and at rest, N·m.
    pub torque_nm: f64,
    /// K, half-saturation of binding, in units of c2 (one pulse increments c1 by 1).
    pub k: f64,
    /// τ1, time constant of calcium release, s.
    pub release_s: f64,
    /// τ2, time constant of binding, s; not equal to τ1.
    pub binding_s: f64,
    /// τ_rise, time constant of rising force, s.
    pub rise_s: f64,
    /// τ_fall, time constant of falling force, s.
    pub fall_s: f64,
    /// P, relative increase of force by potentiation under sustained full activity.
    pub potentiation: f64,
    /// τp, time constant of potentiation, s.
    pub potentiation_s: f64,
    /// Angle of optimal length, degrees.
    pub best_deg: f64,
    /// Width of the force-length curve, degrees: the factor is e^-1 at this distance from the
    /// optimum.
    pub width_deg: f64,
    /// Joint rate at which a shortening muscle has no force left, rad/s.
    pub fastest_rad_per_s: f64,
}

/// Hill's shape factor, a/F0 (Zajac 1989: about 0.25).
const HILL: f64 = 0.25;
/// Force of a muscle that lengthens fast, over the isometric force (Zajac 1989: 1.1 to 1.8).
const LENGTHENING: f64 = 1.4;

impl Twitch {
    /// Returns the force-length factor, 0 to 1.
    pub fn length_factor(&self, angle_deg: f64) -> f64 {
        let x = (angle_deg - self.best_deg) / self.width_deg;
        libm::exp(-x * x)
    }

    /// Returns the force-velocity factor at this rate of shortening, rad/s, and its slope, s/rad.
    /// The factor never rises with the rate, and it is continuous.
    pub fn velocity_factor(&self, shortening: f64) -> [f64; 2] {
        let v = shortening / self.fastest_rad_per_s;
        let [factor, slope] = if v >= 1.0 {
            [0.0, 0.0]
        } else if v >= 0.0 {
            let d = 1.0 + v / HILL;
            [(1.0 - v) / d, -(1.0 + 1.0 / HILL) / (d * d)]
        } else {
            let knee = (LENGTHENING - 1.0) / (1.0 + 1.0 / HILL);
            let d = knee - v;
            [
                1.0 - (LENGTHENING - 1.0) * v / d,
                -(LENGTHENING - 1.0) * knee / (d * d),
            ]
        };
        [factor, slope / self.fastest_rad_per_s]
    }
}

/// State of one muscle and the constants of its time step of 1 ms.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TwitchState {
    twitch: Twitch,
    /// Share of fibres that the last pulse recruited.
    recruited: f64,
    calcium: [f64; 2],
    /// Contribution of this millisecond's pulses to the calcium at its end.
    arriving: [f64; 2],
    bound: f64,
    /// Force F, with potentiation and without fatigue.
    pub force: f64,
    pub potentiation: f64,
    /// Remaining shares of c1, c2, rising F and falling F after a millisecond.
    left: [f64; 4],
    mean_bound: f64,
}

const TICK_S: f64 = 1e-3;

impl TwitchState {
    /// Creates a rested muscle.
    pub fn new(twitch: Twitch) -> Self {
        let left = [
            twitch.release_s,
            twitch.binding_s,
            twitch.rise_s,
            twitch.fall_s,
        ];
        let mut muscle = Self {
            twitch,
            recruited: 0.0,
            calcium: [0.0; 2],
            arriving: [0.0; 2],
            bound: 0.0,
            force: 0.0,
            potentiation: 1.0,
            left: left.map(|tau| libm::exp(-TICK_S / tau)),
            mean_bound: 1.0,
        };
        muscle.mean_bound = muscle.clone().bound_at_50_hz();
        muscle
    }

    /// Returns the mean of x over a period at 50 Hz, after enough periods for the rise to end.
    fn bound_at_50_hz(mut self) -> f64 {
        let ticks = (1.0 / (TORQUE_FREQUENCY_HZ * TICK_S)) as usize;
        let periods = (20.0 * self.twitch.binding_s * TORQUE_FREQUENCY_HZ) as usize + 1;
        let mut sum = 0.0;
        for _ in 0..periods {
            self.pulse(1.0, 1.0);
            sum = 0.0;
            for _ in 0..ticks {
                sum += self.step_calcium();
            }
        }
        sum / ticks as f64
    }

    /// Applies a pulse within the next millisecond; `before_end` is the share of that millisecond,
    /// 0 to 1, that remains after the pulse. The calcium is exact; the recruitment applies to the
    /// whole millisecond.
    pub fn pulse(&mut self, recruited: f64, before_end: f64) {
        let s = before_end * TICK_S;
        let [t1, t2] = [self.twitch.release_s, self.twitch.binding_s];
        let [e1, e2] = [libm::exp(-s / t1), libm::exp(-s / t2)];
        self.arriving[0] += e1;
        self.arriving[1] += t1 / (t1 - t2) * (e1 - e2);
        self.recruited = recruited;
    }

    /// Advances the calcium by a millisecond and returns the mean of x in it.
    fn step_calcium(&mut self) -> f64 {
        let before = self.bound;
        let [t1, t2] = [self.twitch.release_s, self.twitch.binding_s];
        let [e1, e2, ..] = self.left;
        let [c1, c2] = self.calcium;
        let [a1, a2] = std::mem::take(&mut self.arriving);
        self.calcium = [c1 * e1 + a1, c2 * e2 + t1 / (t1 - t2) * (e1 - e2) * c1 + a2];
        let square = self.calcium[1] * self.calcium[1];
        self.bound = square / (square + self.twitch.k * self.twitch.k);
        0.5 * (before + self.bound)
    }

    /// Advances by a millisecond and returns the mean force in it.
    pub fn step(&mut self) -> f64 {
        let bound = self.step_calcium();
        let steady = self.recruited * self.potentiation * bound / self.mean_bound;
        let left = self.left[if steady > self.force { 2 } else { 3 }];
        let before = self.force;
        self.force = steady + (before - steady) * left;
        let p = 1.0 + self.twitch.potentiation * before.min(1.0);
        self.potentiation += TICK_S / self.twitch.potentiation_s * (p - self.potentiation);
        0.5 * (before + self.force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the mean force in the last of three seconds, with a pulse every `every_ms`.
    fn force_at(every_ms: u32, recruited: f64) -> f64 {
        let mut muscle = TwitchState::new(Twitch::nominal(0.2));
        let mut sum = 0.0;
        for ms in 0..3000 {
            if ms % every_ms == 0 {
                muscle.pulse(recruited, 1.0);
            }
            let force = muscle.step();
            sum += if ms >= 2000 { force } else { 0.0 };
        }
        sum / 1000.0
    }

    #[test]
    fn a_fifty_hertz_train_settles_at_its_recruitment() {
        for recruited in [1.0, 0.5, 0.1] {
            let force = force_at(20, recruited);
            assert!(
                (force / recruited - 1.0).abs() < 0.02,
                "{recruited}: {force}"
            );
        }
        // Force falls at a lower rate and rises at a higher rate, but never doubles.
        assert!(force_at(50, 1.0) < 0.9);
        assert!((1.0..2.0).contains(&force_at(10, 1.0)));
    }

    #[test]
    fn a_pulse_inside_a_millisecond_is_worth_the_same() {
        let area = |before_end| {
            let mut muscle = TwitchState::new(Twitch::nominal(0.2));
            muscle.pulse(1.0, before_end);
            (0..3000).map(|_| muscle.step()).sum::<f64>()
        };
        assert!((area(0.5) / area(1.0) - 1.0).abs() < 0.02);
    }

    #[test]
    fn the_velocity_factor_falls_without_a_step_and_its_slope_is_its_own() {
        let twitch = Twitch::nominal(0.2);
        let mut before = twitch.velocity_factor(-60.0)[0];
        assert!(before < LENGTHENING);
        for n in -599..=600 {
            let v = f64::from(n) * 0.1;
            let [factor, slope] = twitch.velocity_factor(v);
            assert!(factor <= before && before - factor < 0.03, "{v}");
            let [a, b] = [v - 1e-6, v + 1e-6].map(|v| twitch.velocity_factor(v)[0]);
            let is_corner = (v - twitch.fastest_rad_per_s).abs() < 1e-5;
            assert!(is_corner || (slope - (b - a) / 2e-6).abs() < 1e-4, "{v}");
            before = factor;
        }
        assert_eq!(twitch.velocity_factor(0.0)[0], 1.0);
    }
}
