//! What the finger is to follow.

use hal_sim::body::random_finger::Draws;
use std::f64::consts::TAU;

/// A course of the wanted angle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Course {
    /// 45 ± 40° at 0.2 Hz (Hamana 2022, experiment 4; the offset is assumed).
    Sine,
    /// 45 ± at most 40°: four sines between 0.05 and 0.4 Hz with drawn phases and
    /// frequencies, whose amplitudes sum to 40°.
    Smooth {
        /// Decides the draw.
        seed: u64,
    },
}

impl Course {
    /// The wanted angle at each millisecond of `ms`, degrees.
    pub fn angles(self, ms: usize) -> Vec<f64> {
        let parts = match self {
            Self::Sine => vec![(40.0, 0.2, 0.0)],
            Self::Smooth { seed } => {
                let mut draws = Draws::new(seed, 0, 3);
                let weights = [(); 4].map(|()| draws.even(0.2, 1.0));
                let all: f64 = weights.iter().sum();
                let part = |w: f64| {
                    let amplitude = 40.0 * w / all;
                    (amplitude, draws.even(0.05, 0.4), draws.even(0.0, TAU))
                };
                weights.map(part).to_vec()
            }
        };
        let at = |t: f64| -> f64 {
            let wave = |&(a, f, p): &(f64, f64, f64)| a * (TAU * f * t + p).sin();
            45.0 + parts.iter().map(wave).sum::<f64>()
        };
        (0..ms).map(|n| at(n as f64 / 1000.0)).collect()
    }
}
