//! One muscle's pulses shared by several electrodes: endurance, ripple, what is left.
mod declared;
mod error;
mod held;
mod person;
mod play;
mod session;
pub use declared::{Condition, DECLARED, Declared, Drive, Phase};
pub use error::DistributedError;
pub use held::{Endurance, Series, Window};
pub use person::Person;
pub use play::play;
