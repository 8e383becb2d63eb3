//! The simulated wearers that can be calibrated.

use clap::ValueEnum;
use hal_sim::body::bench::{SensorSpec, Wrist, WristSpec};
use hal_sim::body::{Array, Body, FixedLoad};

/// A simulated wearer by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, ValueEnum)]
pub enum BodyName {
    /// A forearm under ten electrodes in a force frame
    #[default]
    Array,
    /// Lee's wrist, subject K05, on channel 1
    Wrist,
    /// Dummy loads: nothing moves
    Still,
}

impl BodyName {
    /// As it is typed.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Array => "array",
            Self::Wrist => "wrist",
            Self::Still => "still",
        }
    }

    /// The body, rested; `seed` draws it or its noise.
    ///
    /// # Errors
    /// A body that cannot be.
    pub fn body(self, seed: u64) -> anyhow::Result<Box<dyn Body>> {
        Ok(match self {
            Self::Array => Box::new(Array::new(seed, SensorSpec::default())?),
            Self::Wrist => Box::new(Wrist::new(WristSpec::subject(4)?, seed)?),
            Self::Still => Box::new(FixedLoad::new(0.0)),
        })
    }
}
