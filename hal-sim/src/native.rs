//! The native simulator: the device code itself, in this process, in virtual
//! time. Any number can run side by side.

use crate::body::Drive;
use crate::world::{Output, Recorder};
use firmware::device::Identity;
use firmware::device::lockstep::{Lockstep, Sensors};
use firmware::link::{Kind, message::ResetCause};
use firmware::pulse::{Group, Partner};
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
    /// How `channel` drives what it is set to; `None` if it is not set up or
    /// the device cannot be looked into.
    fn output(&self, channel: usize) -> Option<Output>;
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
    fn output(&self, channel: usize) -> Option<Output> {
        let setup = self.setup()?;
        let stage = setup.channels.get(channel).copied().flatten()?.stage;
        let full_scale = f64::from(stage.full_scale().0) * 1e-3;
        let partner = |group: &&Group| group.members() & 1 << channel != 0;
        let group = setup.groups.iter().find(partner);
        Some(Output {
            full_scale: if stage.is_current() {
                Drive::Milliamps(full_scale)
            } else {
                Drive::Volts(full_scale)
            },
            conducted: group.is_some_and(|g| g.partner() == Partner::Conducted),
        })
    }

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
