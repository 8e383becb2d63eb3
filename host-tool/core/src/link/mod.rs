//! The client side of the link: one typed method per request.
//!
//! Lives here: [`Client`], which does no input and output; the [`Connection`] that drives it
//! through a [`Port`] (real or virtual time), refusals with what to do about them, the device-clock estimate, the thread that
//! keeps a device told that its host is alive.
//! Not here: what a session asks for (`session`, `run`).

mod client;
mod clock;
mod connection;
#[cfg(feature = "realtime")]
mod elapsed;
mod error;
mod interruption;
mod keeper;
mod numbers;
#[cfg(feature = "realtime")]
mod paced;
mod port;
mod requests;
#[cfg(feature = "serial")]
mod serial;
mod stall;
#[cfg(feature = "realtime")]
mod stream;

pub use client::{Client, Incoming};
pub use clock::{Fit, stamp};
pub use connection::{Connection, Polled};
pub use error::{Error, Refused, advice, what};
pub use interruption::{Interruption, Signal};
pub use keeper::{Keeper, Lateness, UNATTENDED};
#[cfg(feature = "realtime")]
pub use paced::Paced;
pub use port::{Outlet, Port, SimulatedPort};
#[cfg(feature = "serial")]
pub use serial::SerialPort;
#[cfg(feature = "realtime")]
pub use stream::TcpPort;
