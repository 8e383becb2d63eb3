//! Chance that depends on a seed and a number only.

use hal_sim::random::{unit_from_word, word};

/// Evenly in [0, 1), from the one stream in which each seed has a place of its own.
pub(super) fn uniform(seed: u64, index: u64) -> f64 {
    unit_from_word(word(0, (seed << 32 ^ index).wrapping_sub(1)))
}
