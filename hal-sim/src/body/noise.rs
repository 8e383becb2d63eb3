//! Sensor noise that depends on the seed and the sample's number only, so that
//! reading twice, or not reading, changes nothing.

use std::f64::consts::TAU;

/// Standard normal deviate number `index` of stream `seed`.
pub(super) fn standard_normal(seed: u64, index: u64) -> f64 {
    // Box-Muller. The first uniform lies in (0, 1], so its logarithm is finite.
    let radius = 1.0 - unit(seed, 2 * index);
    let turn = unit(seed, 2 * index + 1);
    (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
}

/// Uniform deviate in [0, 1) from 53 bits.
pub(super) fn unit(seed: u64, index: u64) -> f64 {
    (mix(mix(seed).wrapping_add(index)) >> 11) as f64 / (1u64 << 53) as f64
}

/// The output function of SplitMix64 (Steele, Lea, Flood 2014) after one step.
fn mix(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(standard_normal(1, 5), standard_normal(1, 5));
    }
}
