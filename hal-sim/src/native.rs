//! The native simulator: the device code itself, in this process, in virtual
//! time. Any number can run side by side.

use crate::body::Drive;
pub use crate::lockstep::Device;
use crate::world::Output;
use firmware::device::Identity;
use firmware::device::lockstep::{Lockstep, Sensors, Sink};
use firmware::link::{Kind, message::ResetCause};
use firmware::pulse::{Group, Partner};
use firmware::units::Micros;
use std::io;

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
        mut sink: &mut dyn Sink,
    ) -> io::Result<()> {
        Lockstep::receive(self, at, bytes, sensors, &mut sink);
        Ok(())
    }

    fn advance(
        &mut self,
        to: Micros,
        sensors: &Sensors,
        mut sink: &mut dyn Sink,
    ) -> io::Result<()> {
        Lockstep::advance(self, to, sensors, &mut sink);
        Ok(())
    }
}
