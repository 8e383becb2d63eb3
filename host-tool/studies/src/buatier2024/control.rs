//! Simulates voluntary control of an arm: feed-forward torque, delayed feedback, and distribution
//! of the torque over the muscles.

use super::person::VoluntaryMotion;
use super::way::{LiftTrajectory, RATE_HZ};
use hal_sim::body::sagittal::{Intent, JOINTS, Links, MUSCLES};
use hal_sim::random;
use host_core::limb::Muscles;

/// Number of sections of a movement for which feedback is remembered.
const PARTS: usize = 24;

/// Feedback torque that was learnt for each section of a movement, N m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LearntTorque([[f64; JOINTS]; PARTS]);

impl LearntTorque {
    /// Learnt torque before the first lift: 0 in every section.
    pub const NOTHING: Self = Self([[0.0; JOINTS]; PARTS]);
}

/// Control of one arm during one lift.
#[derive(Clone, Debug)]
pub struct Control {
    will: VoluntaryMotion,
    object_kg: f64,
    late: usize,
    seen: Vec<([f64; JOINTS], [f64; JOINTS])>,
    noise: [f64; MUSCLES],
    deviates: u64,
    seed: u64,
    drive: [f64; MUSCLES],
    felt: [([f64; JOINTS], u32); PARTS],
    weak: u64,
}

impl Control {
    /// Starts a lift; `seed` determines the noise of the muscle drives.
    #[must_use]
    pub fn new(will: VoluntaryMotion, object_kg: f64, seed: u64) -> Self {
        Self {
            late: (will.delay_s * RATE_HZ).round() as usize,
            object_kg: object_kg * (1.0 + will.judged_load),
            will,
            seen: Vec::new(),
            noise: std::array::from_fn(|n| random::standard_normal(seed, n as u64)),
            deviates: MUSCLES as u64,
            seed,
            drive: [0.0; MUSCLES],
            felt: [([0.0; JOINTS], 0); PARTS],
            weak: 0,
        }
    }

    /// Returns the number of steps in which no drives could produce the required torque.
    #[must_use]
    pub const fn infeasible_steps(&self) -> u64 {
        self.weak
    }

    /// Computes the muscle drives and the intended motion at step `n` of the movement. `state` has
    /// the arm's flexions, rad, and rates, rad/s; `full_nm` has the torques of its muscles at full
    /// activation.
    pub fn step(
        &mut self,
        (way, links, learnt): (&LiftTrajectory, &Links, &LearntTorque),
        n: usize,
        state: ([f64; JOINTS], [f64; JOINTS]),
        full_nm: &[[f64; JOINTS]; MUSCLES],
    ) -> Intent {
        self.seen.push(state);
        let known = way.torques_nm(links, n, self.object_kg);
        let back = self.feedback(way, links, n);
        let part = (n * PARTS / way.len()).min(PARTS - 1);
        let wanted = std::array::from_fn(|joint| {
            self.felt[part].0[joint] += back[joint];
            known[joint] + learnt.0[part][joint] + back[joint]
        });
        self.felt[part].1 += 1;
        let muscles = Muscles {
            full_nm: full_nm.to_vec(),
            least: vec![0.0; MUSCLES],
        };
        match muscles
            .with_co_contraction(self.will.co_contraction, wanted)
            .activations(wanted)
        {
            Ok(found) => self.drive = std::array::from_fn(|muscle| found[muscle]),
            // Keeps the previous drives, because these muscles cannot produce more here.
            Err(_) => self.weak += 1,
        }
        let at = way.step(n);
        let still = n >= way.len();
        Intent {
            drive: self.noisy_drives(),
            flexions: way.flexions[at],
            rates: if still { [0.0; JOINTS] } else { way.rates[at] },
        }
    }

    /// Returns the feedback torque for the error that the arm had one feedback delay earlier, N m.
    /// Without the delay, this feedback would make the arm with the object critically damped at the
    /// configured bandwidth.
    fn feedback(&self, way: &LiftTrajectory, links: &Links, n: usize) -> [f64; JOINTS] {
        let Some(then) = n.checked_sub(self.late) else {
            return [0.0; JOINTS];
        };
        let (flexions, rates) = self.seen[then];
        let at = way.step(then);
        let inertias = links.inertias(flexions, 0.5 * self.object_kg);
        let turns = self.will.bandwidth / self.will.delay_s;
        std::array::from_fn(|joint| {
            let off = way.flexions[at][joint] - flexions[joint];
            let slip = way.rates[at][joint] - rates[joint];
            inertias[joint] * turns * (turns * off + 2.0 * slip)
        })
    }

    /// Returns the drives with random noise in proportion to each drive.
    fn noisy_drives(&mut self) -> [f64; MUSCLES] {
        let [size, time_s] = self.will.noise;
        let kept = libm::exp(-1.0 / (RATE_HZ * time_s));
        let fresh = (1.0 - kept * kept).sqrt();
        let from = self.deviates;
        self.deviates += MUSCLES as u64;
        std::array::from_fn(|muscle| {
            let deviate = random::standard_normal(self.seed, from + muscle as u64);
            self.noise[muscle] = kept * self.noise[muscle] + fresh * deviate;
            self.drive[muscle] * (1.0 + size * self.noise[muscle])
        })
    }

    /// Adds a part of this lift's feedback to the learnt torque for the next lift.
    pub fn learn(&self, learnt: &mut LearntTorque) {
        for (known, (sum, count)) in learnt.0.iter_mut().zip(&self.felt) {
            for (known, sum) in known.iter_mut().zip(sum) {
                *known += self.will.learning * sum / f64::from((*count).max(1));
            }
        }
    }
}
