//! What identifies a session on a forearm: its electrodes, skin and solved thresholds.

use serde::{Deserialize, Serialize};

/// Electrodes and skin of a session.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// Number of the session, from 0, by which its skin is drawn.
    pub session: u64,
    /// Indices of the places of A and B.
    pub points: [usize; 2],
}

/// A session of table 7 whose thresholds are met.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solved {
    /// Electrodes and skin.
    pub setup: Setup,
    /// Factor on every threshold of a nerve.
    pub factor: f64,
    /// Couplings of A, B and the extensor's point.
    pub coupling: [f64; 3],
}
