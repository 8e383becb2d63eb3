//! The arm on a host: the better recruitment, and the device's geometry in exact numbers.
//!
//! This module holds the device's own `firmware::limb` in double precision ([`Exact`]) and as
//! matrices ([`PostureMatrices`]), bounded least squares over all muscles with smooth switching
//! ([`LeastSquares`]), static optimisation of any muscles about any joints ([`Muscles`]),
//! activation as a function of angle ([`Quartic`]), and the errors ([`RecruitmentError`]). The inputs are a
//! posture's Jacobians and a wanted wrench; the outputs are a force for each line, and amplitudes.
//! The geometry itself and the nearest neighbour are in `firmware::limb`, and bodies in `hal_sim`.

mod activation;
mod bounded;
mod least_squares;
mod posed;
mod quartic;
mod trouble;
mod twin;

pub use activation::{Muscles, OutOfReach};
pub use bounded::Bounded;
pub use least_squares::{LeastSquares, Solution, Weights, amplitudes, force};
pub use posed::{Forces, PostureMatrices, Torques, WrenchVector};
pub use quartic::{NoQuartic, Quartic, TERMS};
pub use trouble::RecruitmentError;
pub use twin::{Exact, Single, ToDouble};
