//! The native simulator: the device code itself, in this process, in virtual
//! time. Any number can run side by side.

use crate::world::Recorder;
use firmware::device::Identity;
use firmware::device::lockstep::{Lockstep, Sensors};
use firmware::link::{Kind, message::ResetCause};
use firmware::units::Micros;

/// A device that lives in virtual time.
pub trait Device: Send {
    /// Bytes arrive at `at`.
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut Recorder,
    ) -> std::io::Result<()>;
    /// Time goes on to `to`.
    ///
    /// # Errors
    /// The device cannot be reached any more.
    fn advance(
        &mut self,
        to: Micros,
        sensors: &Sensors,
        sink: &mut Recorder,
    ) -> std::io::Result<()>;
}

/// What simulators say of themselves.
#[must_use]
pub const fn identity(kind: Kind) -> Identity {
    Identity {
        kind,
        unique_id: [0; 3],
        reset: ResetCause::PowerOn,
        last_fault: None,
    }
}

/// A native board that boots at `boot`.
#[must_use]
pub fn native(boot: Micros) -> Lockstep {
    Lockstep::new(identity(Kind::Native), boot)
}

impl Device for Lockstep {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut Recorder,
    ) -> std::io::Result<()> {
        Lockstep::receive(self, at, bytes, sensors, sink);
        Ok(())
    }

    fn advance(
        &mut self,
        to: Micros,
        sensors: &Sensors,
        sink: &mut Recorder,
    ) -> std::io::Result<()> {
        Lockstep::advance(self, to, sensors, sink);
        Ok(())
    }
}
