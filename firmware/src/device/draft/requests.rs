//! The draft in terms of requests: its edits, and the checksum over all of them.

use super::{Draft, Mistake};
use crate::link::{Request, SCHEMA, SetupSum};

impl Draft {
    /// Carries out a request that configures; returns `None` for any other request.
    pub fn configure(&mut self, request: &Request) -> Option<Result<(), Mistake>> {
        Some(match request {
            Request::Clear => {
                self.clear();
                Ok(())
            }
            Request::Wearer(spec) => self.set_wearer(*spec),
            Request::Channel { channel, spec } => self.set_channel(*channel, *spec),
            Request::Groups(groups) => self.set_groups(groups.clone()),
            Request::Sync { channel } => self.set_sync(*channel),
            Request::Muscle { channel, spec } => self.set_muscle(*channel, *spec),
            Request::Joint(spec) => self.set_joint(spec.clone()),
            Request::Wall(spec) => self.set_wall(*spec),
            Request::ForceControl { channel, spec } => self.set_force(*channel, *spec),
            Request::Limb(spec) => self.set_endpoint(*spec),
            Request::Line(spec) => self.set_line(spec.clone()),
            Request::Modulation(spec) => self.set_modulation(*spec),
            _ => return None,
        })
    }

    /// Converts `request` for a host that does not wait for answers, and that keeps this draft as
    /// a copy of the device's. Requests that configure also edit this draft, and an
    /// [`Request::Arm`] with checksum 0 gets the checksum of the present parts.
    #[must_use]
    pub fn prepare_request(&mut self, mut request: Request) -> Request {
        match &mut request {
            Request::Hello { schema } if *schema == SCHEMA => self.clear(),
            Request::Arm { setup } if *setup == 0 => *setup = self.checksum(),
            other => {
                let _ = self.configure(other); // refused here is refused there
            }
        }
        request
    }

    /// Returns the checksum over the parts, which are encoded again from the draft. For hosts,
    /// which have room for this; a device computes the checksum over the requests that it
    /// receives.
    #[must_use]
    pub fn checksum(&self) -> u32 {
        let mut sum = SetupSum::default();
        sum.note(&Request::Wearer(self.wearer));
        sum.note(&Request::Groups(self.groups.clone()));
        sum.note(&Request::Sync { channel: self.sync });
        if let Some(spec) = &self.joint {
            sum.note(&Request::Joint(spec.clone()));
        }
        if let Some(spec) = &self.wall {
            sum.note(&Request::Wall(*spec));
        }
        if let Some(spec) = &self.endpoint {
            sum.note(&Request::Limb(*spec));
        }
        for spec in &self.lines {
            sum.note(&Request::Line(spec.clone()));
        }
        for spec in self.modulations.iter().flatten() {
            sum.note(&Request::Modulation(*spec));
        }
        let parts = self.channels.iter().zip(&self.muscles).zip(&self.forces);
        for (channel, ((train, muscle), force)) in (0u8..).zip(parts) {
            if let Some(spec) = *train {
                sum.note(&Request::Channel { channel, spec });
            }
            if let Some(spec) = *muscle {
                sum.note(&Request::Muscle { channel, spec });
            }
            if let Some(spec) = *force {
                sum.note(&Request::ForceControl { channel, spec });
            }
        }
        sum.total()
    }
}
