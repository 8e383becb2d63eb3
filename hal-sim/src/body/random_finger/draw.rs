//! Randomly generated wearers: the ranges of their parameters.

use super::{ExternalTorque, RandomFingerSpec, Twitch};
use crate::body::FingerSpec;
use crate::body::finger::Pair;
use crate::body::wearer::{Participant, Site};
use crate::random::unit;

/// Smallest and largest torque of two conducted points of a random wearer, N·m. **Assumed, not a
/// result**: the gains of both points, each ±50 %, vary it about the middle of 0.484. The range
/// lies between a second point that adds nothing to the nominal 0.22 N·m of one, and Hamana 2022's
/// experiment 2, in which one point gives 0.28 of the strongest pattern (0.22/0.28 = 0.79 N·m).
/// Points that are weak alone are weak together: in every random wearer the second point adds more
/// than the weaker one pulls alone. [`crate::body::hand`] computes the effect of two points from a
/// forearm instead.
pub const TWO_POINTS_NM: [f64; 2] = [0.242, 0.726];

/// Flexor points A and B of the nominal wearer. As a conducted pair they exert 0.484 N·m, the
/// middle of [`TWO_POINTS_NM`]; the last digit of that number keeps existing populations identical
/// to the bit. As an isolated pair they exert no more than one point: the paper found no
/// significant difference (n = 4), which does not prove equality.
const PAIR: Pair = Pair {
    torque_nm: [0.484_000_000_000_000_04, 0.22],
    threshold_v: Participant::P.pair_thresholds_v(),
};

/// Sequence of uniformly distributed random numbers from one seed.
#[derive(Debug, Clone)]
pub struct Draws {
    seed: u64,
    next: u64,
}

impl Draws {
    /// Creates the sequence of wearer `index` of campaign `seed`, stream `stream`.
    pub fn new(seed: u64, index: u64, stream: u64) -> Self {
        // Two rounds of mixing decorrelate neighbouring campaigns and wearers.
        let bits = |seed, index| (unit(seed, index) * (1u64 << 53) as f64) as u64;
        Self {
            seed: bits(bits(seed, index), stream),
            next: 0,
        }
    }

    /// Returns a uniformly distributed number between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        let x = unit(self.seed, self.next);
        self.next += 1;
        low + x * (high - low)
    }

    /// Returns a uniformly distributed factor between 1 - `part` and 1 + `part`.
    pub fn uniform_factor(&mut self, part: f64) -> f64 {
        self.uniform(1.0 - part, 1.0 + part)
    }
}

impl Twitch {
    /// Returns a muscle with this torque and the middle of every random range. Rise and fall lie
    /// between those of the mean of Lee 2020's ten subjects at 50 Hz (τ1 + τ2·x about 0.14 s), the
    /// slow end, and human twitch contraction times (Bawa & Stein 1976: 50 to 90 ms), the fast end.
    /// K gives 20, 50 and 100 Hz about 0.5, 0.85 and 0.95 of full binding, as in Lee's subjects.
    pub fn nominal(torque_nm: f64) -> Self {
        Self {
            torque_nm,
            k: 0.15,
            release_s: 0.007,
            binding_s: 0.030,
            rise_s: 0.090,
            fall_s: 0.100,
            potentiation: 0.0,
            potentiation_s: 5.0,
            best_deg: 0.0,
            width_deg: 186.0,
            fastest_rad_per_s: 40.0,
        }
    }

    fn randomized(nominal: Self, draws: &mut Draws) -> Self {
        Self {
            torque_nm: nominal.torque_nm * draws.uniform_factor(0.5),
            k: nominal.k * draws.uniform(0.4, 2.0),
            release_s: nominal.release_s * draws.uniform_factor(0.5),
            binding_s: nominal.binding_s * draws.uniform_factor(0.4),
            rise_s: nominal.rise_s * draws.uniform_factor(0.4),
            fall_s: nominal.fall_s * draws.uniform_factor(0.4),
            potentiation: draws.uniform(0.0, 0.2),
            potentiation_s: nominal.potentiation_s * draws.uniform_factor(0.5),
            best_deg: nominal.best_deg + draws.uniform(-20.0, 20.0),
            width_deg: nominal.width_deg * draws.uniform_factor(0.25),
            fastest_rad_per_s: nominal.fastest_rad_per_s * draws.uniform_factor(0.5),
        }
    }
}

