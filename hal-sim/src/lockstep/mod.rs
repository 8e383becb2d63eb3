//! Devices that live in virtual time, driven in lock-step.
//!
//! Lives here: [`Device`], what every simulated device can do, the device code
//! in this process as one ([`Lockstep`]), and [`Remote`], one at the other end
//! of a line. Not here: what is at that end (`qemu`).
//! In: bytes, sensors and how far time goes. Out: levels, DAC codes, bytes.

mod remote;

pub use remote::Remote;

use firmware::device::lockstep::{Lockstep, Sensors, Sink};
use firmware::units::Micros;
use std::io;

/// A device that lives in virtual time.
pub trait Device: Send {
    /// Bytes arrive, the last one at `at`; see [`Lockstep::receive`].
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()>;

    /// Time goes on to `to`; see [`Lockstep::advance`].
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()>;
}

impl Device for Lockstep {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        mut sink: &mut dyn Sink,
    ) -> io::Result<()> {
        Self::receive(self, at, bytes, sensors, &mut sink);
        Ok(())
    }

    fn advance(
        &mut self,
        to: Micros,
        sensors: &Sensors,
        mut sink: &mut dyn Sink,
    ) -> io::Result<()> {
        Self::advance(self, to, sensors, &mut sink);
        Ok(())
    }
}
