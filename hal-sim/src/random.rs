//! Numbers from a seed: the one generator of all simulators, studies and tests.
//!
//! It counts: number `index` of stream `seed` is a function of the two, so that
//! drawing twice, or not drawing, changes no other number. The function is the
//! one of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
//! generators", OOPSLA 2014, figure 17), whose state is a counter. It never
//! changes: a seed means the same run in every version.

use std::cell::Cell;
use std::f64::consts::TAU;

/// What the counter goes on by: 2^64 over the golden ratio, odd.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// Number `index` of stream `seed`, all 64 bits of it. Streams of seeds that are
/// a few `STEP`s apart overlap; those of small seeds do not.
#[must_use]
pub const fn word(seed: u64, index: u64) -> u64 {
    let z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(STEP));
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The upper 53 bits of `word` as a part of one, in [0, 1).
#[must_use]
pub const fn unit_from_word(word: u64) -> f64 {
    (word >> 11) as f64 / (1_u64 << 53) as f64
}

/// Uniform deviate number `index` of stream `seed`, in [0, 1). The seed is
/// scrambled first: no two streams of small seeds share a number.
#[must_use]
pub const fn unit(seed: u64, index: u64) -> f64 {
    unit_from_word(word(word(seed, 0).wrapping_add(index), 0))
}

/// Standard normal deviate number `index` of stream `seed`, by Box and Muller.
#[must_use]
pub fn standard_normal(seed: u64, index: u64) -> f64 {
    // The first uniform lies in (0, 1], so its logarithm is finite.
    let radius = 1.0 - unit(seed, 2 * index);
    let turn = unit(seed, 2 * index + 1);
    (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
}

/// The standard normal deviates of a stream. The latest is kept: a sensor may be
/// read several times between two changes of its noise.
#[derive(Clone, Debug)]
pub struct Noise {
    seed: u64,
    latest: Cell<(u64, f64)>,
}

impl Noise {
    /// Of stream `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let latest = Cell::new((0, standard_normal(seed, 0)));
        Self { seed, latest }
    }

    /// [`standard_normal`] number `index`.
    #[must_use]
    pub fn at(&self, index: u64) -> f64 {
        if self.latest.get().0 != index {
            self.latest.set((index, standard_normal(self.seed, index)));
        }
        self.latest.get().1
    }
}

/// What was read last makes no difference.
impl PartialEq for Noise {
    fn eq(&self, other: &Self) -> bool {
        self.seed == other.seed
    }
}

/// A stream drawn in order.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    seed: u64,
    drawn: u64,
}

impl Random {
    /// Stream `seed`, nothing drawn yet.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { seed, drawn: 0 }
    }

    /// The next 64 bits.
    pub const fn word(&mut self) -> u64 {
        let word = word(self.seed, self.drawn);
        self.drawn += 1;
        word
    }

    /// The next one, uniform in [0, 1).
    pub const fn unit(&mut self) -> f64 {
        unit_from_word(self.word())
    }

    /// The next one in `0..end`, uniform as far as `end` is below 2^64; `end` is
    /// above zero.
    pub const fn below(&mut self, end: u64) -> u64 {
        self.word() % end
    }

    /// The next one between two numbers, uniform.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Puts `all` in random order (Fisher and Yates; Knuth 1997, algorithm 3.4.2P).
    pub fn shuffle<T>(&mut self, all: &mut [T]) {
        for last in (1..all.len()).rev() {
            all.swap(last, self.below(last as u64 + 1) as usize);
        }
    }

    /// The next one between two positive numbers, its logarithm uniform.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stream 1234567 as other implementations of SplitMix64 print it.
    #[test]
    fn it_is_split_mix() {
        let mut random = Random::new(1_234_567);
        let published = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!([(); 5].map(|()| random.word()), published);
        assert_eq!(word(1_234_567, 4), published[4]);
    }

    #[test]
    fn deviates_have_the_moments_of_a_standard_normal() {
        let n = 200_000u64;
        let (mut mean, mut square, mut fourth, mut lag) = (0.0, 0.0, 0.0, 0.0);
        for i in 0..n {
            let z = standard_normal(7, i);
            mean += z;
            square += z * z;
            fourth += z.powi(4);
            lag += z * standard_normal(7, i + 1);
        }
        let n = n as f64;
        // Four standard errors of each moment.
        assert!((mean / n).abs() < 4.0 / n.sqrt());
        assert!((square / n - 1.0).abs() < 4.0 * (2.0 / n).sqrt());
        assert!((fourth / n - 3.0).abs() < 4.0 * (96.0 / n).sqrt());
        assert!((lag / n).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn seeds_give_different_streams() {
        assert_ne!(standard_normal(1, 0), standard_normal(2, 0));
        let noise = Noise::new(1);
        for index in [5, 5, 0, 7, 5] {
            assert_eq!(noise.at(index), standard_normal(1, index));
        }
    }
}
