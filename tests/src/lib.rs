//! What tests across packages share.

pub mod expectation;
