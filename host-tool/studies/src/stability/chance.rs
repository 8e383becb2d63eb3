//! Random numbers that depend only on a seed and an index.

use hal_sim::random::{unit_from_word, word};

/// Returns a number uniform in [0, 1), from one random stream in which each seed has its own
/// section.
pub(super) fn uniform(seed: u64, index: u64) -> f64 {
    unit_from_word(word(0, (seed << 32 ^ index).wrapping_sub(1)))
}
