//! The client side of the link, with one typed method per request.
//!
//! This module holds the [`Client`], which does no input and output, and the [`Connection`] that
//! drives it through a [`Port`] in real or virtual time. It also has refusals with advice on each,
//! the estimate of the device's clock, and the thread that sends keep-alives. The content of a
//! session is chosen in `session` and `run`.

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
pub use error::{Error, RefusalInWords, advice, meaning};
pub use interruption::{Interruption, Signal};
pub use keeper::{Keeper, Lateness, UNATTENDED};
#[cfg(feature = "realtime")]
pub use paced::PacedPort;
pub use port::{Outlet, Port, SimulatedPort};
#[cfg(feature = "serial")]
pub use serial::{FlexorPort, SerialPort, flexor_ports};
#[cfg(feature = "realtime")]
pub use stream::TcpPort;
