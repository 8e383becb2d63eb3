//! Dynamics of two segments about shoulder and elbow in the sagittal plane.

use super::{ELBOW, JOINTS, SHOULDER};
use crate::body::arm::{FOREARM, HAND, UPPER_ARM};

pub use crate::body::arm::GRAVITY_M_S2;

/// Upper arm, and forearm with hand. The angles of both segments are measured from hanging down; x
/// points forward, z up, from the shoulder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Links {
    /// Distance from shoulder to elbow, m.
    pub upper_m: f64,
    /// Distance from the elbow to the middle of the hand, m.
    pub fore_m: f64,
    /// Inertia about the shoulder (with the mass of the forearm at the elbow), inertia about the
    /// elbow, and coupling inertia, kg m².
    inertia: [f64; 3],
    /// Moments of weight about shoulder and elbow with the segments horizontal, N m.
    weight_nm: [f64; 2],
}

impl Links {
    /// Computes the segments for this stature and body mass; `added_kg_m2` is added to the inertias
    /// of elbow and shoulder.
    #[must_use]
    pub fn new(stature_m: f64, mass_kg: f64, added_kg_m2: [f64; JOINTS]) -> Self {
        let [upper, fore, hand] = [UPPER_ARM, FOREARM, HAND].map(|values| {
            let [length, mass, centre, gyration] = values;
            let length_m = length * stature_m;
            let own = mass * mass_kg;
            (
                length_m,
                own,
                centre * length_m,
                own * (gyration * length_m).powi(2),
            )
        });
        let hand_m = fore.0 + hand.2;
        let first_moment = fore.1 * fore.2 + hand.1 * hand_m;
        let beyond = fore.1 + hand.1;
        let elbow = fore.3 + fore.1 * fore.2.powi(2) + hand.3 + hand.1 * hand_m.powi(2);
        let shoulder = upper.3 + upper.1 * upper.2.powi(2) + beyond * upper.0.powi(2);
        Self {
            upper_m: upper.0,
            fore_m: hand_m,
            inertia: [
                shoulder + added_kg_m2[SHOULDER],
                elbow + added_kg_m2[ELBOW],
                upper.0 * first_moment,
            ],
            weight_nm: [
                GRAVITY_M_S2 * (upper.1 * upper.2 + beyond * upper.0),
                GRAVITY_M_S2 * first_moment,
            ],
        }
    }

    /// Returns the distance from shoulder to hand with the arm straight, m.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.upper_m + self.fore_m
    }

    /// Returns the inertias about elbow and shoulder in a posture with this mass in the hand, kg
    /// m².
    #[must_use]
    pub fn inertias(&self, q: [f64; JOINTS], hand_kg: f64) -> [f64; JOINTS] {
        let [x, z] = self.hand_m(q);
        let [own_s, own_f, both] = self.mass(q);
        [
            own_f + hand_kg * self.fore_m.powi(2),
            own_s + own_f + 2.0 * both + hand_kg * (x * x + z * z),
        ]
    }

    /// Returns the position of the hand at these flexions of elbow and shoulder, rad: x and z, m.
    #[must_use]
    pub fn hand_m(&self, q: [f64; JOINTS]) -> [f64; 2] {
        let (s, f) = (q[SHOULDER], q[SHOULDER] + q[ELBOW]);
        [
            self.upper_m * libm::sin(s) + self.fore_m * libm::sin(f),
            -self.upper_m * libm::cos(s) - self.fore_m * libm::cos(f),
        ]
    }

    /// Returns the velocity of the hand, m/s.
    #[must_use]
    pub fn hand_rate_m_s(&self, q: [f64; JOINTS], rate: [f64; JOINTS]) -> [f64; 2] {
        let (s, f) = (q[SHOULDER], q[SHOULDER] + q[ELBOW]);
        let (ds, df) = (rate[SHOULDER], rate[SHOULDER] + rate[ELBOW]);
        [
            self.upper_m * libm::cos(s) * ds + self.fore_m * libm::cos(f) * df,
            self.upper_m * libm::sin(s) * ds + self.fore_m * libm::sin(f) * df,
        ]
    }

    /// Returns the flexions of elbow and shoulder that put the hand at this position, rad. For a
    /// position out of reach, the elbow is straight and the arm points towards it.
    #[must_use]
    pub fn flexions(&self, [x, z]: [f64; 2]) -> [f64; JOINTS] {
        let (a, b) = (self.upper_m, self.fore_m);
        let bent = (x * x + z * z - a * a - b * b) / (2.0 * a * b);
        let elbow = libm::acos(bent.clamp(-1.0, 1.0));
        let shoulder =
            libm::atan2(x, -z) - libm::atan2(b * libm::sin(elbow), a + b * libm::cos(elbow));
        [elbow, shoulder]
    }

    /// Returns the torques of elbow and shoulder that cause this acceleration, with a force (x, z)
    /// on the hand, N m.
    #[must_use]
    pub fn torques_nm(
        &self,
        q: [f64; JOINTS],
        rate: [f64; JOINTS],
        acceleration: [f64; JOINTS],
        hand_n: [f64; 2],
    ) -> [f64; JOINTS] {
        let (ds, df) = (
            acceleration[SHOULDER],
            acceleration[SHOULDER] + acceleration[ELBOW],
        );
        let [own_s, own_f, both] = self.mass(q);
        let [left_s, left_f] = self.load_moments_nm(q, rate, hand_n);
        let (s, f) = (
            own_s * ds + both * df - left_s,
            both * ds + own_f * df - left_f,
        );
        [f, s + f]
    }

    /// Returns the accelerations of elbow and shoulder under these torques, rad/s².
    #[must_use]
    pub fn accelerations(
        &self,
        q: [f64; JOINTS],
        rate: [f64; JOINTS],
        torque_nm: [f64; JOINTS],
        hand_n: [f64; 2],
    ) -> [f64; JOINTS] {
        let [own_s, own_f, both] = self.mass(q);
        let [left_s, left_f] = self.load_moments_nm(q, rate, hand_n);
        let s = torque_nm[SHOULDER] - torque_nm[ELBOW] + left_s;
        let f = torque_nm[ELBOW] + left_f;
        let determinant = own_s * own_f - both * both;
        let ds = (own_f * s - both * f) / determinant;
        let df = (own_s * f - both * s) / determinant;
        [df - ds, ds]
    }

    /// Returns the inertias of both segments and the coupling inertia at this elbow angle, kg m².
    fn mass(&self, q: [f64; JOINTS]) -> [f64; 3] {
        let [own_s, own_f, both] = self.inertia;
        [own_s, own_f, both * libm::cos(q[ELBOW])]
    }

    /// Returns the moments of weight, motion and the force on the hand on both segments, N m.
    fn load_moments_nm(&self, q: [f64; JOINTS], rate: [f64; JOINTS], [x, z]: [f64; 2]) -> [f64; 2] {
        let (s, f) = (q[SHOULDER], q[SHOULDER] + q[ELBOW]);
        let (ds, df) = (rate[SHOULDER], rate[SHOULDER] + rate[ELBOW]);
        // Identity: sin(s − f) = −sin(elbow).
        let bent = self.inertia[2] * libm::sin(q[ELBOW]);
        let hand = |length: f64, angle: f64| length * (libm::cos(angle) * x + libm::sin(angle) * z);
        [
            bent * df * df - self.weight_nm[0] * libm::sin(s) + hand(self.upper_m, s),
            -bent * ds * ds - self.weight_nm[1] * libm::sin(f) + hand(self.fore_m, f),
        ]
    }
}
