//! The laboratory's machinery: what every paper's protocol shares.

pub mod search;
