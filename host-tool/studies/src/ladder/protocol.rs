//! A scene as pulses: what a muscle gets in each kind of scene.

use hal_sim::random::Random;
use host_core::choice::Scene;

/// Bursts of a muscle that does not tire last at least this long, ms, and are at
/// least three.
const LEAST_MS: f64 = 4_000.0;
/// Pauses between bursts and stays at one pulse rate, ms, drawn between these
/// with a uniform logarithm.
const DWELL_MS: (f64, f64) = (100.0, 1_000.0);
/// A hold of a muscle that does not tire lasts so many ramps and so many ms
/// more, but not longer than [`LONGEST_HOLD_MS`].
const HOLD_RAMPS: f64 = 6.0;
const HOLD_MS: f64 = 5_000.0;
const LONGEST_HOLD_MS: f64 = 30_000.0;
/// Least gain of a pulse at the foot of a ramp: 0 would be no pulse.
const LEAST_GAIN: f64 = 1e-3;

/// The pulses of one scene and how long its force is looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Protocol {
    /// Microsecond and gain of each, rising.
    pub pulses: Vec<(u32, f64)>,
    /// Length, ms.
    pub duration_ms: u32,
}

/// Stays of drawn lengths that leave no part of their range out: the ends, the
/// middle and the quarters first.
struct Stays(usize);

impl Stays {
    fn next(&mut self, random: &mut Random) -> f64 {
        const FIRST: [f64; 5] = [0.0, 1.0, 0.5, 0.25, 0.75];
        let part = FIRST.get(self.0).copied();
        self.0 += 1;
        let part = part.unwrap_or_else(|| random.unit());
        DWELL_MS.0 * (DWELL_MS.1 / DWELL_MS.0).powf(part)
    }
}

/// The drive of one burst: amplitude up and down in a ramp each, pulse rate
/// between the two in steps or ramps at drawn times.
struct Burst {
    length_ms: f64,
    ramp_ms: f64,
    /// Time and rate (Hz) of each corner of the rate's course.
    rates: Vec<(f64, f64)>,
}

impl Burst {
    /// The burst that begins with the lower of the two rates if `first` is 0,
    /// with the higher one if it is 1.
    fn draw(scene: &Scene, first: usize, random: &mut Random) -> Self {
        let ramp_ms = f64::from(scene.ramp_ms);
        let length_ms = match (scene.burst_ms, scene.session_s) {
            (Scene::UNBROKEN.., 1..) => f64::from(scene.session_s) * 1e3,
            (Scene::UNBROKEN.., 0) => (HOLD_RAMPS * ramp_ms + HOLD_MS).min(LONGEST_HOLD_MS),
            _ => f64::from(scene.burst_ms),
        };
        let (a, b) = (scene.slowest_mhz, scene.fastest_mhz);
        let hz = [a, b].map(|mhz| f64::from(mhz) / 1e3);
        let mut now = first;
        let mut rates = vec![(0.0, hz[now])];
        let mut t = 0.0;
        let mut stays = Stays(0);
        while a != b && t < length_ms {
            t += stays.next(random).min(length_ms / 3.0);
            rates.push((t, hz[now]));
            now = 1 - now;
            // At least a microsecond: a step.
            t += ramp_ms.max(1e-3);
            rates.push((t, hz[now]));
        }
        Self {
            length_ms,
            ramp_ms: ramp_ms.min(length_ms / 2.0),
            rates,
        }
    }

    /// Gain of a pulse, which acts until the next: that of the middle between.
    fn gain(&self, t: f64) -> f64 {
        let middle = t + 500.0 / self.hz(t);
        let edge = middle.min(self.length_ms - t);
        if edge >= self.ramp_ms {
            return 1.0;
        }
        (edge / self.ramp_ms).max(LEAST_GAIN)
    }

    fn hz(&self, t: f64) -> f64 {
        let next = self.rates.partition_point(|&(at, _)| at <= t);
        let Some(&(to, high)) = self.rates.get(next) else {
            return self.rates.last().map_or(1.0, |&(_, hz)| hz);
        };
        let (from, low) = self.rates[next - 1]; // the first is at 0 ≤ t
        low + (high - low) * (t - from) / (to - from)
    }
}

