//! Force over time, every millisecond: from a rung of the ladder and from an
//! f64 model that shares nothing with it.

use super::protocol::Protocol;
pub(super) use crate::subjects::spec;
use firmware::muscle::{CalciumForceSpec, Gain, Model};
use firmware::units::{Micros, us};
use fixed::types::U1F31;
use hal_sim::body::muscle::{Muscle, Parameters, SUBJECTS, Step};

/// Every run wraps the device's 32-bit clock within its first second.
pub const START: Micros = Micros::new(u32::MAX - 400_000);

/// Lee 2020's ten subjects as a host would send them.
pub fn subjects() -> [CalciumForceSpec; 10] {
    SUBJECTS.map(|p| spec(&p))
}

/// What a rung predicts, N, at 0, 1 … `duration_ms` ms.
pub fn predicted<M: Model>(model: &M, protocol: &Protocol) -> Vec<f64> {
    let mut state = model.at_rest(START);
    protocol.play(|at_us, pulse| {
        let Some(gain) = pulse else {
            model.advance(&mut state, START + us(at_us));
            return model.force(&state).get().to_num();
        };
        let gain = Gain::new(U1F31::saturating_from_num(gain));
        model.pulse(&mut state, START + us(at_us), gain);
        0.0
    })
}

/// What the rested muscle does, N, at the same times: the simulated wearer's
/// own model, split at every pulse, within 1e-8 of peak.
pub fn reference(parameters: &Parameters, protocol: &Protocol) -> Vec<f64> {
    let mut muscle = Muscle::new(*parameters);
    let whole = Step::new(parameters, 1e-3);
    let mut now_us = 0;
    protocol.play(|at_us, pulse| {
        match (at_us - now_us, pulse) {
            (1000, None) => muscle.step(&whole),
            (left_us, _) => pass(&mut muscle, parameters, left_us),
        }
        now_us = at_us;
        if let Some(gain) = pulse {
            muscle.pulse(gain);
        }
        muscle.force()
    })
}

fn pass(muscle: &mut Muscle, parameters: &Parameters, us: u32) {
    if us > 0 {
        muscle.step(&Step::new(parameters, f64::from(us) * 1e-6));
    }
}

/// How far one force is from another, as parts of the other's peak.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Worst.
    pub worst: f64,
    /// Root mean square.
    pub rms: f64,
}

impl Difference {
    /// Of `model` from `truth`, whose peak is above zero; as long as the
    /// shorter of the two.
    pub fn of(truth: &[f64], model: &[f64]) -> Self {
        let peak = truth.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let apart = truth.iter().zip(model).map(|(t, m)| (t - m).abs() / peak);
        let (worst, sum) = apart.fold((0.0, 0.0), |(worst, sum): (f64, f64), d| {
            (worst.max(d), sum + d * d)
        });
        let count = truth.len().min(model.len()).max(1);
        Self {
            worst,
            rms: (sum / count as f64).sqrt(),
        }
    }

    /// The larger of each.
    pub fn max(self, other: Self) -> Self {
        Self {
            worst: self.worst.max(other.worst),
            rms: self.rms.max(other.rms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::muscle::CalciumForce;
    use host_core::choice::Scene;

    #[test]
    fn the_calcium_force_model_is_within_its_bound_of_the_reference() {
        let scene = Scene {
            burst_ms: 300,
            slowest_mhz: 10_000,
            fastest_mhz: 100_000,
            ramp_ms: 0,
            session_s: 1,
        };
        let protocol = Protocol::draw(&scene, 3);
        for (parameters, spec) in SUBJECTS.iter().zip(subjects()) {
            let model = CalciumForce::new(spec).unwrap();
            let truth = reference(parameters, &protocol);
            let error = Difference::of(&truth, &predicted(&model, &protocol));
            assert!(error.worst < 2e-4, "{error:?}");
            assert!(error.rms > 0.0);
        }
    }
}
