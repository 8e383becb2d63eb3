//! Fixed-point arithmetic for a core with a 32×32→64 multiplier and no 64-bit
//! divider.
//!
//! Lives here: `fixed_point` (the laws' number format), `division` (quotients and
//! roots), `exponential` (and logarithm), `reciprocal` (one divisor, many
//! numerators). Not here: what is computed with it. In: words. Out: words, rounded
//! as each says.

pub mod division;
pub mod exponential;
pub mod fixed_point;
pub(crate) mod reciprocal;
