//! Shared code of tests across packages, and the `cargo verify` runner.
//!
//! The runner is built without the feature `devices`: it depends on no package that it checks,
//! starts in seconds on a fresh machine, and can report that one of them does not compile.

#[cfg(feature = "devices")]
pub mod desk;
#[cfg(feature = "devices")]
pub mod differential;
#[cfg(feature = "devices")]
pub mod expectation;
#[cfg(feature = "devices")]
pub mod fuzz;
#[cfg(feature = "devices")]
pub mod mutants;
#[cfg(feature = "devices")]
pub mod record;
pub mod verify;
