//! References of the finger, and the times at which it is judged.

use super::trial::SCORED_FROM_MS;
use hal_sim::body::random_finger::Draws;
use std::f64::consts::TAU;

/// Time after a jump of the reference that is not judged, ms. Delay and muscle need it under any
/// law; overshoot or oscillation that lasts longer is judged.
pub const SETTLING_MS: usize = 1000;
/// Angle at which the finger rests, and from which steps and holds start, °.
const REST_DEG: f64 = 5.0;

/// A reference: its angle as a function of time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Course {
    /// A sine of 45 ± 40° at 0.2 Hz (Hamana 2022, experiment 4; the offset is assumed).
    Sine,
    /// The sum of four sines between 0.05 and 0.4 Hz around 45°, with random phases, frequencies
    /// and amplitudes. The amplitudes sum to 40°.
    Smooth {
        /// Seed of the phases, frequencies and amplitudes.
        seed: u64,
    },
    /// A sine of 45 ± 40° at another frequency.
    SineAt {
        /// Frequency of the sine, Hz.
        hz: f64,
    },
    /// Jumps between random angles of 10 to 80°, each of which stays for 2.5 to 5 s.
    Steps {
        /// Seed that determines angles and times together with `index`.
        seed: u64,
        /// Index of the wearer, from 0.
        index: u64,
    },
    /// A smooth rise from rest, from 1 to 4 s, to an angle that then stays constant.
    Hold {
        /// Angle that is held, °.
        deg: f64,
    },
}

/// Kind of reference. All references of a kind are judged in the same way.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Kind {
    /// A sine, or a sum of several.
    Sine,
    /// Constant angles with jumps between them.
    Steps,
    /// A smooth rise to an angle that then stays constant.
    Hold,
}

impl Kind {
    /// All kinds; wearer `n` of the widened population follows number `n` modulo 3.
    pub const ALL: [Self; 3] = [Self::Sine, Self::Steps, Self::Hold];

    /// Returns the name of the kind in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Steps => "steps",
            Self::Hold => "hold",
        }
    }
}

impl Course {
    /// Returns the reference of wearer `index` in the widened population: a sine of 0.1 to 0.5 Hz,
    /// steps, or a hold at 15 to 75°, in turn.
    pub fn widened(seed: u64, index: u64) -> Self {
        let mut draws = Draws::new(seed, index, 8);
        match index % 3 {
            0 => Self::SineAt {
                hz: draws.uniform(0.1, 0.5),
            },
            1 => Self::Steps { seed, index },
            _ => Self::Hold {
                deg: draws.uniform(15.0, 75.0),
            },
        }
    }

    /// Returns the kind of this reference, which determines how it is judged.
    pub const fn kind(self) -> Kind {
        match self {
            Self::Sine | Self::Smooth { .. } | Self::SineAt { .. } => Kind::Sine,
            Self::Steps { .. } => Kind::Steps,
            Self::Hold { .. } => Kind::Hold,
        }
    }

    /// Returns the reference at each of the first `ms` milliseconds, degrees.
    pub fn angles(self, ms: usize) -> Vec<f64> {
        match self {
            Self::Sine => sines(&[(40.0, 0.2, 0.0)], ms),
            Self::SineAt { hz } => sines(&[(40.0, hz, 0.0)], ms),
            Self::Smooth { seed } => {
                let mut draws = Draws::new(seed, 0, 3);
                let weights = [(); 4].map(|()| draws.uniform(0.2, 1.0));
                let total: f64 = weights.iter().sum();
                let part = |w: f64| {
                    let amplitude = 40.0 * w / total;
                    (amplitude, draws.uniform(0.05, 0.4), draws.uniform(0.0, TAU))
                };
                sines(&weights.map(part), ms)
            }
            Self::Steps { seed, index } => steps(seed, index, ms),
            Self::Hold { deg } => (0..ms).map(|n| rise(deg, n as f64 / 1000.0)).collect(),
        }
    }
}

fn sines(parts: &[(f64, f64, f64)], ms: usize) -> Vec<f64> {
    let at = |t: f64| -> f64 {
        let wave = |&(a, f, p): &(f64, f64, f64)| a * libm::sin(TAU * f * t + p);
        45.0 + parts.iter().map(wave).sum::<f64>()
    };
    (0..ms).map(|n| at(n as f64 / 1000.0)).collect()
}

fn steps(seed: u64, index: u64, ms: usize) -> Vec<f64> {
    let mut draws = Draws::new(seed, index, 9);
    let mut angles = vec![REST_DEG; SETTLING_MS.min(ms)];
    while angles.len() < ms {
        let level = draws.uniform(10.0, 80.0);
        let stays = draws.uniform(2500.0, 5000.0) as usize;
        angles.resize((angles.len() + stays).min(ms), level);
    }
    angles
}

/// Returns a smooth rise from rest to the angle `deg`, °: half a cosine from 1 to 4 s.
fn rise(deg: f64, t: f64) -> f64 {
    let way = ((t - 1.0) / 3.0).clamp(0.0, 1.0);
    REST_DEG + (deg - REST_DEG) * 0.5 * (1.0 - libm::cos(way * TAU / 2.0))
}

/// Returns for each millisecond of a reference whether it is scored. Scored is all time from
/// [`SCORED_FROM_MS`] on, except for [`SETTLING_MS`] after each jump of 1° or more within a
/// millisecond.
pub fn scored(wanted: &[f64]) -> Vec<bool> {
    let mut judged_from = SCORED_FROM_MS;
    let mut before = wanted.first().copied().unwrap_or(0.0);
    let judged = wanted.iter().enumerate().map(|(ms, now)| {
        if (now - before).abs() >= 1.0 {
            judged_from = judged_from.max(ms + SETTLING_MS);
        }
        before = *now;
        ms >= judged_from
    });
    judged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_judged_between_their_jumps_and_sines_throughout() {
        let ms = 30_000;
        let steps = Course::Steps { seed: 1, index: 1 }.angles(ms);
        assert_eq!(steps.len(), ms);
        assert!(steps.iter().all(|a| *a == 5.0 || (10.0..80.0).contains(a)));
        let judged = scored(&steps);
        let jumps = (1..ms).filter(|n| steps[*n] != steps[n - 1]);
        for jump in jumps.clone() {
            let end = (jump + SETTLING_MS).min(ms);
            assert!(judged[jump..end].iter().all(|j| !j), "{jump}");
        }
        assert!((6..13).contains(&jumps.count()));
        let part = judged.iter().filter(|j| **j).count();
        assert!((8_000..18_000).contains(&part), "{part}");
        for course in [Course::SineAt { hz: 0.5 }, Course::Hold { deg: 75.0 }] {
            let judged = scored(&course.angles(ms));
            assert!(judged[..10_000].iter().all(|j| !j) && judged[10_000..].iter().all(|j| *j));
        }
    }

    #[test]
    fn widened_courses_take_turns_within_their_ranges() {
        for index in 0..300 {
            let course = Course::widened(4, index);
            assert_eq!(course.kind(), Kind::ALL[index as usize % 3]);
            let in_range = match course {
                Course::SineAt { hz } => (0.1..0.5).contains(&hz),
                Course::Hold { deg } => (15.0..75.0).contains(&deg),
                _ => true,
            };
            assert!(in_range, "{course:?}");
        }
    }
}
