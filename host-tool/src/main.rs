//! The flexor program.
fn main() {}
