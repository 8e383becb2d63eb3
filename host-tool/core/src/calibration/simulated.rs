//! Simulated wearers that can be calibrated.

use hal_sim::body::bench::{InvalidBench, SensorSpec, Wrist, WristSpec};
use hal_sim::body::{Array, Body, FixedLoad};

/// Simulated wearer of a calibration.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SimulatedWearer {
    /// Forearm under ten electrodes in a force frame.
    #[default]
    Array,
    /// Wrist of Lee's subject K05, on channel 1.
    Wrist,
    /// Dummy loads; nothing moves.
    Still,
}

impl SimulatedWearer {
    /// All simulated wearers.
    pub const ALL: [Self; 3] = [Self::Array, Self::Wrist, Self::Still];

    /// Returns the name, for example "array".
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Array => "array",
            Self::Wrist => "wrist",
            Self::Still => "still",
        }
    }

    /// Returns the wearer with this name; `None` if there is none.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|wearer| wearer.name() == name)
    }

    /// Returns a description for the help of a command.
    #[must_use]
    pub const fn description(self) -> &'static str {
        match self {
            Self::Array => "Forearm under ten electrodes in a force frame",
            Self::Wrist => "Wrist of Lee's subject K05, on channel 1",
            Self::Still => "Dummy loads; nothing moves",
        }
    }

    /// Builds the rested wearer; `seed` decides its random values or its noise.
    ///
    /// # Errors
    /// The wearer's parameters are invalid.
    pub fn body(self, seed: u64) -> Result<Box<dyn Body>, InvalidBench> {
        Ok(match self {
            Self::Array => Box::new(Array::new(seed, SensorSpec::default())?),
            Self::Wrist => Box::new(Wrist::new(WristSpec::subject(4)?, seed)?),
            Self::Still => Box::new(FixedLoad::new(0.0)),
        })
    }
}
