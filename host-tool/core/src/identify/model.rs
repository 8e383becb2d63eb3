//! The calcium-force model (Lee 2020, equations 2 to 4) with the sensitivity of its force to each
//! constant.
//!
//! ```text
//! dC/dt = Σ δ(t − tᵢ) − C/τc      x = C/(C + K)      dF/dt = A x − F/(τ1 + τ2 x)
//! ```
//!
//! C and its sensitivity are exact. F and its sensitivities decay at the same rate, so one
//! variation of constants with two Gauss nodes per millisecond serves all of them. This
//! implementation is independent of those of the bodies and of the device.

use super::record::{ForceRecord, SAMPLE_US};

/// Number of constants of the model: A, K, τc, τ1 and τ2.
pub const PARAMETERS: usize = 5;
/// Names of the constants as fields of a session's `channel.muscle`, in the order of all arrays of
/// this module.
pub const NAMES: [&str; PARAMETERS] = ["a_n_per_s", "k", "tau_c_ms", "tau1_ms", "tau2_ms"];
/// Units of the constants in a session's `channel.muscle`, in the order of [`NAMES`].
pub const UNITS: [&str; PARAMETERS] = ["N/s", "", "ms", "ms", "ms"];

/// Constants of a muscle: A in N/s, K, τc, τ1 and τ2 in s; all above 0.
pub type Constants = [f64; PARAMETERS];

/// Positions of the two nodes of Gauss's integration rule within a step from 0 to 1.
const NODES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
/// Weights for the mean of a rate between a node and the end of the step. For a rate that is linear
/// in time, r₁ at the first node and r₂ at the second, the mean is r₁ + (r₂ − r₁) · weight.
const RISE: [f64; 2] = [0.683_012_701_892_219_3, 1.183_012_701_892_219_3];

/// State of the model: calcium C and force F at the present time, and their derivatives with
/// respect to the logarithms of the constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitive {
    constants: Constants,
    /// Calcium C, and its derivative dC/d ln τc.
    calcium: [f64; 2],
    /// Muscle force at the present time, N.
    pub force_n: f64,
    /// Derivatives of the force with respect to the logarithms of the constants, N, in the order of
    /// [`NAMES`].
    pub slopes_n: [f64; PARAMETERS],
}

/// Values that depend only on the length of a time step, computed once for many steps.
#[derive(Debug, Clone, Copy)]
struct Span {
    s: f64,
    /// Share of calcium that remains at the first node, at the second node and at the end of the
    /// step.
    left: [f64; 3],
}

impl Span {
    fn new(s: f64, tau_c_s: f64) -> Self {
        let z = s / tau_c_s;
        Self {
            s,
            left: [NODES[0], NODES[1], 1.0].map(|u| libm::exp(-z * u)),
        }
    }
}

/// Values at a node of the integration rule: the share x of calcium-bound cross-bridges, and the
/// rate of decay of force. With them, the derivatives of x with respect to ln K and ln τc, and
/// those of the rate with respect to ln K, ln τc, ln τ1 and ln τ2.
struct Node {
    bound: f64,
    rate: f64,
    bound_by: [f64; 2],
    rate_by: [f64; 4],
}

impl Sensitive {
    /// Creates the model of a muscle at rest, without calcium and force.
    #[must_use]
    pub const fn new(constants: Constants) -> Self {
        Self {
            constants,
            calcium: [0.0; 2],
            force_n: 0.0,
            slopes_n: [0.0; PARAMETERS],
        }
    }

    /// Applies a stimulation pulse at the present time.
    pub const fn apply_pulse(&mut self) {
        self.calcium[0] += 1.0;
    }

    /// Advances the model by `s` seconds, which should be about a millisecond.
    pub fn advance(&mut self, s: f64) {
        if s > 0.0 {
            self.advance_span(&Span::new(s, self.constants[2]));
        }
    }

    fn node(&self, c: f64, c_by_tau: f64) -> Node {
        let [_, k, _, tau1, tau2] = self.constants;
        let part = 1.0 / (c + k);
        let bound = c * part;
        let rate = 1.0 / (tau1 + tau2 * bound);
        let bound_by = [-bound * k * part, k * c_by_tau * part * part];
        let slow = -rate * rate;
        let rate_by = [
            slow * tau2 * bound_by[0],
            slow * tau2 * bound_by[1],
            slow * tau1,
            slow * tau2 * bound,
        ];
        Node {
            bound,
            rate,
            bound_by,
            rate_by,
        }
    }

