//! Where the device of a drive comes from.

use super::DriveError;
#[cfg(feature = "realtime")]
use crate::link::PacedPort;
use crate::link::Port;
use crate::run::{BodyError, DeviceName, OpenError, RunError, create_body, simulated_port_with};
use crate::session::Session;
use firmware::units::Micros;
use hal_sim::body::Body;
use hal_sim::native::native_seeded;

/// Creates the simulated wearer of a session from a seed.
pub type BodyMaker = Box<dyn FnMut(&Session, u64) -> Result<Box<dyn Body>, BodyError> + Send>;

/// Device that a drive opens.
pub enum Source {
    /// Native simulator with its wearer.
    Simulated {
        /// Seed of the wearer's noise and of the number of the first session.
        seed: u64,
        /// Creates the wearer; `None` for the session's own.
        body: Option<BodyMaker>,
        /// Whether virtual time advances at the pace of the wall clock.
        is_paced: bool,
    },
    /// Device behind a port, or a simulator that runs an image.
    Device(DeviceName),
}

impl Source {
    /// Returns the native simulator with the session's own wearer, in virtual time.
    #[must_use]
    pub const fn simulated(seed: u64) -> Self {
        Self::Simulated {
            seed,
            body: None,
            is_paced: false,
        }
    }

    /// Returns the name of the device in a record.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Simulated { .. } => DeviceName::Native.to_string(),
            Self::Device(name) => name.to_string(),
        }
    }

    /// Returns the seed of a simulator of this program; `None` for a device behind a port.
    #[must_use]
    pub const fn seed(&self) -> Option<u64> {
        match self {
            Self::Simulated { seed, .. } => Some(*seed),
            Self::Device(_) => None,
        }
    }

    /// Connects to a device that exists without a session; `None` for a simulator.
    pub(super) fn connect(&self) -> Result<Option<Box<dyn Port>>, OpenError> {
        match self {
            Self::Device(name) if name.is_port() => Ok(Some(name.connect()?)),
            Self::Simulated { .. } | Self::Device(_) => Ok(None),
        }
    }

    /// Opens the device for `session`.
    pub(super) fn open(&mut self, session: &Session) -> Result<Box<dyn Port>, OpenError> {
        match self {
            Self::Simulated {
                seed,
                body,
                is_paced,
            } => {
                let wearer = match body {
                    Some(make) => make(session, *seed)?,
                    None => create_body(session, *seed)?,
                };
                let boot = Micros::new(0);
                let device = Box::new(native_seeded(boot, *seed));
                let port = simulated_port_with(wearer, session, *seed, device, boot);
                Ok(paced(port, *is_paced))
            }
            Self::Device(name) => name.open(session, 1),
        }
    }

    /// Returns the same source for a copy of its simulator; `None` for a device that is not
    /// simulated in this process. The copy keeps its own wearer, so no wearer is ever created.
    pub(super) const fn copy(&self) -> Option<Self> {
        match self {
            Self::Simulated { seed, .. } => Some(Self::simulated(*seed)),
            Self::Device(_) => None,
        }
    }

    /// Sets the seed of the next wearer.
    pub(super) const fn reseed(&mut self, new: u64) -> Result<(), DriveError> {
        match self {
            Self::Simulated { seed, .. } => {
                *seed = new;
                Ok(())
            }
            Self::Device(_) => Err(DriveError::NotSimulated("reset()")),
        }
    }

    /// Returns whether the port can be used again after a trial that ended with `error`. A port
    /// whose device was lost is opened again.
    pub(super) const fn is_reusable(&self, error: Option<&RunError>) -> bool {
        matches!(self, Self::Simulated { .. })
            || !matches!(error, Some(RunError::Link(crate::link::Error::Lost(_))))
    }
}

#[cfg(feature = "realtime")]
fn paced(port: impl Port + 'static, is_paced: bool) -> Box<dyn Port> {
    match is_paced {
        true => Box::new(PacedPort::new(port)),
        false => Box::new(port),
    }
}

#[cfg(not(feature = "realtime"))]
fn paced(port: impl Port + 'static, _: bool) -> Box<dyn Port> {
    Box::new(port)
}
