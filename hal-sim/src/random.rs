//! Random numbers from a seed, for all simulators, studies and tests.
//!
//! The generator is counter-based: number `index` of stream `seed` is a function of these two, so
//! that an additional or omitted number changes no other number. The function is SplitMix64
//! (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014, figure
//! 17), whose state is a counter. It never changes: a seed gives the same run in every version.

use std::cell::Cell;
use std::f64::consts::TAU;

/// Increment of the counter: 2^64 divided by the golden ratio, made odd.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// Returns number `index` of stream `seed`, all 64 bits of it. Streams overlap if their seeds
/// differ by a few `STEP`s; those of small seeds do not.
#[must_use]
pub const fn word(seed: u64, index: u64) -> u64 {
    let z = seed.wrapping_add(index.wrapping_add(1).wrapping_mul(STEP));
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Numbers of a stream in their order, for code that draws an unknown number of them.
#[derive(Clone, Debug)]
pub struct Sequence {
    seed: u64,
    index: u64,
}

impl Sequence {
    /// Creates the sequence of stream `seed`.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { seed, index: 0 }
    }

    /// Returns the next number, all 64 bits of it.
    pub const fn next_word(&mut self) -> u64 {
        let number = word(self.seed, self.index);
        self.index = self.index.wrapping_add(1);
        number
    }

    /// Returns a number from 0 to `limit` − 1, or 0 if `limit` is 0. The bias is below `limit` /
    /// 2⁶⁴.
    pub const fn below(&mut self, limit: u64) -> u64 {
        ((self.next_word() as u128 * limit as u128) >> 64) as u64 // below `limit`
    }

    /// Returns the upper byte of the next number.
    pub const fn byte(&mut self) -> u8 {
        (self.next_word() >> 56) as u8
    }
}

/// Converts the upper 53 bits of `word` into a number in [0, 1).
#[must_use]
pub const fn unit_from_word(word: u64) -> f64 {
    (word >> 11) as f64 / (1_u64 << 53) as f64
}

/// Returns uniform deviate number `index` of stream `seed`, in [0, 1). The seed is scrambled first,
/// so that no two streams of small seeds share a number.
#[must_use]
pub const fn unit(seed: u64, index: u64) -> f64 {
    unit_from_word(word(word(seed, 0).wrapping_add(index), 0))
}

/// Returns standard normal deviate number `index` of stream `seed`, by the method of Box and
/// Muller.
#[must_use]
pub fn standard_normal(seed: u64, index: u64) -> f64 {
    // The first uniform deviate lies in (0, 1], so its logarithm is finite.
    let radius = 1.0 - unit(seed, 2 * index);
    let turn = unit(seed, 2 * index + 1);
    (-2.0 * libm::log(radius)).sqrt() * libm::cos(TAU * turn)
}

/// Standard normal deviates of a stream. The latest one is cached, because a sensor may be read
/// several times between two changes of its noise.
#[derive(Clone, Debug)]
pub struct Noise {
    seed: u64,
    latest: Cell<(u64, f64)>,
}

impl Noise {
    /// Creates the noise of stream `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let latest = Cell::new((0, standard_normal(seed, 0)));
        Self { seed, latest }
    }

    /// Returns [`standard_normal`] number `index` of the stream.
    #[must_use]
    pub fn at(&self, index: u64) -> f64 {
        if self.latest.get().0 != index {
            self.latest.set((index, standard_normal(self.seed, index)));
        }
        self.latest.get().1
    }
}

/// The cached deviate does not affect equality.
impl PartialEq for Noise {
    fn eq(&self, other: &Self) -> bool {
        self.seed == other.seed
    }
}

/// Random number stream whose numbers are taken one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    seed: u64,
    drawn: u64,
}

impl Random {
    /// Creates stream `seed` at its first number.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self { seed, drawn: 0 }
    }

    /// Returns the next 64 random bits.
    pub const fn word(&mut self) -> u64 {
        let word = word(self.seed, self.drawn);
        self.drawn += 1;
        word
    }

    /// Returns the next number, uniform in [0, 1).
    pub const fn unit(&mut self) -> f64 {
        unit_from_word(self.word())
    }

    /// Returns the next integer in `0..end`, nearly uniform if `end` is far below 2^64; `end` must
    /// not be zero.
    pub const fn below(&mut self, end: u64) -> u64 {
        self.word() % end
    }

    /// Returns the next number between `low` and `high`, uniformly distributed.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Shuffles `items` (Fisher and Yates; Knuth 1997, algorithm 3.4.2P).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            items.swap(last, self.below(last as u64 + 1) as usize);
        }
    }

    /// Returns the next number between the positive `low` and `high`; its logarithm is uniformly
    /// distributed.
    pub fn log_between(&mut self, low: f64, high: f64) -> f64 {
        low * libm::pow(high / low, self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the values that other implementations of SplitMix64 print for seed 1234567.
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
        // The tolerance of each moment is four standard errors.
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