impl RandomFingerSpec {
    /// Returns the finger that the nominal wearer file describes, with the muscle structure of this
    /// module: participant P, rested, without dry friction. Unlike the muscles of the wearer file,
    /// these depend on length and velocity.
    pub fn nominal() -> Self {
        let mut finger = FingerSpec::participant(Participant::P);
        let flexor = Twitch::nominal(finger.flexor_torque_nm);
        let extensor = Twitch {
            best_deg: finger.stops_deg[1],
            ..Twitch::nominal(finger.extensor_torque_nm)
        };
        finger.fatigue_floor = 1.0;
        finger.pair = Some(PAIR);
        Self {
            finger,
            muscles: [flexor, flexor, extensor],
            static_friction_nm: 0.0,
            coulomb_friction_nm: 0.0,
            stribeck_rad_per_s: 0.1,
            capacity: [1.0; 3],
            external: Vec::new(),
        }
    }

    /// Returns wearer `index` of campaign `seed`. Everything is uniformly distributed and
    /// independent; no draw is rejected.
    ///
    /// The torque of two points is assumed, as a range ([`TWO_POINTS_NM`]). Preregistered: the gain
    /// of each muscle ±50 %, delay 0 to 60 ms, fatigue down to 50 % (a floor of 50…100 %; earlier
    /// work has already taken part of the force above the floor), the recruitment curve of each
    /// point shifted by −5…+20 % of its volts. Assumed, because no paper reports them: dry friction
    /// up to 3 % of one flexor point's nominal torque (3.2° of spring), Stribeck rate 0.05 to 0.5
    /// rad/s, time constant of fatigue 20 to 90 s, recruitment curvature ±50 %, spring ±20 %,
    /// inertia and damping ±30 %, sensor noise 0.1 to 0.6°, sensor lag 5 to 20 ms, and the
    /// constants of the muscles.
    pub fn random(seed: u64, index: u64) -> Self {
        let mut draws = Draws::new(seed, index, 0);
        let mut spec = Self::nominal();
        let floor = draws.uniform(0.5, 1.0);
        for (muscle, capacity) in spec.muscles.iter_mut().zip(&mut spec.capacity) {
            *muscle = Twitch::randomized(*muscle, &mut draws);
            *capacity = draws.uniform(floor, 1.0);
        }
        let f = &mut spec.finger;
        let [a, b, extensor] = f.sites().map(|site| {
            let shift = draws.uniform(0.95, 1.20);
            Site {
                threshold_v: site.threshold_v * shift,
                max_v: site.max_v * shift,
                ..site
            }
        });
        f.place_flexors([a, b]);
        f.extensor = extensor;
        f.electromechanical_delay_us = draws.uniform(0.0, 60_000.0) as u32;
        f.fatigue_floor = floor;
        f.fatigue_time_s = draws.uniform(20.0, 90.0);
        f.recruitment_curvature *= draws.uniform_factor(0.5);
        f.stiffness_nm_per_rad *= draws.uniform_factor(0.2);
        f.inertia_kg_m2 *= draws.uniform_factor(0.3);
        f.damping_nm_s_per_rad *= draws.uniform_factor(0.3);
        f.sensor_noise_deg = draws.uniform(0.1, 0.6);
        f.sensor_lag_s = draws.uniform(0.005, 0.020);
        spec.static_friction_nm = f.flexor_torque_nm * draws.uniform(0.0, 0.03);
        spec.coulomb_friction_nm = spec.static_friction_nm * draws.uniform(0.5, 1.0);
        spec.stribeck_rad_per_s = draws.uniform(0.05, 0.5);
        spec
    }

