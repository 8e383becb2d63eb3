//! The arm on a host: the better recruitment, and the device's geometry in exact
//! numbers.
//!
//! Lives here: the device's own `firmware::limb` in double precision ([`Exact`]) and as
//! matrices ([`Posed`]), bounded least squares over all muscles with smooth switching
//! ([`LeastSquares`]), static optimisation of any muscles about any joints ([`Muscles`]) and
//! activation by angle ([`Quartic`]), and what is told where something cannot be had
//! ([`Trouble`]).
//! Not here: the geometry itself and the nearest neighbour (`firmware::limb`), bodies.
//! In: a posture's Jacobians and a wanted wrench. Out: a force of each line, amplitudes.

mod activation;
mod bounded;
mod least_squares;
mod posed;
mod quartic;
mod trouble;
mod twin;

pub use activation::{Muscles, OutOfReach};
pub use bounded::Bounded;
pub use least_squares::{Found, LeastSquares, Weights, amplitudes, force};
pub use posed::{Forces, Posed, Torques, WrenchVector};
pub use quartic::{NoQuartic, Quartic, TERMS};
pub use trouble::Trouble;
pub use twin::{Exact, Single, ToDouble};
