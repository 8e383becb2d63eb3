//! Range of angles that a finger can hold as it fatigues.

use super::{A, B, EXTENSOR, Motion, Points, RandomFingerSpec};

/// Smallest duration of an external torque that counts as a load, which the muscles must hold, ms.
/// A shorter one is a knock: it ends before they can respond and does not change the reach.
const LOAD_MS: u32 = 1000;
/// Number of bisection steps: 100° · 2^-24 is below a hundred-thousandth.
const BISECTIONS: u32 = 24;

/// The range of angles that a finger can hold with given amplitudes, while it fatigues from
/// following a reference as far as possible. The model is quasi-static, has complete knowledge, and
/// is independent of the control law.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    spec: RandomFingerSpec,
    /// Recruitment of each muscle during the strongest flexion, and the pair factor.
    flexing: ([f64; 3], f64),
    /// Recruitment of each muscle during the strongest extension, and the pair factor.
    extending: ([f64; 3], f64),
    capacity: [f64; 3],
    potentiation: [f64; 3],
    passed_s: f64,
}

impl Reach {
    /// Prepares the range for the strongest flexion and the strongest extension that the stimulator
    /// outputs: effective volts (200 µs into the nominal load) at A, B and the extensor; zero at an
    /// unused point.
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

    /// Returns the smallest and the largest angle that the finger can hold now, degrees: the angles
    /// at which torque, spring and static friction balance, approached from rest (largest) or from
    /// above (smallest).
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

    /// Returns the angle nearest to the target that the finger can hold now, degrees, and advances
    /// by `s` seconds in which it holds that angle.
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

    /// Returns the torque at this angle with this recruitment, N·m.
    fn torque(&self, (recruited, pair_factor): ([f64; 3], f64), angle: f64) -> f64 {
        let forces = [0, 1, 2].map(|i| recruited[i] * self.potentiation[i] * self.capacity[i]);
        self.spec
            .torque(forces, pair_factor, Motion { angle, rate: 0.0 })
            .nm
    }

    /// Returns the external load on the joint now, N·m.
    fn load_nm(&self) -> f64 {
        let now_ms = (self.passed_s * 1000.0).round() as u64;
        let loads = self.spec.external.iter();
        loads
            .filter(|e| e.to_ms.saturating_sub(e.from_ms) >= LOAD_MS && e.acts_at(now_ms))
            .map(|e| e.nm)
            .sum()
    }

    /// Returns the angle at which torque, load, spring and `friction_nm` sum to zero, rad.
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

    /// Returns the force with which each muscle holds this angle, without fatigue. The forces are
    /// interpolated linearly between those at rest and those at full recruitment of the flexors or
    /// of the extensor, whichever is needed.
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
    /// Returns the settled torque of 50 Hz trains of these effective volts at A, B and the
    /// extensor, N·m, with the finger at rest at this angle and before any fatigue of this session.
    pub fn steady_torque_nm(&self, effective_v: [f64; 3], angle_deg: f64) -> f64 {
        let (shares, factor) = recruited(self, effective_v);
        let forces = [0, 1, 2].map(|i| shares[i] * self.capacity[i]);
        let angle = angle_deg.to_radians();
        self.torque(forces, factor, Motion { angle, rate: 0.0 }).nm
    }
}

/// Returns the shares that trains of these amplitudes recruit, and the pair factor.
fn recruited(spec: &RandomFingerSpec, effective_v: [f64; 3]) -> ([f64; 3], f64) {
    let mut points = Points::new(&spec.finger);
    let mut factor = 1.0;
    let mut shares = [0.0; 3];
    // The first pass determines which points are paired, the second the recruitment of the pair.
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
