//! Machine code to operations, decoded once.

/// Decoded code by address.
#[derive(Debug, Default)]
pub(super) struct Cache {}
