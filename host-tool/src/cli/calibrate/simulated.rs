//! Simulated wearers that can be calibrated.

use clap::ValueEnum;
use hal_sim::body::bench::{SensorSpec, Wrist, WristSpec};
use hal_sim::body::{Array, Body, FixedLoad};

/// Name of a simulated wearer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, ValueEnum)]
pub enum BodyName {
    /// Forearm under ten electrodes in a force frame
    #[default]
    Array,
    /// Wrist of Lee's subject K05, on channel 1
    Wrist,
    /// Dummy loads; nothing moves
    Still,
}

impl BodyName {
    /// Returns the name as the user types it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Array => "array",
            Self::Wrist => "wrist",
            Self::Still => "still",
        }
    }

    /// Builds the rested wearer; `seed` decides its random values or its noise.
    ///
    /// # Errors
    /// Fails if the wearer's parameters are invalid.
    pub fn body(self, seed: u64) -> anyhow::Result<Box<dyn Body>> {
        Ok(match self {
            Self::Array => Box::new(Array::new(seed, SensorSpec::default())?),
            Self::Wrist => Box::new(Wrist::new(WristSpec::subject(4)?, seed)?),
            Self::Still => Box::new(FixedLoad::new(0.0)),
        })
    }
}
