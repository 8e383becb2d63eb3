//! Chance that depends on a seed and a number only.

use hal_sim::random::{part, word};

/// Evenly in [0, 1), from the one stream in which each seed has a place of its own.
pub(super) fn even(seed: u64, index: u64) -> f64 {
    part(word(0, (seed << 32 ^ index).wrapping_sub(1)))
}
