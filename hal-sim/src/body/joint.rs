//! A hinge with inertia, spring, viscous friction and stops.

/// Parameters of a hinge with a spring, viscous friction and stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct JointSpec {
    /// Moment of inertia about the axis, kg·m².
    pub inertia_kg_m2: f64,
    /// Stiffness towards the rest angle, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    pub damping_nm_s_per_rad: f64,
    /// Angle at which the spring exerts no torque, °.
    pub rest_deg: f64,
    /// Inelastic stops, low to high, °.
    pub stops_deg: [f64; 2],
}

/// Angle and rate of the joint, and the exact solution of I·θ″ + B·θ′ + k·(θ - rest) = torque over
/// one time step with constant torque.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Joint {
    pub angle_rad: f64,
    pub rate_rad_per_s: f64,
    rest_rad: f64,
    stops_rad: [f64; 2],
    stiffness: f64,
    transition: [[f64; 2]; 2],
}

impl Joint {
    pub fn new(spec: &JointSpec, h_s: f64) -> Self {
        // The roots are -a ± √(a² - w²): hyperbolic functions when overdamped, else circular ones.
        let a = 0.5 * spec.damping_nm_s_per_rad / spec.inertia_kg_m2;
        let w2 = spec.stiffness_nm_per_rad / spec.inertia_kg_m2;
        let d = (a * a - w2).abs().sqrt();
        let (cosine, sine) = if a * a >= w2 {
            (libm::cosh(d * h_s), libm::sinh(d * h_s))
        } else {
            (libm::cos(d * h_s), libm::sin(d * h_s))
        };
        let sine = if d == 0.0 { h_s } else { sine / d };
        let decay = libm::exp(-a * h_s);
        Self {
            angle_rad: spec.rest_deg.to_radians(),
            rate_rad_per_s: 0.0,
            rest_rad: spec.rest_deg.to_radians(),
            stops_rad: spec.stops_deg.map(f64::to_radians),
            stiffness: spec.stiffness_nm_per_rad,
            transition: [
                [decay * (cosine + a * sine), decay * sine],
                [-w2 * decay * sine, decay * (cosine - a * sine)],
            ],
        }
    }

    /// Advances by one step under `torque_nm`, flexion positive. A stop absorbs all momentum.
    pub fn step(&mut self, torque_nm: f64) {
        let equilibrium = self.rest_rad + torque_nm / self.stiffness;
        let x = self.angle_rad - equilibrium;
        let v = self.rate_rad_per_s;
        let [[a, b], [c, d]] = self.transition;
        self.angle_rad = equilibrium + a * x + b * v;
        self.rate_rad_per_s = c * x + d * v;
        let [low, high] = self.stops_rad;
        if self.angle_rad <= low {
            self.angle_rad = low;
            self.rate_rad_per_s = self.rate_rad_per_s.max(0.0);
        } else if self.angle_rad >= high {
            self.angle_rad = high;
            self.rate_rad_per_s = self.rate_rad_per_s.min(0.0);
        }
    }

    /// Returns the position within the range of motion, 0 at the low stop and 1 at the high one.
    pub fn progress(&self) -> f64 {
        let [low, high] = self.stops_rad;
        (self.angle_rad - low) / (high - low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the finger of participant P.
    fn spec() -> JointSpec {
        JointSpec {
            inertia_kg_m2: 4e-5,
            stiffness_nm_per_rad: 0.12,
            damping_nm_s_per_rad: 0.018,
            rest_deg: 5.0,
            stops_deg: [0.0, 100.0],
        }
    }

    /// Returns the energy in the spring and the motion, J.
    fn energy(joint: &Joint, spec: &JointSpec) -> f64 {
        let x = joint.angle_rad - spec.rest_deg.to_radians();
        0.5 * spec.stiffness_nm_per_rad * x * x
            + 0.5 * spec.inertia_kg_m2 * joint.rate_rad_per_s * joint.rate_rad_per_s
    }

    #[test]
    fn a_released_finger_loses_energy_every_step_and_comes_to_rest() {
        // Damping with real, double and complex roots.
        let critical = 2.0 * (4e-5f64 * 0.12).sqrt();
        for damping in [0.018, critical, 0.0005] {
            let spec = JointSpec {
                damping_nm_s_per_rad: damping,
                ..spec()
            };
            let mut joint = Joint::new(&spec, 1e-3);
            joint.angle_rad = 90f64.to_radians();
            let start = energy(&joint, &spec);
            let mut before = start;
            for _ in 0..5000 {
                joint.step(0.0);
                let now = energy(&joint, &spec);
                // The tolerance covers only the rounding of the angle near rest.
                assert!(now <= before + 1e-16 * start, "{damping}: {before} {now}");
                before = now;
            }
            assert!((joint.angle_rad.to_degrees() - 5.0).abs() < 1e-6);
        }
    }

    #[test]
    fn an_undamped_finger_keeps_its_energy() {
        let spec = JointSpec {
            damping_nm_s_per_rad: 0.0,
            rest_deg: 50.0,
            ..spec()
        };
        let mut joint = Joint::new(&spec, 1e-3);
        joint.angle_rad = 80f64.to_radians();
        let start = energy(&joint, &spec);
        for _ in 0..10_000 {
            joint.step(0.0);
        }
        assert!((energy(&joint, &spec) / start - 1.0).abs() < 1e-10);
    }

    #[test]
    fn a_step_agrees_with_many_small_explicit_ones() {
        let spec = spec();
        let mut joint = Joint::new(&spec, 1e-3);
        for _ in 0..100 {
            joint.step(0.1);
        }
        let (mut angle, mut rate) = (5f64.to_radians(), 0.0);
        let n = 1_000_000;
        let h = 0.1 / f64::from(n);
        for _ in 0..n {
            let torque = 0.1 - 0.018 * rate - 0.12 * (angle - 5f64.to_radians());
            rate += h * torque / 4e-5;
            angle += h * rate;
        }
        assert!((joint.angle_rad - angle).abs() < 1e-5);
        assert!((joint.rate_rad_per_s - rate).abs() < 1e-4);
    }

    #[test]
    fn stops_hold_against_any_torque_and_let_go_at_once() {
        let mut joint = Joint::new(&spec(), 1e-3);
        for torque in [50.0, -50.0, 0.5, -0.5] {
            for _ in 0..1000 {
                joint.step(torque);
                assert!((0.0..=100f64.to_radians()).contains(&joint.angle_rad));
            }
            assert_eq!(joint.rate_rad_per_s, 0.0);
            let stop = if torque > 0.0 { 100f64 } else { 0.0 };
            assert_eq!(joint.angle_rad, stop.to_radians());
            joint.step(-torque.signum() * 0.3);
            assert_ne!(joint.angle_rad, stop.to_radians());
        }
    }
}
