//! Random numbers that depend only on a seed and an index.

use hal_sim::random::{unit_from_word, word};

/// Returns a random number from 0 inclusive to 1 exclusive. Different seeds use different sections
/// of one random stream.
pub(super) fn uniform(seed: u64, index: u64) -> f64 {
    unit_from_word(word(0, (seed << 32 ^ index).wrapping_sub(1)))
}
