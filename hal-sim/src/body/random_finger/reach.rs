//! Which angles a finger can hold, while it tires.

use super::{A, B, EXTENSOR, Motion, Points, RandomFingerSpec};

/// An external torque of this length or more is a load, which the muscles must
/// hold; a shorter one is a knock, over before they can, and changes no reach.
const LOAD_MS: u32 = 1000;
/// Steps of the bisection: 100° · 2^-24 is below a hundred-thousandth.
const BISECTIONS: u32 = 24;

/// The range of angles a finger can hold inside given amplitudes, as it tires
/// from following a target as far as it can: quasi-static, knows everything, and
/// depends on no control law.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    spec: RandomFingerSpec,
    /// Recruitment with all flexion, and with all extension; the pair factor of each.
    flexing: ([f64; 3], f64),
    extending: ([f64; 3], f64),
    capacity: [f64; 3],
    potentiation: [f64; 3],
    passed_s: f64,
}

impl Reach {
    /// For the strongest flexion and the strongest extension that the
    /// stimulator gives: effective volts (200 µs into the nominal load) at A, B
    /// and the extensor; zero at a point that is not used.
    pub fn new(spec: &RandomFingerSpec, flexing_v: [f64; 3], extending_v: [f64; 3]) -> Self {
        Self {
            flexing: recruited(spec, flexing_v),
            extending: recruited(spec, extending_v),
            capacity: spec.capacity,
            potentiation: [1.0; 3],
            passed_s: 0.0,
            spec: spec.clone(),
        }
    }

    /// Lowest and highest angle it can hold now, degrees: where torque, spring
    /// and friction at rest balance, coming from rest (highest) or from above
    /// (lowest).
    pub fn range_deg(&self) -> [f64; 2] {
        let hinge = self.spec.hinge();
        let at_rest = self.torque(self.flexing, hinge.rest) + self.load_nm();
        let highest = if at_rest.abs() <= hinge.static_nm {
            hinge.rest
        } else {
            self.balance(self.flexing, -at_rest.signum() * hinge.static_nm)
        };
        let lowest = self.balance(self.extending, hinge.static_nm);
        [lowest.min(highest), highest].map(f64::to_degrees)
    }

    /// The part of the target that can be held now, degrees; then `s` seconds of
    /// holding it pass.
    pub fn hold_reachable_target(&mut self, target_deg: f64, s: f64) -> f64 {
        let [lowest, highest] = self.range_deg();
        let reachable = target_deg.clamp(lowest, highest);
        let forces = self.forces_at(reachable.to_radians());
        for ((muscle, force), (capacity, potentiation)) in self
            .spec
            .muscles
            .iter()
            .zip(forces)
            .zip(self.capacity.iter_mut().zip(&mut self.potentiation))
        {
            *capacity = self.spec.capacity_after(*capacity, force, s);
            let goal = 1.0 + muscle.potentiation * force.min(1.0);
            *potentiation += s / muscle.potentiation_s * (goal - *potentiation);
        }
        self.passed_s += s;
        reachable
    }

    /// Torque at this angle, N·m, of muscles recruited so.
    fn torque(&self, (recruited, pair_factor): ([f64; 3], f64), angle: f64) -> f64 {
        let forces = [0, 1, 2].map(|i| recruited[i] * self.potentiation[i] * self.capacity[i]);
        self.spec
            .torque(forces, pair_factor, Motion { angle, rate: 0.0 })
            .nm
    }

    /// What hangs on the joint now, N·m.
    fn load_nm(&self) -> f64 {
        let now_ms = (self.passed_s * 1000.0).round() as u64;
        let loads = self.spec.external.iter();
        loads
            .filter(|e| e.to_ms.saturating_sub(e.from_ms) >= LOAD_MS && e.acts_at(now_ms))
            .map(|e| e.nm)
            .sum()
    }

    /// Where torque, load, spring and `friction_nm` sum to zero.
    fn balance(&self, recruited: ([f64; 3], f64), friction_nm: f64) -> f64 {
        let hinge = self.spec.hinge();
        let [mut low, mut high] = hinge.stops;
        let given_nm = friction_nm + self.load_nm();
        for _ in 0..BISECTIONS {
            let angle = 0.5 * (low + high);
            let spring = hinge.stiffness * (angle - hinge.rest);
            if self.torque(recruited, angle) + given_nm > spring {
                low = angle;
            } else {
                high = angle;
            }
        }
        0.5 * (low + high)
    }

    /// Force of each muscle, fatigue not included, that holds this angle: linear
    /// between what both sides at rest and one of them at full give.
    fn forces_at(&self, angle: f64) -> [f64; 3] {
        let hinge = self.spec.hinge();
        let (flexing, extending) = (self.flexing.0, self.extending.0);
        let resting = [extending[A], extending[B], flexing[EXTENSOR]];
        let needed = hinge.stiffness * (angle - hinge.rest) - self.load_nm();
        let neutral = self.torque((resting, self.flexing.1), angle);
        let side = if needed > neutral {
            self.flexing
        } else {
            self.extending
        };
        let span = self.torque(side, angle) - neutral;
        let share = if span == 0.0 {
            0.0
        } else {
            ((needed - neutral) / span).clamp(0.0, 1.0)
        };
        [0, 1, 2].map(|i| (resting[i] + share * (side.0[i] - resting[i])) * self.potentiation[i])
    }
}

impl RandomFingerSpec {
    /// Torque of 50 Hz trains of these effective volts at A, B and the extensor
    /// once it has settled, finger at rest at this angle, before any fatigue of
    /// this session, N·m.
    pub fn steady_torque_nm(&self, effective_v: [f64; 3], angle_deg: f64) -> f64 {
        let (shares, factor) = recruited(self, effective_v);
        let forces = [0, 1, 2].map(|i| shares[i] * self.capacity[i]);
        let angle = angle_deg.to_radians();
        self.torque(forces, factor, Motion { angle, rate: 0.0 }).nm
    }
}

/// What trains of these amplitudes recruit, and the factor of the pair.
fn recruited(spec: &RandomFingerSpec, effective_v: [f64; 3]) -> ([f64; 3], f64) {
    let mut points = Points::new(&spec.finger);
    let mut factor = 1.0;
    let mut shares = [0.0; 3];
    // Once for who is paired, once for what that recruits.
    for _ in 0..2 {
        for i in [A, B, EXTENSOR] {
            if effective_v[i] > 0.0 {
                let effect = points.excite(i, 0, effective_v[i], true);
                shares[i] = effect.recruitment;
                factor = effect.pair_factor.unwrap_or(factor);
            }
        }
    }
    (shares, factor)
}
