//! A muscle that tires, in f64: the equations of (2)–(4) with those of Ding 2003
//! for A, K and τ1. What every prediction of a tiring muscle is judged by.

use super::Parameters;

/// How a muscle tires (Ding 2003): what force takes from A and adds to K and τ1, and
/// how fast all three come back. SI units, none negative, `tau_fat_s` above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fatigue {
    /// |αA|, s⁻².
    pub alpha_a_per_s2: f64,
    /// αK, N⁻¹s⁻¹.
    pub alpha_k_per_n_s: f64,
    /// ατ1, N⁻¹.
    pub alpha_tau1_per_n: f64,
    /// τfat, s.
    pub tau_fat_s: f64,
    /// Where K ends: the model is not meant for more.
    pub k_max: f64,
    /// Where τ1 ends, s.
    pub tau1_max_s: f64,
}

impl Fatigue {
    /// A muscle that never tires.
    pub const NEVER: Self = Self {
        alpha_a_per_s2: 0.0,
        alpha_k_per_n_s: 0.0,
        alpha_tau1_per_n: 0.0,
        tau_fat_s: 1.0,
        k_max: f64::INFINITY,
        tau1_max_s: f64::INFINITY,
    };
}

/// Longest step, s.
const STEP_S: f64 = 1e-3;

/// A tiring muscle in motion. Classical Runge–Kutta for F, exact C, in steps of at
/// most 1 ms split at pulses; fatigue, with time constants of minutes, by the
/// rectangle rule over the same steps. A muscle with time constants below 5 ms takes
/// shorter steps, a fifth of the shortest.
#[derive(Clone, Copy, Debug)]
pub struct FatiguingMuscle {
    fresh: Parameters,
    now: Parameters,
    fatigue: Fatigue,
    longest_s: f64,
    /// The last whole step of [`STEP_S`]: what is left of C at its half.
    half: (f64, f64),
    gain: f64,
    c: f64,
    force: f64,
}

impl FatiguingMuscle {
    /// A fresh muscle.
    pub fn new(fresh: Parameters, fatigue: Fatigue) -> Self {
        let longest_s = STEP_S.min(0.2 * fresh.tau1_s.min(fresh.tau_c_s));
        Self {
            fresh,
            now: fresh,
            fatigue,
            longest_s,
            half: (longest_s, (-0.5 * longest_s / fresh.tau_c_s).exp()),
            gain: 0.0,
            c: 0.0,
            force: 0.0,
        }
    }

    /// Takes steps of up to `longest_s` instead, above 0, still a fifth of the shortest time
    /// constant at most: at 5 ms Runge-Kutta errs by some 0.01 %.
    #[must_use]
    pub fn in_steps_of(mut self, longest_s: f64) -> Self {
        self.longest_s = longest_s.min(0.2 * self.fresh.tau1_s.min(self.fresh.tau_c_s));
        self
    }

    /// Takes this part, 0 to 1, of what is left of A: tiredness that no force made.
    pub fn tire(&mut self, part: f64) {
        self.now.a_n_per_s *= 1.0 - part;
    }

    /// Whether what is left of force and calcium, in parts of one pulse's, is next to nothing.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.c < 1e-9 && self.force < 1e-9 * self.fresh.a_n_per_s
    }

    /// A pulse now. `gain`, 0 to 1, scales A until the next one.
    pub const fn pulse(&mut self, gain: f64) {
        self.gain = gain;
        self.c += 1.0;
    }

    /// The latest pulse reached more: `gain` from now on, no calcium more.
    pub const fn regain(&mut self, gain: f64) {
        self.gain = gain;
    }

    /// Lets `us` microseconds pass of a muscle whose force is next to nothing and has no
    /// pulse: what is left of its force goes, tiredness recovers exactly.
    pub fn relax(&mut self, us: u64) {
        let span = us as f64 * 1e-6;
        let left = (-span / self.fatigue.tau_fat_s).exp();
        let (now, fresh) = (&mut self.now, &self.fresh);
        now.a_n_per_s = fresh.a_n_per_s + left * (now.a_n_per_s - fresh.a_n_per_s);
        now.k = fresh.k + left * (now.k - fresh.k);
        now.tau1_s = fresh.tau1_s + left * (now.tau1_s - fresh.tau1_s);
        self.c *= (-span / fresh.tau_c_s).exp();
        self.force = 0.0;
    }

    /// Force, N.
    pub const fn force(&self) -> f64 {
        self.force
    }

    /// Its parameters, as tired as it is.
    pub const fn parameters(&self) -> Parameters {
        self.now
    }

    /// Lets `us` microseconds pass.
    pub fn pass(&mut self, us: u32) {
        let span = f64::from(us) * 1e-6;
        let steps = (span / self.longest_s - 1e-9).ceil().max(0.0);
        for _ in 0..steps as u32 {
            self.step(span / steps);
        }
    }

    fn step(&mut self, h: f64) {
        let Self { now: p, gain, .. } = *self;
        let rate = |c: f64, f: f64| {
            let x = c / (p.k + c);
            gain * p.a_n_per_s * x - f / (p.tau1_s + p.tau2_s * x)
        };
        if self.half.0 != h {
            self.half = (h, (-0.5 * h / p.tau_c_s).exp());
        }
        let half = self.half.1;
        let (c0, c1, c2, f) = (self.c, self.c * half, self.c * half * half, self.force);
        let k1 = rate(c0, f);
        let k2 = rate(c1, f + 0.5 * h * k1);
        let k3 = rate(c1, f + 0.5 * h * k2);
        let k4 = rate(c2, f + h * k3);
        self.force += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        self.c = c2;
        let how = self.fatigue;
        let back = h / how.tau_fat_s;
        let (p, fresh, work) = (&mut self.now, &self.fresh, h * f);
        p.a_n_per_s += back * (fresh.a_n_per_s - p.a_n_per_s) - how.alpha_a_per_s2 * work;
        p.k += back * (fresh.k - p.k) + how.alpha_k_per_n_s * work;
        p.k = p.k.min(how.k_max);
        p.tau1_s += back * (fresh.tau1_s - p.tau1_s) + how.alpha_tau1_per_n * work;
        p.tau1_s = p.tau1_s.min(how.tau1_max_s);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{SUBJECTS, reference};
    use super::*;

    /// Against the reference, whose pulses have full gain: 1e-5 of the peak.
    #[test]
    fn without_fatigue_it_is_the_reference() {
        let pulses: Vec<f64> = reference::train(30.0, 20);
        for subject in &SUBJECTS {
            let truth = reference::integrate(subject, &pulses, 1.0, 1e-3);
            let peak = truth.iter().map(|s| s.force_n).fold(0.0, f64::max);
            let mut muscle = FatiguingMuscle::new(*subject, Fatigue::NEVER);
            let mut due = pulses.iter().map(|s| (s * 1e6).round() as u32).peekable();
            let mut now_us = 0;
            for (ms, sample) in (0u32..).zip(&truth) {
                while let Some(at_us) = due.next_if(|at| *at <= ms * 1000) {
                    muscle.pass(at_us - now_us);
                    now_us = at_us;
                    muscle.pulse(1.0);
                }
                muscle.pass(ms * 1000 - now_us);
                now_us = ms * 1000;
                let off = (muscle.force() - sample.force_n).abs() / peak;
                assert!(off < 2e-5, "{subject:?} at {ms} ms: {off}");
            }
        }
    }
}
