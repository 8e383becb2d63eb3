//! The runner behind `cargo verify`.
fn main() {}
