//! The study as it is asked for.

use super::declared::RampsDeclaration;
use super::device::play_all_on_device;
use super::error::RampsError;
use super::found::{DrawMeasurements, DrawResult, Pulses};
use super::latency::latency;
use super::person::RampsWearer;
use host_core::run::DeviceName;

/// What a command calls it.
pub const NAME: &str = "harris-ramps";
/// The paper's participants: the first persons drawn.
pub(super) const PARTICIPANTS: u64 = 2;

/// The study.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: RampsDeclaration,
    /// Of everybody's draws.
    pub(super) seed: u64,
    /// Persons.
    pub(super) draws: u64,
    pub(super) device: DeviceName,
}

impl Study {
    /// With this seed and so many persons; the declaration's own without.
    ///
    /// # Errors
    /// E690: the declaration cannot be read.
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

    /// Persons that are computed: the two participants are always shown.
    #[must_use]
    pub fn persons(&self) -> u64 {
        self.draws.max(PARTICIPANTS)
    }

    /// Persons drawn, as asked.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    /// What was declared.
    #[must_use]
    pub const fn declaration(&self) -> &RampsDeclaration {
        &self.declared
    }

    /// The pulses of every stimulation as the device puts them out, and what was learnt of the
    /// device on the way.
    ///
    /// # Errors
    /// The device is not there; E692: it does not play them.
    pub fn play_on_device(&self) -> Result<(Pulses, Vec<String>), RampsError> {
        let (pulses, apart) = play_all_on_device(&self.declared, &self.device)?;
        let latency = latency(&self.device)?;
        let device = &self.device;
        Ok((
            pulses,
            vec![apart.in_words(device), latency.in_words(device)],
        ))
    }

    /// Person `index`, of whom this was measured.
    ///
    /// # Errors
    /// E690: the declaration.
    pub(super) fn restore_draw(
        &self,
        index: u64,
        kept: DrawMeasurements,
    ) -> Result<DrawResult, RampsError> {
        let person = RampsWearer::random(&self.declared, self.seed, index)?;
        Ok(DrawResult { person, kept })
    }

    /// What comes of person `index` under these pulses.
    ///
    /// # Errors
    /// E690, E691: a declaration or a bench that cannot be.
    pub fn compute_draw(&self, index: u64, pulses: &Pulses) -> Result<DrawResult, RampsError> {
        let is_shown = index < PARTICIPANTS;
        DrawResult::measure(&self.declared, (self.seed, index), pulses, is_shown)
    }
}
