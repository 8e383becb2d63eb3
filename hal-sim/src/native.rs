//! Native backend: runs the device code in this process, in virtual time. Any number of devices can
//! run side by side.

use crate::body::Drive;
use crate::lockstep::{Device, Output};
use firmware::device::{Identity, first_session_number};
use firmware::link::{Kind, message::ResetCause};
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::pulse::{Group, Partner};
use firmware::safety::Stages;
use firmware::units::Micros;
use std::io;

/// Returns the identity that a simulator reports.
#[must_use]
pub const fn identity(kind: Kind) -> Identity {
    Identity {
        kind,
        unique_id: [0; 3],
        reset: ResetCause::PowerOn,
        last_fault: None,
        first_session: 1,
        stages: Stages::AsConfigured,
        option_bytes: None,
        board: "",
        crystal_hz: 0,
        has_boot_loader: false,
    }
}

/// Returns the number of the first session of a simulator with this seed.
#[must_use]
pub fn seeded_session(seed: u64) -> u16 {
    first_session_number(&[seed as u32, (seed >> 32) as u32])
}

/// Creates a device like [`native`], but derives the number of its first session from `seed`.
#[must_use]
pub fn native_seeded(boot: Micros, seed: u64) -> Lockstep {
    let identity = Identity {
        first_session: seeded_session(seed),
        ..identity(Kind::Native)
    };
    Lockstep::new(identity, boot)
}

/// Creates a native device that boots at `boot`; its first session has number 1.
#[must_use]
pub fn native(boot: Micros) -> Lockstep {
    Lockstep::new(identity(Kind::Native), boot)
}

impl Device for Lockstep {
    fn fork(&self) -> Option<Box<dyn Device>> {
        Some(Box::new(self.clone()))
    }

    fn output(&self, channel: usize) -> Option<Output> {
        let setup = self.setup()?;
        let stage = setup.channels.get(channel).copied().flatten()?.stage;
        let full_scale = f64::from(stage.full_scale().get()) * 1e-3;
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
