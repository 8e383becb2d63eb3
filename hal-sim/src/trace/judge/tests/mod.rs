//! Traces made wrong on purpose, one rule each, and right ones.

mod interlock;
mod rules;
mod scene;
