//! The three owners wired together, and nothing else.
//!
//! [`Pulser`] refills 250 µs windows, [`Controller`] ticks at 1 kHz,
//! [`Session`] takes bytes. Each is owned by one execution context and talks
//! to the others through the single-producer mailboxes of [`Mailboxes`].
//! [`Draft`] is the one place of the rules between parts of a setup: the device and
//! hosts ask it. `lockstep` runs the three in virtual time, for the native simulator and
//! for QEMU; a board runs them from its interrupts and executors.

mod controller;
mod draft;
mod mail;
mod mistake;
mod part;
mod pulser;
mod session;

pub use controller::Controller;
pub use draft::{Draft, channel_of};
pub use mail::{ControllerMail, Mailboxes, PulserMail, SessionMail};
pub use mistake::{Mistake, Part, Rule};
pub use part::Muscle;
pub use pulser::Pulser;
pub use session::{Identity, Session, first_session};

/// Windows from one control tick to the next: 1 kHz.
pub const WINDOWS_PER_TICK: u32 = 4;

/// From a window's start to the refill of the next one, µs.
pub const REFILL_OFFSET_US: u32 = 2;
