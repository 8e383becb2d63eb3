//! The three parts of the device program ("owners"), connected with one another.
//!
//! [`Pulser`] refills 250 µs windows, [`Controller`] ticks at 1 kHz, [`Session`] receives and
//! sends bytes. Each runs in one execution context and communicates with the others through the
//! single-producer mailboxes of [`Mailboxes`]. [`Draft`] alone contains the rules between parts of
//! a setup; the device and hosts both use it. `lockstep` runs the three in virtual time, for the
//! native simulator and for QEMU; a board runs them from its interrupts and executors.

mod controller;
mod draft;
mod mail;
mod mistake;
mod part;
mod pulser;
mod session;

pub use controller::{Controller, MuscleTables};
pub use draft::{Draft, validate_channel};
pub use mail::{ControllerMail, Mailboxes, PulserMail, SessionMail};
pub use mistake::{Mistake, Part, Rule};
pub use part::Muscle;
pub use pulser::Pulser;
pub use session::{Identity, Restart, Session, first_session_number};

/// Number of windows from one control tick to the next, which gives 1 kHz.
pub const WINDOWS_PER_TICK: u32 = 4;

/// Time from a window's start to the refill of the next window, µs.
pub const REFILL_OFFSET_US: u32 = 2;
