//! Simulates the virtual object between both hands: a god-object for each hand, connected to the
//! hand by an impedance.

use super::calibration::ARMS;
use hal_sim::body::sagittal::GRAVITY_M_S2;

/// Mass of the object, and its connection to the hands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectSpec {
    pub mass_kg: f64,
    /// Stiffness of the spring from each hand to its god-object, N/m.
    pub stiffness_n_per_m: f64,
    /// Damping of the same connection, as a fraction of the object's critical damping on both
    /// springs.
    pub damping: f64,
}

/// The moving object. The god-object of each hand stays where the hand took hold, since it cannot
/// slide along the object's sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    spec: ObjectSpec,
    damping_n_s_per_m: f64,
    at_m: [f64; 2],
    rate_m_s: [f64; 2],
    table_m: f64,
}

impl Object {
    /// Creates the object on the table, in both hands.
    #[must_use]
    pub fn grasped(spec: ObjectSpec, at_m: [f64; 2]) -> Self {
        let total_n_per_m = ARMS as f64 * spec.stiffness_n_per_m;
        let critical = 2.0 * (total_n_per_m * spec.mass_kg).sqrt();
        Self {
            spec,
            damping_n_s_per_m: spec.damping * critical / ARMS as f64,
            at_m,
            rate_m_s: [0.0; 2],
            table_m: at_m[1],
        }
    }

    /// Returns the force of the impedance on a hand with this position and velocity, N.
    #[must_use]
    pub fn force_n(&self, (at_m, rate_m_s): ([f64; 2], [f64; 2])) -> [f64; 2] {
        std::array::from_fn(|axis| {
            self.spec.stiffness_n_per_m * (self.at_m[axis] - at_m[axis])
                + self.damping_n_s_per_m * (self.rate_m_s[axis] - rate_m_s[axis])
        })
    }

    /// Advances the object by `h_s`, s, under gravity and the forces of the hands. The object
    /// cannot sink below the table.
    pub fn step(&mut self, h_s: f64, hands: &[([f64; 2], [f64; 2]); ARMS]) {
        let mut force = [0.0, -self.spec.mass_kg * GRAVITY_M_S2];
        for hand in hands {
            let own = self.force_n(*hand);
            force[0] -= own[0];
            force[1] -= own[1];
        }
        let moved = self.at_m.iter_mut().zip(&mut self.rate_m_s);
        for ((at, rate), force) in moved.zip(force) {
            *rate += h_s * force / self.spec.mass_kg;
            *at += h_s * *rate;
        }
        if self.at_m[1] < self.table_m {
            (self.at_m[1], self.rate_m_s[1]) = (self.table_m, 0.0);
        }
    }
}