    /// Returns wearer `index` of campaign `seed` from a wider population: that of [`Self::random`]
    /// with another strength and delay, and disturbances between 10 and 30 s. Everything is
    /// uniformly distributed and independent; no draw is rejected.
    ///
    /// Preregistered: strength 0.5 to 2.8 times that of the nominal wearer (all three muscles; each
    /// ±15 % about it, assumed), delay 0 to 100 ms, an object that is taken and dropped, a knock.
    /// Assumed: the object weighs up to 60 g at 40 mm from the joint (±0.024 N·m, depending on the
    /// orientation of the hand), is taken at 11 to 14 s and dropped at 17 to 20 s; the knock is up
    /// to 2.5 N at the same place (±0.1 N·m) for 10 to 50 ms, at 22 to 24 s.
    pub fn random_wide_range(seed: u64, index: u64) -> Self {
        let mut draws = Draws::new(seed, index, 7);
        let mut spec = Self::random(seed, index);
        let strength = draws.uniform(0.5, 2.8);
        for (muscle, nominal) in spec.muscles.iter_mut().zip(Self::nominal().muscles) {
            muscle.torque_nm = nominal.torque_nm * strength * draws.uniform_factor(0.15);
        }
        spec.finger.electromechanical_delay_us = draws.uniform(0.0, 100_000.0) as u32;
        let mut ms = |low, high| draws.uniform(low, high) as u32;
        let [taken, dropped, knock] =
            [(11e3, 14e3), (17e3, 20e3), (22e3, 24e3)].map(|(low, high)| ms(low, high));
        let knocked_ms = ms(10.0, 50.0);
        let object = ExternalTorque {
            from_ms: taken,
            to_ms: dropped,
            nm: draws.uniform(-0.024, 0.024),
        };
        let knock = ExternalTorque {
            from_ms: knock,
            to_ms: knock + knocked_ms,
            nm: draws.uniform(-0.1, 0.1),
        };
        spec.external = vec![object, knock];
        spec
    }

    /// Returns the torque of both flexor points as a conducted pair, both fully recruited at 50 Hz
    /// and optimal length, before fatigue, N·m. Without a configured pair it is that of the
    /// stronger point.
    pub fn flexor_pair_nm(&self) -> f64 {
        let [a, b, _] = self.muscles.map(|muscle| muscle.torque_nm);
        let single_nm = self.finger.flexor_torque_nm;
        let adds = |pair: Pair| (pair.torque_nm[0] / single_nm - 1.0) * a.min(b);
        a.max(b) + self.finger.pair.map_or(0.0, adds)
    }

    /// Returns the torque of the muscles relative to the nominal wearer, as the mean of the three.
    pub fn strength(&self) -> f64 {
        let nominal = Self::nominal().muscles;
        let ratios = self.muscles.iter().zip(nominal);
        ratios.map(|(m, n)| m.torque_nm / n.torque_nm).sum::<f64>() / 3.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_points_of_drawn_wearers_pull_what_is_declared() {
        let [low, high] = TWO_POINTS_NM;
        let nominal = RandomFingerSpec::nominal().flexor_pair_nm();
        assert!((nominal - 0.5 * (low + high)).abs() < 1e-12, "{nominal}");
        for index in 0..1000 {
            let spec = RandomFingerSpec::random(3, index);
            let pulls = spec.flexor_pair_nm();
            assert!((low..=high).contains(&pulls), "{index}: {pulls}");
            let pair = spec.finger.pair.expect("it is stated");
            let limits = [spec.finger.flexor_a.max_v, spec.finger.flexor_b.max_v];
            for (threshold_v, max_v) in pair.threshold_v.into_iter().zip(limits) {
                assert!((threshold_v / max_v - 0.7).abs() < 1e-12, "{index}");
            }
        }
    }
}