    fn advance_span(&mut self, span: &Span) {
        let (a, tau_c, h) = (self.constants[0], self.constants[2], span.s);
        let [c, by] = self.calcium;
        let at = |u: f64, left: f64| [c * left, (by + c * u * h / tau_c) * left];
        let [c1, by1] = at(NODES[0], span.left[0]);
        let [c2, by2] = at(NODES[1], span.left[1]);
        let (first, two) = (self.node(c1, by1), self.node(c2, by2));
        let slope = two.rate - first.rate;
        let kept1 = libm::exp(-h * (1.0 - NODES[0]) * (first.rate + slope * RISE[0]));
        let kept2 = libm::exp(-h * (1.0 - NODES[1]) * (first.rate + slope * RISE[1]));
        let kept = libm::exp(-h * 0.5 * (first.rate + two.rate));
        let half = 0.5 * h;
        let before = self.force_n;
        let after = before * kept + half * a * (first.bound * kept1 + two.bound * kept2);
        // Force at the nodes, which the sources of the sensitivities need only to second order.
        let moved = after - before;
        let (f1, f2) = (before + NODES[0] * moved, before + NODES[1] * moved);
        let sensitivity = |bound_by: [f64; 2], rate_by: [f64; 2], old: f64| {
            let source1 = a * bound_by[0] - f1 * rate_by[0];
            let source2 = a * bound_by[1] - f2 * rate_by[1];
            old * kept + half * (source1 * kept1 + source2 * kept2)
        };
        let [_, k, c_, t1, t2] = self.slopes_n;
        let rate_by = |i: usize| [first.rate_by[i], two.rate_by[i]];
        self.slopes_n = [
            after, // F is proportional to A
            sensitivity([first.bound_by[0], two.bound_by[0]], rate_by(0), k),
            sensitivity([first.bound_by[1], two.bound_by[1]], rate_by(1), c_),
            sensitivity([0.0; 2], rate_by(2), t1),
            sensitivity([0.0; 2], rate_by(3), t2),
        ];
        self.force_n = after;
        self.calcium = at(1.0, span.left[2]);
    }
}

/// Simulates the pulses of `record`. Returns the force at each sample, N, and its derivatives with
/// respect to the logarithms of the constants. Both are multiplied by the gain of the record.
#[must_use]
pub fn simulate_record(
    constants: Constants,
    record: &ForceRecord,
) -> (Vec<f64>, Vec<[f64; PARAMETERS]>) {
    let sample_span = Span::new(f64::from(SAMPLE_US) * 1e-6, constants[2]);
    let mut muscle = Sensitive::new(constants);
    let count = record.samples_n.len();
    let (mut force, mut slopes) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut pulses = record.pulses_us.iter().copied().peekable();
    let mut begun = false;
    for sample in 0..count as u32 {
        let from_us = sample.saturating_sub(1) * SAMPLE_US;
        let (to_us, mut now_us) = (sample * SAMPLE_US, from_us);
        // A pulse at the time of a sample acts after the sample.
        while let Some(at_us) = pulses.next_if(|at| *at < to_us) {
            muscle.advance(f64::from(at_us.saturating_sub(now_us)) * 1e-6);
            now_us = now_us.max(at_us);
            muscle.apply_pulse();
            begun = true;
        }
        if begun {
            match to_us - now_us {
                SAMPLE_US => muscle.advance_span(&sample_span),
                rest_us => muscle.advance(f64::from(rest_us) * 1e-6),
            }
        }
        force.push(record.gain * muscle.force_n);
        slopes.push(muscle.slopes_n.map(|slopes_n| record.gain * slopes_n));
    }
    (force, slopes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::body::muscle::{SUBJECTS, reference};

    fn record() -> ForceRecord {
        ForceRecord {
            pulses_us: (0..40).map(|i| 25_000 * i).collect(),
            samples_n: vec![0.0; 1_500],
            gain: 1.0,
        }
    }

    /// Checks the force of ten subjects against the reference integrator: 2e-6 of the peak.
    #[test]
    fn force_is_the_reference_s() {
        for subject in &SUBJECTS {
            let (force, _) = simulate_record(subject.all(), &record());
            let pulses = reference::train(40.0, 40);
            let truth = reference::integrate(subject, &pulses, 1.499, 1e-3);
            let peak = force.iter().copied().fold(0.0, f64::max);
            for (ours, theirs) in force.iter().zip(&truth) {
                assert!((ours - theirs.force_n).abs() < 2e-6 * peak, "{subject:?}");
            }
        }
    }

    /// Checks the slopes against central differences: 1 % of the largest slope, because the force
    /// at the nodes is taken as linear.
    #[test]
    fn slopes_are_the_differences() {
        for subject in &SUBJECTS {
            let (_, slopes) = simulate_record(subject.all(), &record());
            for parameter in 0..PARAMETERS {
                let moved = |by: f64| {
                    let mut constants = subject.all();
                    constants[parameter] *= libm::exp(by);
                    simulate_record(constants, &record()).0
                };
                let (up, down) = (moved(1e-4), moved(-1e-4));
                let largest = slopes
                    .iter()
                    .map(|slope| slope[parameter].abs())
                    .fold(0.0, f64::max);
                for ((up, down), slopes) in up.iter().zip(&down).zip(&slopes) {
                    let difference = (up - down) / 2e-4;
                    let off = (slopes[parameter] - difference).abs() / largest;
                    assert!(off < 0.01, "{subject:?} {}: {off}", NAMES[parameter]);
                }
            }
        }
    }
}
