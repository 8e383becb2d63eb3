//! A hinge with inertia, spring, viscous and Stribeck friction, and stops.

/// Parameters of a joint, in SI units and radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinge {
    /// Moment of inertia, kg·m².
    pub inertia: f64,
    /// Stiffness towards the rest angle, N·m/rad.
    pub stiffness: f64,
    /// Viscous friction, N·m·s/rad.
    pub damping: f64,
    /// Angle at which the spring exerts no torque, rad.
    pub rest: f64,
    /// Inelastic stops, rad, low to high.
    pub stops: [f64; 2],
    /// Dry friction of a joint at rest, N·m.
    pub static_nm: f64,
    /// Dry friction of a joint in motion, N·m; at most `static_nm`.
    pub coulomb_nm: f64,
    /// Stribeck rate, at which 1/e of the difference between both frictions remains, rad/s.
    pub stribeck: f64,
}

/// Muscle torque at a joint rate, and its slope there. The slope is not above zero, because muscles
/// brake the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Torque {
    /// Muscle torque, N·m, flexion positive.
    pub nm: f64,
    /// Derivative of the torque with respect to the joint rate, N·m·s/rad.
    pub slope: f64,
}

/// State of motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Joint angle, rad.
    pub angle: f64,
    /// Joint rate, rad/s.
    pub rate: f64,
}

impl Hinge {
    /// Returns the dry friction at this rate, N·m: Stribeck's curve between `static_nm` and
    /// `coulomb_nm` (Armstrong-Hélouvry 1994: exponent 2).
    fn dry_friction_nm(&self, rate: f64) -> f64 {
        let x = rate / self.stribeck;
        self.coulomb_nm + (self.static_nm - self.coulomb_nm) * libm::exp(-x * x)
    }

    /// Advances I·θ″ = T(θ′) - k·(θ - rest) - B·θ′ - dry·sgn θ′ by one implicit Euler step. T is
    /// linearised at the rate before the step, and the magnitude of the dry friction is taken
    /// there. sgn is set-valued: if the other torques cannot overcome the friction, the joint
    /// sticks exactly.
    ///
    /// The power of every term at the end of the step has the physically correct sign, so that for
    /// T = 0 the energy never grows, with any step and any friction.
    pub fn step(&self, motion: &mut Motion, torque: Torque, h_s: f64) {
        let Motion { angle, rate } = *motion;
        let push = self.inertia / h_s * rate + torque.nm
            - torque.slope * rate
            - self.stiffness * (angle - self.rest);
        let resistance = self.inertia / h_s + self.damping - torque.slope + self.stiffness * h_s;
        let slip = (push.abs() - self.dry_friction_nm(rate)).max(0.0);
        motion.rate = slip.copysign(push) / resistance;
        motion.angle = angle + h_s * motion.rate;
        let [low, high] = self.stops;
        if motion.angle <= low {
            *motion = Motion {
                angle: low,
                rate: motion.rate.max(0.0),
            };
        } else if motion.angle >= high {
            *motion = Motion {
                angle: high,
                rate: motion.rate.min(0.0),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HINGE: Hinge = Hinge {
        inertia: 4e-5,
        stiffness: 0.12,
        damping: 0.018,
        rest: 0.1,
        stops: [0.0, 1.75],
        static_nm: 0.006,
        coulomb_nm: 0.003,
        stribeck: 0.1,
    };
    const NONE: Torque = Torque {
        nm: 0.0,
        slope: 0.0,
    };

    fn energy(hinge: &Hinge, m: &Motion) -> f64 {
        0.5 * hinge.stiffness * (m.angle - hinge.rest).powi(2)
            + 0.5 * hinge.inertia * m.rate * m.rate
    }

    #[test]
    fn a_released_joint_never_gains_energy_and_stops_inside_its_friction() {
        for damping in [0.0, 1e-4, 0.018, 0.1] {
            for (static_nm, coulomb_nm) in [(0.0, 0.0), (0.006, 0.003), (0.05, 0.001)] {
                for h in [1e-4, 1e-3, 5e-3] {
                    let hinge = Hinge {
                        damping,
                        static_nm,
                        coulomb_nm,
                        ..HINGE
                    };
                    let mut m = Motion {
                        angle: 1.5,
                        rate: -20.0,
                    };
                    let start = energy(&hinge, &m);
                    let mut before = start;
                    for _ in 0..(20.0 / h) as u32 {
                        hinge.step(&mut m, NONE, h);
                        let now = energy(&hinge, &m);
                        // The tolerance covers only the rounding of the angle near rest.
                        assert!(now <= before + 1e-16 * start, "{hinge:?} {h}");
                        before = now;
                    }
                    let off = hinge.stiffness * (m.angle - hinge.rest).abs();
                    let is_at_rest = m.rate.abs() < 1e-6 && off <= static_nm + 1e-6;
                    // Without any friction the joint oscillates on.
                    assert!(
                        is_at_rest || damping + static_nm == 0.0,
                        "{hinge:?} {h} {m:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn less_than_static_friction_moves_nothing_and_more_does() {
        let mut m = Motion {
            angle: HINGE.rest,
            rate: 0.0,
        };
        let torque = |nm| Torque { nm, slope: 0.0 };
        for _ in 0..10_000 {
            HINGE.step(&mut m, torque(0.0059), 1e-3);
        }
        assert_eq!((m.angle, m.rate), (HINGE.rest, 0.0));
        for _ in 0..10_000 {
            HINGE.step(&mut m, torque(0.0061), 1e-3);
        }
        // The joint comes to rest where spring and dry friction balance, past the angle that the
        // spring alone would allow with static friction.
        assert!(m.angle > HINGE.rest + 1e-4);
    }

    /// Compares with an explicit solution in 2000 substeps, with a smoothed sign function.
    #[test]
    fn a_millisecond_agrees_with_a_fine_explicit_solution() {
        let mut m = Motion {
            angle: 0.1,
            rate: 0.0,
        };
        let (mut angle, mut rate) = (0.1, 0.0);
        let (fine, h) = (2000, 1e-3);
        let dt = h / f64::from(fine);
        let mut worst: f64 = 0.0;
        for n in 0..3000 {
            let nm = 0.1 + 0.1 * libm::sin(f64::from(n) * h * 3.0);
            HINGE.step(&mut m, Torque { nm, slope: 0.0 }, h);
            for _ in 0..fine {
                let dry = HINGE.dry_friction_nm(rate) * (rate / 1e-4).clamp(-1.0, 1.0);
                let net = nm - HINGE.stiffness * (angle - HINGE.rest) - HINGE.damping * rate - dry;
                rate += dt * net / HINGE.inertia;
                angle += dt * rate;
            }
            worst = worst.max((m.angle - angle).abs());
        }
        // The tolerance is 0.25 degrees; the first-order error of the joint is half a step of
        // motion.
        assert!(worst < 0.25f64.to_radians(), "{}", worst.to_degrees());
    }
}