impl Protocol {
    /// Goes to each pulse, which has a gain, and to each millisecond, both in µs; what
    /// that gives at 0, 1 … `duration_ms` ms.
    pub fn play(&self, mut go_to: impl FnMut(u32, Option<f64>) -> f64) -> Vec<f64> {
        let mut pulses = self.pulses.iter().peekable();
        let each = (0..=self.duration_ms).map(|ms| {
            while let Some(&(at_us, gain)) = pulses.next_if(|pulse| pulse.0 <= ms * 1000) {
                go_to(at_us, Some(gain));
            }
            go_to(ms * 1000, None)
        });
        each.collect()
    }

    /// The scene with its random parts (phase against the tick, pauses, times
    /// at each rate) drawn from `seed`, as long as its session.
    pub fn draw(scene: &Scene, seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0x1A77E5);
        let is_hold = scene.burst_ms >= Scene::UNBROKEN;
        let mut pulses = Vec::new();
        let mut start_ms = random.unit();
        let mut bursts = 0;
        let mut pauses = Stays(0);
        loop {
            let first = (seed % 2) as usize ^ (bursts % 2);
            let burst = Burst::draw(scene, first, &mut random);
            let mut t = 0.0;
            while t < burst.length_ms {
                let at_us = ((start_ms + t) * 1e3) as u32; // below a minute
                pulses.push((at_us, burst.gain(t)));
                t += 1e3 / burst.hz(t);
            }
            bursts += 1;
            start_ms += burst.length_ms;
            if is_hold {
                break;
            }
            // The pause, in which the force decays; never shorter than a period.
            start_ms += pauses
                .next(&mut random)
                .max(1e6 / f64::from(scene.slowest_mhz));
            // A session ends after the last burst that fits, one at least.
            let is_over = match scene.session_s {
                0 => bursts >= 3 && start_ms >= LEAST_MS,
                seconds => start_ms + burst.length_ms > f64::from(seconds) * 1e3,
            };
            if is_over {
                break;
            }
        }
        let last_ms = pulses.last().map_or(0, |&(at, _)| at / 1000);
        Self {
            pulses,
            duration_ms: if is_hold { last_ms } else { start_ms as u32 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: Scene = Scene {
        burst_ms: 300,
        slowest_mhz: 20_000,
        fastest_mhz: 40_000,
        ramp_ms: 100,
        session_s: 1,
    };

    #[test]
    fn a_seed_repeats_and_rates_and_gains_stay_within_the_scene() {
        let protocol = Protocol::draw(&SCENE, 7);
        assert_eq!(protocol, Protocol::draw(&SCENE, 7));
        assert_ne!(protocol, Protocol::draw(&SCENE, 8));
        for two in protocol.pulses.windows(2) {
            let apart = two[1].0 - two[0].0;
            // Within a burst a period of 20 to 40 Hz, between bursts more.
            assert!(apart >= 24_999, "{apart}");
        }
        assert!(protocol.pulses.iter().all(|p| (1e-3..=1.0).contains(&p.1)));
        assert!(protocol.pulses.iter().any(|p| p.1 == 1.0));
    }

    #[test]
    fn a_session_ends_after_the_last_burst_that_fits() {
        let long = Scene {
            burst_ms: 700,
            session_s: 2,
            ..SCENE
        };
        for (scene, seconds) in [(SCENE, 1), (long, 2)] {
            let protocol = Protocol::draw(&scene, 3);
            let (last_us, _) = *protocol.pulses.last().unwrap();
            assert!(
                last_us > 300_000 && last_us <= seconds * 1_000_000,
                "{last_us}"
            );
            // The pause after it is a second at most.
            assert!(protocol.duration_ms <= (seconds + 1) * 1_000);
        }
        let rested = Scene {
            session_s: 0,
            ..SCENE
        };
        assert!(Protocol::draw(&rested, 3).duration_ms >= 4_000);
    }

    #[test]
    fn one_millisecond_is_one_pulse_and_a_hold_ends_with_its_last() {
        let single = Scene {
            burst_ms: 1,
            ..SCENE
        };
        let protocol = Protocol::draw(&single, 1);
        assert!(protocol.pulses.windows(2).all(|p| p[1].0 - p[0].0 > 50_000));
        let hold = Scene {
            burst_ms: Scene::UNBROKEN,
            ..SCENE
        };
        let protocol = Protocol::draw(&hold, 1);
        assert_eq!(
            protocol.pulses.last().unwrap().0 / 1000,
            protocol.duration_ms
        );
    }
}
