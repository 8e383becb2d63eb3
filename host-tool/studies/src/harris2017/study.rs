//! Carries out the study for one seed, number of wearers and device.

use super::declared::RampsDeclaration;
use super::device::play_all_on_device;
use super::error::RampsError;
use super::found::{DrawMeasurements, DrawResult, Pulses};
use super::latency::latency;
use super::person::RampsWearer;
use host_core::run::DeviceName;

/// Name of the study on the command line.
pub const NAME: &str = "harris-ramps";
/// Number of wearers who stand for the paper's participants: the first draws.
pub(super) const PARTICIPANTS: u64 = 2;

/// Declaration, seed, size and device of the study.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: RampsDeclaration,
    pub(super) seed: u64,
    /// Number of random wearers.
    pub(super) draws: u64,
    pub(super) device: DeviceName,
}

impl Study {
    /// Creates the study with this seed and number of wearers; `None` takes the preregistered
    /// value.
    ///
    /// # Errors
    /// Returns E690 if the declaration cannot be read.
    pub fn new(
        (seed, draws): (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, RampsError> {
        let declared = RampsDeclaration::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(declared.seed),
            draws: draws.unwrap_or(declared.draws),
            declared,
            device,
        })
    }

    /// Returns the number of wearers that are computed; at least the two participants, which are
    /// always shown.
    #[must_use]
    pub fn persons(&self) -> u64 {
        self.draws.max(PARTICIPANTS)
    }

    /// Returns the requested number of random wearers.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    #[must_use]
    pub const fn declaration(&self) -> &RampsDeclaration {
        &self.declared
    }

    /// Plays every stimulation on the device. Returns the pulses, and notes about the device for
    /// the report.
    ///
    /// # Errors
    /// Fails if the device cannot be opened. Returns E692 if it does not play a stimulation.
    pub fn play_on_device(&self) -> Result<(Pulses, Vec<String>), RampsError> {
        let (pulses, apart) = play_all_on_device(&self.declared, &self.device)?;
        let latency = latency(&self.device)?;
        let device = &self.device;
        Ok((
            pulses,
            vec![apart.in_words(device), latency.in_words(device)],
        ))
    }

    /// Restores wearer `index` with its stored measurements.
    ///
    /// # Errors
    /// Returns E690 if the declaration lacks a range.
    pub(super) fn restore_draw(
        &self,
        index: u64,
        kept: DrawMeasurements,
    ) -> Result<DrawResult, RampsError> {
        let person = RampsWearer::random(&self.declared, self.seed, index)?;
        Ok(DrawResult { person, kept })
    }

    /// Measures wearer `index` with these pulses.
    ///
    /// # Errors
    /// Returns E690 or E691 if the declaration or the test rig is invalid.
    pub fn compute_draw(&self, index: u64, pulses: &Pulses) -> Result<DrawResult, RampsError> {
        let is_shown = index < PARTICIPANTS;
        DrawResult::measure(&self.declared, (self.seed, index), pulses, is_shown)
    }
}
