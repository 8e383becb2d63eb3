//! Chance that depends on a seed and a number only.

/// Evenly in [0, 1): the output function of SplitMix64 (Steele, Lea, Flood 2014).
pub(super) fn even(seed: u64, index: u64) -> f64 {
    let z = (seed << 32 ^ index).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
